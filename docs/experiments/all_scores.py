"""Tables of the scores of agents in several runs.

    python docs/experiments/all_scores.py RUN RUN ...
    python docs/experiments/all_scores.py RUN RUN ... --families --agents spike-threshold ttc-oracle

Each RUN is a run folder of `lgmd-gym bench`. Each run is a column, each agent a row. A cell contains the
threats avoided (without contact and premature braking) or, in a suite without threats, the episodes with a
false activation, both with an interval that clusters by case and world. In traffic it contains the false
activations per 100 km. With `--families`, a line is a scenario family of a run, and each of `--agents` a
column. Cases with an FCW driver are left out. The tables are in Markdown.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from lgmd_gym.benchmark import get_suite
from lgmd_gym.benchmark.analysis.tables import rate_text
from lgmd_gym.benchmark.case import Row, is_traffic
from lgmd_gym.benchmark.run_folder import StoredRun, read_run
from lgmd_gym.benchmark.summary import Sample, summarise, without_fcw_driver
from lgmd_gym.benchmark.traffic.summary import summarise_traffic
from lgmd_gym.errors import counted


def score(agent: str, rows: list[Row]) -> str:
    """Return the score of an agent in a suite of cases."""
    result = summarise(agent, "", rows)
    rate = result.avoided if result.avoided.n else result.false_activations
    return rate_text(rate) + (f" ({result.errors} errors)" if result.errors else "")


def traffic_score(agent: str, rows: list[Row]) -> str:
    """Return the false activations of an agent per 100 km of traffic."""
    if not rows:
        return "–"
    result = summarise_traffic(agent, "", rows)
    low, high = result.interval
    rate = f"{result.per_100km(result.false_activations):.1f} [{low:.1f}–{high:.1f}]"
    return rate + (f" ({result.errors} errors)" if result.errors else "")


def column(run: StoredRun) -> dict[str, str]:
    """Return the heading of a run (key "agent") and the score of each of its agents."""
    traffic = is_traffic(run.config.suite)
    rows = run.rows if traffic else without_fcw_driver(run.rows)
    threats = any(row["threat"] for row in rows)
    what = "false activations" if not threats else "avoided"
    what = "false activations per 100 km" if traffic else what
    suite = run.config.suite if traffic else get_suite(run.config.suite).name
    cases = counted(Sample.of(rows).cases, "case")
    where = str(Sample.of(rows)) if run.config.worlds else f"{cases} in the laboratory"
    cells = {"agent": f"{suite}: {what}, {where}, {'/'.join(run.config.conditions)}"}
    for agent in run.config.agents:
        of_agent = [row for row in rows if row["agent"] == agent]
        cells[agent] = traffic_score(agent, of_agent) if traffic else score(agent, of_agent)
    return cells


def table(columns: Sequence[dict[str, str]]) -> list[str]:
    """Return the lines of the table of several columns."""
    names = dict.fromkeys(name for cells in columns for name in cells)  # "agent" is the first
    return markdown([[name, *(cells.get(name, "–") for cells in columns)] for name in names])


def family_table(agents: Sequence[str], runs: Sequence[StoredRun]) -> list[str]:
    """Return the lines of the table by scenario family.

    Raises:
        ValueError: If a run does not contain one of the agents, or is one of traffic.
    """
    lines = [["suite", "family", *(f"`{agent}`" for agent in agents)]]
    for run in runs:
        if is_traffic(run.config.suite):
            raise ValueError("a run of traffic has no families; omit --families")
        check_agents(agents, run)
        rows = without_fcw_driver(run.rows)
        where = run.config.suite + ("" if run.config.worlds else ", laboratory")
        for family in sorted({row["family"] for row in rows}):
            of_family = [row for row in rows if row["family"] == family]
            cells = [score(agent, [row for row in of_family if row["agent"] == agent]) for agent in agents]
            lines.append([where, family, *cells])
    return markdown(lines)


def check_agents(agents: Sequence[str], run: StoredRun) -> None:
    """Raise ValueError if a run does not contain one of the agents."""
    for agent in agents:
        if agent not in run.config.agents:
            known = ", ".join(run.config.agents)
            raise ValueError(f"the run of {run.config.suite} has no agent {agent!r}; it has {known}")


def markdown(lines: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a Markdown table, the heading first."""
    first, *others = lines
    return [f"| {' | '.join(line)} |" for line in (first, ["---"] * len(first), *others)]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Scores of agents")
    parser.add_argument("runs", type=Path, nargs="+", help="run folders of lgmd-gym bench")
    parser.add_argument("--families", action="store_true", help="one line per scenario family")
    parser.add_argument("--agents", nargs="+", default=[], help="agents of the table by family")
    options = parser.parse_args()
    if options.families != bool(options.agents):
        parser.error("--families and --agents belong together")
    try:
        stored = [read_run(folder) for folder in options.runs]
        if options.families:
            lines = family_table(options.agents, stored)
        else:
            lines = table([column(run) for run in stored])
    except ValueError as error:
        parser.error(str(error))
    print(*lines, sep="\n")
