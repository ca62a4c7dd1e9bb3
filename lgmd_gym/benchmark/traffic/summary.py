"""Summaries of the traffic suites: activations and speed lost per 100 km, and contacts."""

from collections.abc import Sequence
from math import inf
from pathlib import Path
from typing import NamedTuple, cast

from rich.table import Table

from lgmd_gym.benchmark.case import EpisodeRow
from lgmd_gym.benchmark.summary import Sample, by_agent, by_condition, cases_and_worlds, rate_of, write_csv
from lgmd_gym.benchmark.traffic.rows import TrafficRow
from lgmd_gym.envs.traffic.emergencies import EMERGENCY_SHARE, HORIZON
from lgmd_gym.envs.traffic.env import JAM_SPEED
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
    "needless_activations",
    "needless_per_100km",
    "needless_low",
    "needless_high",
    "scaled_needed_share",
    "speed_lost_per_100km",
    "avoidable",
    "avoidable_met",
    "avoided_by_brake",
    "unavoidable",
    "caused",
    "standing",
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
    # the same as `false_activations`, `false_bounds` and `needed` with emergencies scaled to the brake
    needless: int
    needless_bounds: tuple[float, float]
    scaled_needed: float
    speed_lost: float  # sum of the speeds lost in braking events that are not needed in this sense [m/s]
    avoided_by_brake: (
        Rate  # contacts that full braking avoids, unless they vanish: whether a needed brake did
    )
    avoidable: int  # number of episodes with such a contact
    unavoidable: int  # number of episodes with contact without braking that full braking does not avoid
    caused: int  # number of contacts that the agent's braking caused
    standing: int  # number of contacts of an ego that stands
    errors: int  # number of episodes that failed

    def per_100km(self, count: float) -> float:
        """Return a count as a rate [1/100 km]; infinite without distance."""
        return count * PER / self.distance if self.distance > 0.0 else inf

    @property
    def needed_share(self) -> float | None:
        """Share of the time in motion in which a brake is needed; None without motion."""
        return self.needed / self.moving if self.moving > 0.0 else None

    @property
    def scaled_needed_share(self) -> float | None:
        """The same with emergencies scaled to the brake."""
        return self.scaled_needed / self.moving if self.moving > 0.0 else None

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the false activations [1/100 km]."""
        return self._rates(self.false_bounds)

    @property
    def needless_interval(self) -> tuple[float, float]:
        """95 % interval of the needless activations [1/100 km]."""
        return self._rates(self.needless_bounds)

    def _rates(self, bounds: tuple[float, float]) -> tuple[float, float]:
        low, high = bounds
        return (self.per_100km(low) if low else 0.0), self.per_100km(high)


def summarise_traffic(agent: str, kind: str, rows: Sequence[TrafficRow]) -> TrafficSummary:
    """Return the summary of one agent's rows."""
    played = [row for row in rows if row["error"] is None]
    events = [row["false_activations"] for row in played]
    needless = [row["needless_activations"] for row in played]
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
        needless=sum(needless),
        needless_bounds=count_interval(needless, distances, *cases_and_worlds(played)),
        scaled_needed=sum(row["scaled_needed_time"] for row in played),
        speed_lost=sum(row["speed_lost"] for row in played),
        avoided_by_brake=rate_of(
            [row for row in played if row["avoided_by_brake"] is not None], "avoided_by_brake"
        ),
        avoidable=sum(row["avoidable"] is True for row in played),
        unavoidable=sum(row["avoidable"] is False for row in played),
        caused=sum(row["caused"] for row in played),
        standing=sum(row["collision"] and (row["impact_speed"] or 0.0) < JAM_SPEED for row in played),
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
    driven = item.distance > 0.0

    def rates(*counts: float) -> list[str]:
        return [f"{item.per_100km(count):.4f}" if driven else "" for count in counts]

    return [
        item.agent,
        condition,
        item.kind or "all",
        item.drives,
        f"{item.distance / 1000:.4f}",
        item.brakes,
        item.false_activations,
        *rates(item.false_activations, *item.false_bounds),
        f"{item.moving:.2f}",
        "" if item.needed_share is None else f"{item.needed_share:.4f}",
        *rates(item.alerts),
        item.avoided.n,
        item.avoided.k,
        item.contacts,
        item.rear_ended,
        f"{item.peak:.4f}",
        item.needless,
        *rates(item.needless, *item.needless_bounds),
        "" if item.scaled_needed_share is None else f"{item.scaled_needed_share:.4f}",
        *rates(item.speed_lost),
        item.avoidable,
        item.avoided_by_brake.n,
        item.avoided_by_brake.k,
        item.unavoidable,
        item.caused,
        item.standing,
        item.errors,
    ]


CAPTION = (
    f"needless: without it, no contact and no required deceleration of {100.0 * EMERGENCY_SHARE:.0f} % of "
    f"full braking within {HORIZON:g} s; [95 % interval, clustered by drive and world]; speed lost: in "
    "needless brakes, against the same drive without them; needed: share of the time in motion in which a "
    "brake is not needless; avoided by a needed brake, of the contacts without agent that full braking "
    "avoids (+ those that it does not); contacts (rear-ended, caused by braking)"
)
HEADINGS = (
    "km",
    "needless activations\nper 100 km",
    "needless/\nbrakes",
    "speed lost\n[m/s] per 100 km",
    "needed,\n% of time",
    "avoided by\na brake",
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
    low, high = item.needless_interval
    rate = lost = "–"
    if item.distance > 0.0:
        rate = f"{item.per_100km(item.needless):.1f} [{low:.1f}–{high:.1f}]"
        lost = f"{item.per_100km(item.speed_lost):.1f}"
    share, avoided = item.scaled_needed_share, item.avoided_by_brake
    return [
        (f"  {item.kind}" if by_kind else item.agent)
        + (f" ({counted(item.errors, 'error')})" if item.errors else ""),
        f"{item.distance / 1000:.1f}",
        rate,
        f"{item.needless}/{item.brakes}",
        lost,
        "–" if share is None else f"{100.0 * share:.1f}",
        f"{avoided.k}/{avoided.n} (+{item.unavoidable})",
        f"{item.contacts} ({item.rear_ended}, {item.caused})",
    ]
