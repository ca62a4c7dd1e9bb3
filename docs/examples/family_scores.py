"""Scores of some agents in every scenario family of several runs.

    python docs/examples/family_scores.py RUN RUN ... --agents spike-threshold stopping-zone ttc-oracle

The first argument names the agents, the others are run folders of `lgmd-gym bench`. A line is a family of a
suite. A cell contains the threats avoided or, in a family without threats, the episodes with a false
activation, with an interval. Cases with an FCW driver are left out. The table is in Markdown.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from lgmd_gym.benchmark.analysis.tables import rate_text
from lgmd_gym.benchmark.stored_run import StoredRun, read_run
from lgmd_gym.benchmark.suites import TRAFFIC
from lgmd_gym.benchmark.summary import summarise, without_fcw_driver


def table(agents: Sequence[str], runs: Sequence[StoredRun]) -> list[str]:
    """Return the lines of the table.

    Raises:
        ValueError: If a run does not contain one of the agents, or is one of traffic.
    """
    lines = [["suite", "family", *(f"`{agent}`" for agent in agents)]]
    lines.append(["---"] * len(lines[0]))
    for run in runs:
        if run.config.suite == TRAFFIC:
            raise ValueError("a run of the suite traffic has no families; use all_scores.py for it")
        rows = without_fcw_driver(run.rows)
        where = run.config.suite + ("" if run.config.worlds else ", laboratory")
        check_agents(agents, run)
        for family in sorted({row["case"].split("/")[1] for row in rows}):
            cells = []
            for agent in agents:
                of_family = [row for row in rows if row["case"].split("/")[1] == family]
                result = summarise(agent, "", [row for row in of_family if row["agent"] == agent])
                cells.append(rate_text(result.avoided if result.avoided.n else result.false_activations))
            lines.append([where, family, *cells])
    return [f"| {' | '.join(line)} |" for line in lines]


def check_agents(agents: Sequence[str], run: StoredRun) -> None:
    """Raise ValueError if a run does not contain one of the agents."""
    for agent in agents:
        if agent not in run.config.agents:
            known = ", ".join(run.config.agents)
            raise ValueError(f"the run of {run.config.suite} has no agent {agent!r}; it has {known}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Scores by scenario family")
    parser.add_argument("runs", type=Path, nargs="+", help="run folders of lgmd-gym bench")
    parser.add_argument("--agents", nargs="+", required=True, help="agents of the runs")
    options = parser.parse_args()
    try:
        print(*table(options.agents, [read_run(folder) for folder in options.runs]), sep="\n")
    except ValueError as error:
        parser.error(str(error))
