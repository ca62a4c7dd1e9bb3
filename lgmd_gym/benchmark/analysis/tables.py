"""A run's scores as tables on the terminal."""

from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table

from lgmd_gym.benchmark.analysis.protocol_limits import JUDGES, Verdict, meets_r152, verdicts
from lgmd_gym.benchmark.statistics import Mean
from lgmd_gym.benchmark.summary import Rate, Score, automatic, case_order, scores
from lgmd_gym.envs.dynamics.units import KMH

Row = dict[str, Any]
RATE_NOTE = (
    "k/n [Wilson 95 % interval in %]; speed cut [95 %, bootstrapped by case]; premature: more than 4 s "
    "before contact, no success"
)


def score_tables(rows: list[Row], agents: list[str], title: str) -> list[Table]:
    """Return the agents' scores; cases in which a warned driver brakes have a table of their own.

    What a driver does on a warning is no automatic braking, and no part of its totals.
    """
    parts = {
        title: automatic(rows),
        "with a driver who brakes 1.2 s after the alert": [row for row in rows if row["fcw_driver"]],
    }
    return [_score_table(part, agents, name) for name, part in parts.items() if part]


def _score_table(rows: list[Row], agents: list[str], title: str) -> Table:
    """Return one line per agent over all episodes."""
    table = Table(title=title, caption=RATE_NOTE, box=SIMPLE_HEAD)
    table.add_column("agent", overflow="fold", min_width=15)
    for heading in ("avoided", "speed\ncut km/h", "TTC at\nbraking s", "premature", "false braking"):
        table.add_column(heading, justify="right")
    for item in _by_agent(scores(rows, lambda row: ""), agents):
        table.add_row(
            item.agent + (f" ({item.errors} errors)" if item.errors else ""),
            rate_text(item.avoided),
            mean_kmh(item.speed_reduction),
            "–" if item.ttc_at_brake is None else f"{item.ttc_at_brake:.2f}",
            rate_text(item.premature),
            rate_text(item.false_activations),
        )
    return table


def case_table(rows: list[Row], agents: list[str]) -> Table:
    """Return one line per case: threats avoided, or quiet episodes without false braking, of n."""
    title = "per case: avoided, or not braked where nothing threatened, of n"
    table = Table(title=title, box=SIMPLE_HEAD)
    table.add_column("case", overflow="fold")
    shown = [agent for agent in agents if any(row["agent"] == agent for row in rows)]
    for agent in shown:
        table.add_column(agent.replace("-", "-\n", 1), justify="right", overflow="fold")
    cells = {(item.agent, item.group): item for item in scores(rows, lambda row: row["case"])}
    for case in sorted({row["case"] for row in rows}, key=case_order):
        values = [_good(cells.get((agent, case))) for agent in shown]
        table.add_row(case.split("/", 1)[1], *values)
    return table


def verdict_table(rows: list[Row], agents: list[str], suite: str) -> Table | None:
    """Return what a protocol would make of each case, runs that meet it of n; None for other suites."""
    if suite not in JUDGES:
        return None
    by_agent = {agent: {item.case: item for item in verdicts(rows, agent, JUDGES[suite])} for agent in agents}
    shown = [agent for agent in agents if by_agent[agent]]
    demands = {case: item.demand for cells in by_agent.values() for case, item in cells.items()}
    caption = "runs that meet it of n, (highest relative impact speed in km/h); protocol-derived, no rating"
    if suite == "r152":
        met = [agent for agent in shown if meets_r152(rows, agent)]
        caption += (
            f"\nmeets the impact-speed limits of UN R152 5.2.1.4 in simulation: {', '.join(met) or 'none'}"
        )
    table = Table(title=f"{suite}: what the protocol asks", caption=caption, box=SIMPLE_HEAD)
    table.add_column("case", overflow="fold")
    table.add_column("asked")
    for agent in shown:
        table.add_column(agent.replace("-", "-\n", 1), justify="right", overflow="fold")
    for case in sorted(demands, key=case_order):
        cells = [_verdict(by_agent[agent].get(case)) for agent in shown]
        table.add_row(case.split("/", 1)[1], demands[case], *cells)
    return table


def _verdict(item: Verdict | None) -> str:
    if item is None:
        return ""
    return f"{item.met.k}/{item.met.n}" + (f" ({item.worst / KMH:.0f})" if item.worst else "")


def mean_kmh(mean: Mean) -> str:
    """Return a mean in m/s as km/h, with its interval if it has one."""
    if mean.value is None:
        return "–"
    if mean.low is None or mean.high is None:
        return f"{mean.value / KMH:.1f}"
    return f"{mean.value / KMH:.1f} [{mean.low / KMH:.0f}–{mean.high / KMH:.0f}]"


def rate_text(rate: Rate) -> str:
    """Return k/n and its interval in per cent."""
    if rate.n == 0:
        return "–"
    return f"{rate.k}/{rate.n} [{100 * rate.low:.0f}–{100 * rate.high:.0f}]"


def _good(item: Score | None) -> str:
    """Return how many episodes went as they should."""
    if item is None:
        return ""
    good = item.avoided.k + item.false_activations.n - item.false_activations.k
    return f"{good}/{item.avoided.n + item.false_activations.n}"


def _by_agent(items: list[Score], agents: list[str]) -> list[Score]:
    """Return the scores in the order the agents were given in."""
    order = {agent: index for index, agent in enumerate(agents)}
    return sorted(items, key=lambda item: order.get(item.agent, len(order)))
