"""CSV files of a run's rows: one line per episode, and summaries with an interval for every rate."""

import csv
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple, TypeVar, cast

from lgmd_gym.aliases import Values
from lgmd_gym.benchmark.case import EpisodeRow, Row, case_order
from lgmd_gym.camera.worlds import LABORATORY
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


_R = TypeVar("_R", bound=EpisodeRow)
WORLDS = "worlds"  # what tables call numbered worlds
INTERVAL_TEXT = "95 % interval, clustered by case and world"


class Sample(NamedTuple):
    """Numbers of cases and worlds of a group of rows, between which outcomes may be independent."""

    cases: int
    worlds: int  # the laboratory included
    laboratory: bool = False  # whether one of the worlds is the laboratory

    @classmethod
    def of(cls, rows: Iterable[EpisodeRow]) -> "Sample":
        """Return the numbers of distinct cases and worlds of rows."""
        rows = list(rows)
        worlds = {row.get("world") for row in _played(rows)}
        return cls(len({row["case"] for row in rows}), len(worlds), None in worlds)

    def __str__(self) -> str:
        numbered = self.worlds - self.laboratory
        places = ["the laboratory"] * self.laboratory
        places += [counted(numbered, "world")] if numbered or not self.laboratory else []
        return f"{counted(self.cases, 'case')} in {' and '.join(places)}"


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


def rate_of(rows: Sequence[EpisodeRow], key: str) -> Rate:
    """Return the rate of a boolean row key, with an interval that clusters by case and world."""
    return Rate.clustered([cast(Values, row)[key] for row in rows], *cases_and_worlds(rows))


def cases_and_worlds(rows: Iterable[EpisodeRow]) -> tuple[list[str], list[int | None]]:
    """Return the case and the world of each row; None for the laboratory world."""
    pairs = [(row["case"], row.get("world")) for row in rows]
    return [case for case, _ in pairs], [world for _, world in pairs]


def interval_text(item: Sequence[float | None], style: str, scale: float = 1.0) -> str:
    """Return a value with its interval, if it has one."""
    value, *bounds = (f"{scale * x:{style}}" for x in item[:3] if x is not None)
    return f"{value} [{','.join(bounds)}]" if bounds else value


def summaries(rows: Iterable[Row], group: Callable[[Row], str]) -> list[AgentSummary]:
    """Return one summary per agent and group, see `by_agent`."""
    return [summarise(agent, name, part) for (agent, name), part in by_agent(rows, group).items()]


def by_agent(rows: Iterable[_R], group: Callable[[_R], str]) -> dict[tuple[str, str], list[_R]]:
    """Return the rows of each agent and group, ordered by case and agent, not by time of completion."""
    parts: dict[tuple[str, str], list[_R]] = {}
    for row in sorted(rows, key=lambda row: (case_order(row["case"]), row["agent"])):
        parts.setdefault((row["agent"], group(row)), []).append(row)
    return parts


def by_condition(rows: Iterable[_R]) -> dict[str, list[_R]]:
    """Return the rows of each camera condition, in order of appearance.

    Rows of both the laboratory and numbered worlds are separate, as "laboratory" and "worlds" after the
    condition, or without it for a single one.
    """
    rows = list(rows)
    by_place = len({place_of(row) for row in _played(rows)}) > 1
    by_weather = not by_place or len({row["condition"] for row in rows}) > 1
    parts: dict[str, list[_R]] = {}
    for row in rows:
        name = "-".join([row["condition"]] * by_weather + [place_of(row)] * by_place)
        parts.setdefault(name, []).append(row)
    return parts


def _played(rows: list[_R]) -> list[_R]:
    """Return the rows that did not fail, whose world is known; all if there are none."""
    return [row for row in rows if row.get("error") is None] or rows


def place_of(row: EpisodeRow) -> str:
    """Return whether a row was played in the laboratory or in a numbered world."""
    return LABORATORY if row.get("world") is None else WORLDS


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


def write_csv(path: Path, columns: Sequence[str], lines: Iterable[Sequence[object]]) -> None:
    """Write a CSV file, complete or not at all."""
    with complete_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(lines)


def _line(item: AgentSummary, condition: str) -> list[object]:
    avoided, false, speed = item.avoided, item.false_activations, item.speed_reduction
    threats = [avoided.n, avoided.k, _bound(avoided, "low"), _bound(avoided, "high")]
    non_threats = [false.n, false.k, _bound(false, "low"), _bound(false, "high")]
    means = [_round(value) for value in (speed.value, speed.low, speed.high, item.ttc_at_brake)]
    return [
        item.agent,
        condition,
        item.group,
        *item.sample[:2],
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


FILE = "episodes.csv"
# Key of a row -> unit at the end of its column name; keys that are absent have no unit or name it themselves.
UNITS = {
    "test_speed": "m_s",
    "test_target_speed": "m_s",
    "ego_speed": "m_s",
    "target_speed": "m_s",
    "impact_speed": "m_s",
    "relative_impact_speed": "m_s",
    "speed_reduction": "m_s",
    "ttc_at_alert": "s",
    "distance_at_alert": "m",
    "warning_lead_time": "s",
    "ttc_at_brake": "s",
    "distance_at_brake": "m",
    "drac_at_brake": "m_s2",
    "max_drac": "m_s2",
    "min_ttc": "s",
    "stopping_margin": "m",
    "peak_deceleration": "m_s2",
    "distance": "m",
    "duration": "s",
    "moving_time": "s",
    "needed_time": "s",
    "scaled_needed_time": "s",
    "speed_lost": "m_s",
    "fps": "hz",
}


def column_name(key: str) -> str:
    """Return the column of a row key.

    Example:
        >>> column_name("impact_speed"), column_name("case"), column_name("theta_at_alert_deg")
        ('impact_speed_m_s', 'case', 'theta_at_alert_deg')
    """
    return f"{key}_{UNITS[key]}" if key in UNITS else key


def write_episodes(rows: Sequence[EpisodeRow], path: Path) -> None:
    """Write rows to a CSV file, one line each, ordered by condition, case, agent and seed.

    Null is an empty field, booleans are `true` and `false`, and `error` is the last line of the traceback.
    """
    keys = list(rows[0])
    lines = ([_field(key, cast(Values, row)[key]) for key in keys] for row in sorted(rows, key=_order))
    write_csv(path, [column_name(key) for key in keys], lines)


def _order(row: EpisodeRow) -> tuple[str, list[tuple[int, str]], str, int]:
    """Return the place of a row, which does not depend on the time at which its episode finished."""
    return row["condition"], case_order(row["case"]), row["agent"], row["seed"]


def _field(key: str, value: object) -> object:
    """Return a value as the field of a CSV file."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if key == "error":
        return next(reversed(str(value).strip().splitlines()), "")
    return value
