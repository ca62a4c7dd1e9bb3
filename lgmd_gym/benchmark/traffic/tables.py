"""Tables of the traffic suite for the terminal."""

from rich.table import Table

from lgmd_gym.benchmark.rows import Row
from lgmd_gym.benchmark.summary import Sample
from lgmd_gym.benchmark.traffic.summary import TrafficSummary, traffic_summaries
from lgmd_gym.envs.traffic.emergencies import EMERGENCY, HORIZON
from lgmd_gym.errors import counted

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


def traffic_table(rows: list[Row], agents: list[str], title: str, by_kind: bool = False) -> Table:
    """Return a table with one line per agent, or per agent and kind of traffic.

    Args:
        rows: Rows of the traffic suite.
        agents: Agents in the order of the lines.
        title: Title of the table.
        by_kind: Whether each kind of traffic has its own line, below that of its agent.
    """
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
