"""Terminal tables of a run, and the per-case results that they share with the report."""

from collections import Counter
from typing import NamedTuple

from rich.table import Table

from lgmd_gym.benchmark.case import Row, Suite, case_order, relative_impact
from lgmd_gym.benchmark.summary import (
    INTERVAL_TEXT,
    WORLDS,
    AgentSummary,
    Sample,
    cases_and_worlds,
    place_of,
    summaries,
    without_fcw_driver,
)
from lgmd_gym.camera.worlds import LABORATORY
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.errors import counted
from lgmd_gym.statistics.intervals import Mean, Rate

SCORE_CAPTION = (
    f"k/n [{INTERVAL_TEXT}, in %]; mean speed reduction in km/h [95 %, bootstrap over cases and worlds]; "
    "median TTC in s; premature: more than 4 s before contact, does not count as avoided"
)
PLACE_CAPTION = (
    "avoided: contacts of no-brake, by braking at most 4 s before them; needless: braking without a threat"
)
LIMIT_CAPTION = (
    "runs that meet the limit, of n (highest relative impact speed in km/h); premature braking fails; "
    "derived from the protocol, not a rating"
)


MIN_RUNS = 30
"""Fewest threats of an agent for a verdict: without a failure among them, less than 10 % fail (95 %)."""


class LimitResult(NamedTuple):
    """Number of runs of one agent in one case that meet the limit."""

    agent: str
    case: str
    limit: str
    met: Rate
    worst: float  # highest relative impact speed [m/s]


class CaseCell(NamedTuple):
    """Table cell: its text and the share of successful episodes; empty by default."""

    text: str = ""
    share: float | None = None


class CaseLine(NamedTuple):
    """Results of all agents in one case; `case` omits the name of the suite, and `limit` may be empty."""

    case: str
    limit: str
    cells: list[CaseCell]


def limit_results(rows: list[Row], agent: str, suite: Suite) -> list[LimitResult]:
    """Return the result of an agent per case, over its threats without an error; none without limits."""
    if suite.limit is None:
        return []
    threats = [row for row in rows if row["agent"] == agent and row["error"] is None and row["threat"]]
    results: list[LimitResult] = []
    for case in sorted({row["case"] for row in threats}, key=case_order):
        of_case = [row for row in threats if row["case"] == case]
        met, limits = zip(*map(suite.limit, of_case), strict=True)
        limit, worst = " / ".join(sorted(set(limits))), max(map(relative_impact, of_case))
        rate = Rate.clustered(met, *cases_and_worlds(of_case))
        results.append(LimitResult(agent, case, limit, rate, worst))
    return results


def limit_lines(rows: list[Row], agents: list[str], suite: Suite) -> list[CaseLine]:
    """Return the runs that meet the protocol's limit, per case; empty for suites without limits."""
    by_agent = {agent: {item.case: item for item in limit_results(rows, agent, suite)} for agent in agents}
    limits = {case: item.limit for results in by_agent.values() for case, item in results.items()}
    lines: list[CaseLine] = []
    short = _short_names(rows)
    for case in sorted(limits, key=case_order):
        line = CaseLine(short[case], limits[case], [])
        for results in by_agent.values():
            if (item := results.get(case)) is None:
                line.cells.append(CaseCell())
            else:
                worst = f" ({item.worst / KMH:.0f})" if item.worst else ""
                line.cells.append(CaseCell(f"{item.met.k}/{item.met.n}{worst}", item.met.k / item.met.n))
        lines.append(line)
    return lines


def success_lines(rows: list[Row], agents: list[str]) -> list[CaseLine]:
    """Return, per case, how many of n threats were avoided and non-threats had no false activation."""
    by_cell = {(item.agent, item.group): item for item in summaries(rows, lambda row: row["case"])}
    short = _short_names(rows)
    return [
        CaseLine(short[case], "", [_success(by_cell.get((agent, case))) for agent in agents])
        for case in sorted(short, key=case_order)
    ]


def _short_names(rows: list[Row]) -> dict[str, str]:
    """Return the name of each case without that of its suite."""
    return {row["case"]: row["case"].removeprefix(f"{row['suite']}/") for row in rows}


def _success(item: AgentSummary | None) -> CaseCell:
    n = item.avoided.n + item.false_activations.n if item else 0
    if item is None or n == 0:
        return CaseCell()
    k = item.avoided.k + item.false_activations.n - item.false_activations.k
    return CaseCell(f"{k}/{n}", k / n)


def agent_summaries(rows: list[Row], agents: list[str]) -> list[AgentSummary]:
    """Return one summary per agent over all rows, in the order of `agents`."""
    by_agent = {item.agent: item for item in summaries(rows, lambda row: "")}
    return [by_agent[agent] for agent in agents if agent in by_agent]


def score_tables(rows: list[Row], agents: list[str], title: str) -> list[Table]:
    """Return the scores of the agents; cases with an FCW driver have a separate table."""
    parts = {
        title: without_fcw_driver(rows),
        "cases with a driver who brakes 1.2 s after the alert": [row for row in rows if row["fcw_driver"]],
    }
    return [_score_table(part, agents, name) for name, part in parts.items() if part]


def _score_table(rows: list[Row], agents: list[str], title: str) -> Table:
    table = Table(title=title, caption=f"{Sample.of(rows)}; {SCORE_CAPTION}")
    table.add_column("agent", overflow="fold", min_width=15)
    for heading in ("avoided", "speed\nreduction", "TTC at\nbraking", "premature", "false\nactivation"):
        table.add_column(heading, justify="right")
    for item in agent_summaries(rows, agents):
        table.add_row(
            item.agent + (f" ({counted(item.errors, 'error')})" if item.errors else ""),
            rate_text(item.avoided),
            mean_kmh(item.speed_reduction),
            "–" if item.ttc_at_brake is None else f"{item.ttc_at_brake:.2f}",
            rate_text(item.premature),
            rate_text(item.false_activations),
        )
    return table


def place_table(rows: list[Row], agents: list[str]) -> Table:
    """Return the scores of the agents in the laboratory and in worlds, without intervals."""
    table = Table(caption=f"{Sample.of(rows)}; k/n episodes; {PLACE_CAPTION}")
    table.add_column("agent", overflow="fold", min_width=15)
    by_place = {
        place: {item.agent: item for item in agent_summaries(part, agents)}
        for place in (LABORATORY, WORLDS)
        if (part := [row for row in rows if place_of(row) == place])
    }
    for place in by_place:
        for heading in ("avoided", "needless"):
            table.add_column(f"{place}\n{heading}", justify="right")
    for agent in agents:
        cells: list[str] = []
        for items in by_place.values():
            item = items.get(agent)
            rates = (item.avoided, item.false_activations) if item else ()
            cells += [f"{rate.k}/{rate.n}" if rate.n else "–" for rate in rates] or ["–"] * 2
        table.add_row(agent, *cells)
    return table


def table_by_case(rows: list[Row], agents: list[str], suite: Suite) -> Table:
    """Return the results per case, compared with the protocol's limits if the suite has limits."""
    return limit_table(rows, agents, suite) or case_table(rows, agents)


def case_table(rows: list[Row], agents: list[str]) -> Table:
    """Return a table of the successful episodes per case."""
    present = {row["agent"] for row in rows}
    shown = [agent for agent in agents if agent in present]
    title = "per case: threats avoided, or non-threats without false activation, of n"
    table = Table(title=title, caption=str(Sample.of(rows)))
    table.add_column("case", overflow="fold")
    _add_agent_columns(table, shown)
    for line in success_lines(rows, shown):
        table.add_row(line.case, *(cell.text for cell in line.cells))
    return table


def limit_table(rows: list[Row], agents: list[str], suite: Suite) -> Table | None:
    """Return a table of the runs that meet the protocol's limit per case; None for suites without limits."""
    if suite.limit is None:
        return None
    threatened = {row["agent"] for row in rows if row["threat"] and row["error"] is None}
    shown = [agent for agent in agents if agent in threatened]
    caption = f"{Sample.of(rows)}; {LIMIT_CAPTION}"
    if verdict := verdict_text(rows, shown, suite):
        caption += f"\n{verdict}"
    table = Table(title=f"{suite.name}: limits of the protocol", caption=caption)
    table.add_column("case", overflow="fold")
    table.add_column("limit")
    _add_agent_columns(table, shown)
    for line in limit_lines(rows, shown, suite):
        table.add_row(line.case, line.limit, *(cell.text for cell in line.cells))
    return table


def verdict_text(rows: list[Row], agents: list[str], suite: Suite) -> str:
    """Return which agents meet the requirement of the protocol, with the place and the number of runs.

    There is no verdict below `MIN_RUNS`. Empty for suites without a requirement, or without a threat.
    """
    runs = Counter(row["agent"] for row in rows if row["threat"] and row["error"] is None)
    if suite.verdict is None or not (tested := [agent for agent in agents if runs[agent]]):
        return ""
    requirement, meets = suite.verdict
    fewest, places = min(runs[agent] for agent in tested), {place_of(row) for row in rows}
    if fewest < MIN_RUNS:
        return f"no verdict on {requirement}: {counted(fewest, 'run')} per agent, {MIN_RUNS} are needed"
    where = " and ".join(f"the {place}" if place == LABORATORY else place for place in sorted(places))
    met = ", ".join(agent for agent in tested if meets(rows, agent)) or "none"
    return f"meets {requirement} in simulation, in {where}, {fewest} runs or more: {met}"


def _add_agent_columns(table: Table, agents: list[str]) -> None:
    for agent in agents:
        table.add_column(agent.replace("-", "-\n", 1), justify="right", overflow="fold")


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
