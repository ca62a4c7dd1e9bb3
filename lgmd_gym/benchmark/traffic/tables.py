"""The scores of the traffic suite on the terminal and as CSV."""

import csv
from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table

from lgmd_gym.benchmark.traffic.summary import TrafficScore, poisson_interval, traffic_scores

Row = dict[str, Any]
COLUMNS = (
    "agent",
    "kind",
    "drives",
    "distance_km",
    "brakes",
    "false_activations",
    "false_per_100km",
    "false_low",
    "false_high",
    "premature_brakes",
    "alerts_per_100km",
    "threats",
    "avoided",
    "contacts",
    "rear_ended",
    "peak_deceleration",
    "errors",
)


def traffic_table(rows: list[Row], agents: list[str], title: str, by_kind: bool = False) -> Table:
    """Return one line per agent, or per agent and kind of traffic.

    Args:
        rows: Of the traffic suite.
        agents: In the order wanted.
        title: Of the table.
        by_kind: Whether each kind has its own line.
    """
    caption = (
        "false: without it no contact and no hard braking of the driver within 10 s; \\[exact Poisson 95 % "
        "interval]; premature: needed, but more than 4 s later; contacts (of which rear-ended)"
    )
    table = Table(title=title, caption=caption, box=SIMPLE_HEAD)
    table.add_column("agent", overflow="fold", min_width=15)
    if by_kind:
        table.add_column("traffic")
    for heading in (
        "km",
        "false brakes\nper 100 km",
        "false/\nbrakes",
        "pre-\nmature",
        "avoided",
        "contacts",
    ):
        table.add_column(heading, justify="right")
    items = traffic_scores(rows, by_kind)
    for item in sorted(
        items, key=lambda item: agents.index(item.agent) if item.agent in agents else len(agents)
    ):
        table.add_row(*_cells(item, by_kind))
    return table


def _cells(item: TrafficScore, by_kind: bool) -> list[str]:
    low, high = item.interval
    rate = "–"
    if item.distance > 0.0:
        rate = f"{item.per_100km(item.false_activations):.1f} [{low:.1f}–{high:.1f}]"
    return [
        item.agent + (f" ({item.errors} errors)" if item.errors else ""),
        *([item.kind] if by_kind else []),
        f"{item.distance / 1000:.1f}",
        rate,
        f"{item.false_activations}/{item.brakes}",
        str(item.premature),
        f"{item.avoided.k}/{item.avoided.n}",
        f"{item.contacts} ({item.rear_ended})",
    ]


def write_traffic_summary(rows: list[Row], path: Path) -> None:
    """Write one line per agent and kind of traffic to a CSV file, and one per agent for all kinds."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for item in (*traffic_scores(rows), *traffic_scores(rows, by_kind=True)):
            writer.writerow(_line(item))


def _line(item: TrafficScore) -> list[Any]:
    """Return the values of `COLUMNS`; rates are empty if nothing was driven."""
    counts = (item.false_activations, *poisson_interval(item.false_activations))
    driven = item.distance > 0.0
    return [
        item.agent,
        item.kind or "all",
        item.drives,
        f"{item.distance / 1000:.4f}",
        item.brakes,
        item.false_activations,
        *(f"{item.per_100km(count):.4f}" if driven else "" for count in counts),
        item.premature,
        f"{item.per_100km(item.alerts):.4f}" if driven else "",
        item.avoided.n,
        item.avoided.k,
        item.contacts,
        item.rear_ended,
        f"{item.peak:.4f}",
        item.errors,
    ]
