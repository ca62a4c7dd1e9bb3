"""Summaries of the traffic suite: false activations per 100 km, with a clustered interval."""

from collections.abc import Sequence
from math import inf
from pathlib import Path
from typing import NamedTuple, cast

from rich.table import Table

from lgmd_gym.benchmark.case import EpisodeRow
from lgmd_gym.benchmark.summary import Sample, by_agent, by_condition, cases_and_worlds, rate_of, write_csv
from lgmd_gym.benchmark.traffic.rows import TrafficRow
from lgmd_gym.envs.traffic.emergencies import EMERGENCY, HORIZON
from lgmd_gym.errors import counted
from lgmd_gym.statistics.intervals import Rate, count_interval

PER = 100_000.0  # [m], reference distance of the rates
COLUMNS = (
    "agent",
    "condition",
    "kind",
    "drives",
    "distance_km",
    "brakes",
    "false_activations",
    "false_per_100km",
    "false_low",
    "false_high",
    "moving_s",
    "needed_share",
    "alerts_per_100km",
    "threats",
    "avoided",
    "contacts",
    "rear_ended",
    "peak_deceleration",
    "errors",
)


class TrafficSummary(NamedTuple):
    """Summary of one agent over a group of episodes in traffic."""

    agent: str
    kind: str  # kind of traffic; "" for all
    drives: int  # number of episodes
    distance: float  # total distance [m]
    alerts: int
    brakes: int  # number of braking events beyond 0.25 g
    false_activations: int  # number of these that were not needed
    false_bounds: tuple[float, float]  # 95 % interval of their expected number, see `count_interval`
    moving: float  # time in motion without braking by the agent [s]
    needed: float  # part of it in which a brake is needed, and therefore never false [s]
    avoided: Rate  # episodes without contact among those with contact without braking
    contacts: int  # number of episodes with contact
    rear_ended: int  # number of episodes in which another car hit the ego's rear
    peak: float  # highest deceleration beyond the driver's [m/s²]
    errors: int  # number of episodes that failed

    def per_100km(self, count: float) -> float:
        """Return a count as a rate [1/100 km]; infinite without distance."""
        return count * PER / self.distance if self.distance > 0.0 else inf

    @property
    def needed_share(self) -> float | None:
        """Share of the time in motion in which a brake is needed; None without motion."""
        return self.needed / self.moving if self.moving > 0.0 else None

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the false activations [1/100 km]."""
        low, high = self.false_bounds
        return (self.per_100km(low) if low else 0.0), self.per_100km(high)


def summarise_traffic(agent: str, kind: str, rows: Sequence[TrafficRow]) -> TrafficSummary:
    """Return the summary of one agent's rows."""
    played = [row for row in rows if row["error"] is None]
    events = [row["false_activations"] for row in played]
    distances = [row["distance"] for row in played]
    return TrafficSummary(
        agent,
        kind,
        drives=len(played),
        distance=sum(distances),
        alerts=sum(row["alerts"] for row in played),
        brakes=sum(row["brakes"] for row in played),
        false_activations=sum(events),
        false_bounds=count_interval(events, distances, *cases_and_worlds(played)),
        moving=sum(row["moving_time"] for row in played),
        needed=sum(row["needed_time"] for row in played),
        avoided=rate_of([row for row in played if row["threat"]], "avoided"),
        contacts=sum(row["collision"] for row in played),
        rear_ended=sum(row["side"] == "rear" for row in played),
        peak=max((row["peak_deceleration"] for row in played), default=0.0),
        errors=len(rows) - len(played),
    )


def traffic_summaries(rows: Sequence[EpisodeRow], by_kind: bool = False) -> list[TrafficSummary]:
    """Return one summary per agent, or per agent and kind of traffic."""
    drives = cast(Sequence[TrafficRow], rows)
    parts = by_agent(drives, (lambda row: row["family"]) if by_kind else (lambda row: ""))
    return [summarise_traffic(agent, kind, part) for (agent, kind), part in parts.items()]


def write_traffic_summary(rows: Sequence[EpisodeRow], path: Path) -> None:
    """Write a CSV file with one line per condition, agent and kind of traffic, and one for all kinds."""
    conditions = sorted(by_condition(rows).items())
    lines = [
        _line(item, condition)
        for by_kind in (False, True)
        for condition, part in conditions
        for item in traffic_summaries(part, by_kind)
    ]
    write_csv(path, COLUMNS, lines)


def _line(item: TrafficSummary, condition: str) -> list[object]:
    """Return the values of `COLUMNS`; rates are empty without distance."""
    counts = (item.false_activations, *item.false_bounds)
    driven = item.distance > 0.0
    return [
        item.agent,
        condition,
        item.kind or "all",
        item.drives,
        f"{item.distance / 1000:.4f}",
        item.brakes,
        item.false_activations,
        *(f"{item.per_100km(count):.4f}" if driven else "" for count in counts),
        f"{item.moving:.2f}",
        "" if item.needed_share is None else f"{item.needed_share:.4f}",
        f"{item.per_100km(item.alerts):.4f}" if driven else "",
        item.avoided.n,
        item.avoided.k,
        item.contacts,
        item.rear_ended,
        f"{item.peak:.4f}",
        item.errors,
    ]


CAPTION = (
    f"false: without it, no contact and no required deceleration of {EMERGENCY:g} m/s² within {HORIZON:g} s; "
    "[95 % interval, clustered by drive and world]; needed: share of the time in motion in which a brake is "
    "not false; contacts (of these rear-ended)"
)
HEADINGS = (
    "km",
    "false activations\nper 100 km",
    "false/\nbrakes",
    "needed,\n% of time",
    "avoided",
    "contacts",
)


def traffic_table(rows: Sequence[EpisodeRow], agents: list[str], title: str, by_kind: bool = False) -> Table:
    """Return a table with one line per agent, or per agent and kind of traffic."""
    table = Table(title=title, caption=f"{Sample.of(rows)}; {CAPTION}")
    table.add_column("agent\n  traffic" if by_kind else "agent", overflow="fold", min_width=15)
    for heading in HEADINGS:
        table.add_column(heading, justify="right")
    order = {agent: index for index, agent in enumerate(agents)}
    items = traffic_summaries(rows, by_kind)
    agent = None
    for item in sorted(items, key=lambda item: order.get(item.agent, len(order))):
        if by_kind and item.agent != agent:
            table.add_row(agent := item.agent)
        table.add_row(*_cells(item, by_kind))
    return table


def _cells(item: TrafficSummary, by_kind: bool) -> list[str]:
    low, high = item.interval
    rate = "–"
    if item.distance > 0.0:
        rate = f"{item.per_100km(item.false_activations):.1f} [{low:.1f}–{high:.1f}]"
    return [
        (f"  {item.kind}" if by_kind else item.agent)
        + (f" ({counted(item.errors, 'error')})" if item.errors else ""),
        f"{item.distance / 1000:.1f}",
        rate,
        f"{item.false_activations}/{item.brakes}",
        "–" if item.needed_share is None else f"{100.0 * item.needed_share:.1f}",
        f"{item.avoided.k}/{item.avoided.n}",
        f"{item.contacts} ({item.rear_ended})",
    ]
