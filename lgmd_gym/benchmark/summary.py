"""What a run's rows sum up to, with an interval beside every rate."""

import csv
import re
from collections.abc import Callable, Iterable
from math import sqrt
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from lgmd_gym.benchmark.sensors import CLEAR
from lgmd_gym.benchmark.statistics import Mean, cluster_mean

Row = dict[str, Any]
COLUMNS = (
    "agent",
    "condition",
    "case",
    "threats",
    "avoided",
    "avoided_low",
    "avoided_high",
    "speed_reduction",
    "speed_reduction_low",
    "speed_reduction_high",
    "ttc_at_brake",
    "premature",
    "quiet",
    "false_activations",
    "false_low",
    "false_high",
    "errors",
)


class Rate(NamedTuple):
    """k of n with its Wilson 95 % interval; 0 of n is not zero."""

    k: int
    n: int
    low: float
    high: float

    @classmethod
    def of(cls, flags: Iterable[bool]) -> "Rate":
        """Return the rate of True among `flags`."""
        values = list(flags)
        k, n = sum(values), len(values)
        low, high = wilson(k, n)
        return cls(k, n, low, high)


def wilson(k: float, n: int, z: float = 1.959964) -> tuple[float, float]:
    """Return the Wilson score interval of k successes in n trials; (0, 1) for none.

    Example:
        >>> [round(bound, 3) for bound in wilson(0, 10)]
        [0.0, 0.278]
    """
    if n == 0:
        return 0.0, 1.0
    share = k / n
    centre = share + z * z / (2 * n)
    spread = z * sqrt(share * (1 - share) / n + z * z / (4 * n * n))
    scale = 1 + z * z / n
    return max((centre - spread) / scale, 0.0), min((centre + spread) / scale, 1.0)


class Score(NamedTuple):
    """One agent over a set of episodes.

    Attributes:
        agent: The agent's string.
        group: What the episodes share.
        avoided: Threats avoided without premature braking.
        speed_reduction: Mean over threats, bootstrapped by case [m/s].
        ttc_at_brake: Median over threats in which it braked [s]; None without one.
        premature: Threats in which it braked too early to count.
        false_activations: Episodes without a threat in which it braked.
        errors: Episodes that could not be played.
    """

    agent: str
    group: str
    avoided: Rate
    speed_reduction: Mean
    ttc_at_brake: float | None
    premature: Rate
    false_activations: Rate
    errors: int


def score(agent: str, group: str, rows: list[Row]) -> Score:
    """Sum up one agent's rows."""
    played = [row for row in rows if row["error"] is None]
    threats = [row for row in played if row["threat"]]
    quiet = [row for row in played if not row["threat"]]
    braked = [row["ttc_at_brake"] for row in threats if row["ttc_at_brake"] is not None]
    return Score(
        agent,
        group,
        Rate.of(row["avoided"] for row in threats),
        cluster_mean([row["speed_reduction"] for row in threats], [row["case"] for row in threats]),
        median(braked) if braked else None,
        Rate.of(row["premature_brake"] for row in threats),
        Rate.of(row["false_activation"] for row in quiet),
        len(rows) - len(played),
    )


def scores(rows: list[Row], group: Callable[[Row], str]) -> list[Score]:
    """Return one score per agent and group, in the order of their first case's name, then of the agents'.

    The order in which the episodes finished does not matter.
    """
    cells: dict[tuple[str, str], list[Row]] = {}
    for row in sorted(rows, key=lambda row: (case_order(row["case"]), row["agent"])):
        cells.setdefault((row["agent"], group(row)), []).append(row)
    return [score(agent, name, of_cell) for (agent, name), of_cell in cells.items()]


def by_condition(rows: list[Row]) -> dict[str, list[Row]]:
    """Return the rows of each camera condition, in the order in which these come."""
    found: dict[str, list[Row]] = {}
    for row in rows:
        found.setdefault(row.get("condition", CLEAR), []).append(row)
    return found


def case_order(case: str) -> list[tuple[int, str]]:
    """Return a sort key in which numbers count as numbers: v5 before v10."""
    parts = re.split(r"(\d+)", case)
    return [(int(part), "") if part.isdigit() else (0, part) for part in parts]


def automatic(rows: list[Row]) -> list[Row]:
    """Return the rows that totals of automatic braking count: not those in which a warned driver brakes."""
    return [row for row in rows if not row.get("fcw_driver")]


def write_summary(rows: list[Row], path: Path) -> None:
    """Write one line per agent, condition and case to a CSV file, in SI units; a line "all" sums up."""
    conditions = sorted(by_condition(rows).items())
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for condition, of_condition in conditions:
            for item in scores(of_condition, lambda row: row["case"]):
                writer.writerow(_line(item, condition))
        for condition, of_condition in conditions:
            for item in scores(automatic(of_condition), lambda row: "all"):
                writer.writerow(_line(item, condition))


def _line(item: Score, condition: str) -> list[Any]:
    avoided, false, speed = item.avoided, item.false_activations, item.speed_reduction
    threats = [avoided.n, avoided.k, _bound(avoided, "low"), _bound(avoided, "high")]
    quiet = [false.n, false.k, _bound(false, "low"), _bound(false, "high")]
    means = [_round(value) for value in (speed.value, speed.low, speed.high, item.ttc_at_brake)]
    return [item.agent, condition, item.group, *threats, *means, item.premature.k, *quiet, item.errors]


def _bound(rate: Rate, bound: str) -> str:
    return f"{getattr(rate, bound):.4f}" if rate.n else ""


def _round(value: float | None) -> str:
    return "" if value is None else f"{value:.4f}"
