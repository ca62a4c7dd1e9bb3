"""Summaries of a run's rows, with an interval for every rate."""

import csv
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from lgmd_gym.benchmark.rows import Row
from lgmd_gym.errors import counted
from lgmd_gym.processes.files import complete_file
from lgmd_gym.statistics.intervals import Mean, Rate, cluster_mean

COLUMNS = (
    "agent",
    "condition",
    "case",
    "cases",
    "worlds",
    "threats",
    "avoided",
    "avoided_low",
    "avoided_high",
    "speed_reduction",
    "speed_reduction_low",
    "speed_reduction_high",
    "ttc_at_brake",
    "premature",
    "non_threats",
    "false_activations",
    "false_low",
    "false_high",
    "errors",
)


INTERVAL_TEXT = "95 % interval, clustered by case and world"


class Sample(NamedTuple):
    """Numbers of cases and worlds of a group of rows, between which outcomes may be independent."""

    cases: int
    worlds: int

    @classmethod
    def of(cls, rows: Iterable[Row]) -> "Sample":
        """Return the numbers of distinct cases and worlds of rows."""
        pairs = [(row["case"], row.get("world")) for row in rows]
        return cls(len({case for case, _ in pairs}), len({world for _, world in pairs}))

    def __str__(self) -> str:
        return f"{counted(self.cases, 'case')} in {counted(self.worlds, 'world')}"


class AgentSummary(NamedTuple):
    """Summary of one agent over a group of episodes.

    Attributes:
        agent: Agent string.
        group: Name of the group.
        sample: Numbers of cases and worlds.
        avoided: Threats avoided without premature braking.
        speed_reduction: Mean over threats, bootstrapped by case and world [m/s].
        ttc_at_brake: Median over threats with braking [s]; None without one.
        premature: Threats with premature braking.
        false_activations: Episodes without a threat but with a false activation.
        errors: Number of episodes that failed.
    """

    agent: str
    group: str
    sample: Sample
    avoided: Rate
    speed_reduction: Mean
    ttc_at_brake: float | None
    premature: Rate
    false_activations: Rate
    errors: int


def summarise(agent: str, group: str, rows: list[Row]) -> AgentSummary:
    """Return the summary of one agent's rows."""
    played = [row for row in rows if row["error"] is None]
    threats = [row for row in played if row["threat"]]
    non_threats = [row for row in played if not row["threat"]]
    ttcs = [row["ttc_at_brake"] for row in threats if row["ttc_at_brake"] is not None]
    return AgentSummary(
        agent,
        group,
        Sample.of(played),
        rate_of(threats, "avoided"),
        cluster_mean([row["speed_reduction"] for row in threats], *cases_and_worlds(threats)),
        median(ttcs) if ttcs else None,
        rate_of(threats, "premature_brake"),
        rate_of(non_threats, "false_activation"),
        len(rows) - len(played),
    )


def rate_of(rows: Sequence[Row], key: str) -> Rate:
    """Return the rate of a boolean row key, with an interval that clusters by case and world."""
    return Rate.clustered([row[key] for row in rows], *cases_and_worlds(rows))


def cases_and_worlds(rows: Iterable[Row]) -> tuple[list[str], list[int | None]]:
    """Return the case and the world of each row; None for the laboratory world."""
    pairs = [(row["case"], row.get("world")) for row in rows]
    return [case for case, _ in pairs], [world for _, world in pairs]


def summaries(rows: Iterable[Row], group: Callable[[Row], str]) -> list[AgentSummary]:
    """Return one summary per agent and group, see `by_agent`."""
    return [summarise(agent, name, part) for (agent, name), part in by_agent(rows, group).items()]


def by_agent(rows: Iterable[Row], group: Callable[[Row], str]) -> dict[tuple[str, str], list[Row]]:
    """Return the rows of each agent and group, ordered by case and agent, not by time of completion."""
    parts: dict[tuple[str, str], list[Row]] = {}
    for row in sorted(rows, key=lambda row: (case_order(row["case"]), row["agent"])):
        parts.setdefault((row["agent"], group(row)), []).append(row)
    return parts


def by_condition(rows: Iterable[Row]) -> dict[str, list[Row]]:
    """Return the rows of each camera condition, in order of appearance."""
    parts: dict[str, list[Row]] = {}
    for row in rows:
        parts.setdefault(row["condition"], []).append(row)
    return parts


def case_order(case: str) -> list[tuple[int, str]]:
    """Return a sort key that compares numbers in a case name by value: v5 before v10."""
    parts = re.split(r"(\d+)", case)
    return [(int(part), "") if part.isdigit() else (0, part) for part in parts]


def without_fcw_driver(rows: Iterable[Row]) -> list[Row]:
    """Return the rows without an FCW driver; totals include only these."""
    return [row for row in rows if not row["fcw_driver"]]


def write_summary(rows: list[Row], path: Path) -> None:
    """Write one line per agent, condition and case to a CSV file, with totals as the case "all"; SI units."""
    conditions = sorted(by_condition(rows).items())
    lines = [
        _line(item, condition)
        for condition, part in conditions
        for item in summaries(part, lambda row: row["case"])
    ]
    lines += [
        _line(item, condition)
        for condition, part in conditions
        for item in summaries(without_fcw_driver(part), lambda row: "all")
    ]
    write_csv(path, COLUMNS, lines)


def write_csv(path: Path, columns: Sequence[str], lines: Iterable[Sequence[Any]]) -> None:
    """Write a CSV file, complete or not at all."""
    with complete_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(lines)


def _line(item: AgentSummary, condition: str) -> list[Any]:
    avoided, false, speed = item.avoided, item.false_activations, item.speed_reduction
    threats = [avoided.n, avoided.k, _bound(avoided, "low"), _bound(avoided, "high")]
    non_threats = [false.n, false.k, _bound(false, "low"), _bound(false, "high")]
    means = [_round(value) for value in (speed.value, speed.low, speed.high, item.ttc_at_brake)]
    return [
        item.agent,
        condition,
        item.group,
        *item.sample,
        *threats,
        *means,
        item.premature.k,
        *non_threats,
        item.errors,
    ]


def _bound(rate: Rate, bound: str) -> str:
    return f"{getattr(rate, bound):.4f}" if rate.n else ""


def _round(value: float | None) -> str:
    return "" if value is None else f"{value:.4f}"
