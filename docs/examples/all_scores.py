"""One table of the scores of all agents in several runs.

    python docs/examples/all_scores.py RUN RUN ...

Each argument is a run folder of `lgmd-gym bench`. Each run is a column, each agent a row. A cell contains the
threats avoided (without contact and premature braking) or, in a suite without threats, the episodes with a
false activation, both with an interval that clusters by case and world. In traffic it contains the false
activations per 100 km. Cases with an FCW driver are left out. The table is in Markdown.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

from lgmd_gym.benchmark import get_suite
from lgmd_gym.benchmark.analysis.tables import rate_text
from lgmd_gym.benchmark.rows import Row
from lgmd_gym.benchmark.stored_run import StoredRun, read_run
from lgmd_gym.benchmark.suites import TRAFFIC
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
    traffic = run.config.suite == TRAFFIC
    rows = run.rows if traffic else without_fcw_driver(run.rows)
    threats = any(row["threat"] for row in rows)
    what = "false activations" if not threats else "avoided"
    what = "false activations per 100 km" if traffic else what
    suite = TRAFFIC if traffic else get_suite(run.config.suite).name
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
    lines = [[name, *(cells.get(name, "–") for cells in columns)] for name in names]
    lines.insert(1, ["---"] * len(lines[0]))
    return ["| " + " | ".join(line) + " |" for line in lines]


if __name__ == "__main__":
    if len(sys.argv) == 1:
        sys.exit(__doc__)
    try:
        stored = [read_run(Path(folder)) for folder in sys.argv[1:]]
    except ValueError as error:
        sys.exit(str(error))
    print(*table([column(run) for run in stored]), sep="\n")
