"""Contacts avoided because of the target, in every scenario family of a suite.

    python docs/experiments/detections.py ncap2023 ncap2023-without-target --agents stopping-zone ttc-oracle

The arguments are a run folder of `lgmd-gym bench` and one of the same suite without targets, and more of such
pairs. A cell contains the contacts that the agent avoids and in which it
does not brake without the target, in the same scenario and world, with an interval; in parentheses, all
contacts avoided. Cases with an FCW driver are left out. The table is in Markdown.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from all_scores import check_agents, markdown

from lgmd_gym.benchmark.analysis.detections import detected_rows
from lgmd_gym.benchmark.analysis.tables import rate_text
from lgmd_gym.benchmark.rows import Row
from lgmd_gym.benchmark.stored_run import StoredRun, read_run
from lgmd_gym.benchmark.summary import summarise, without_fcw_driver


def lines(agents: Sequence[str], run: StoredRun, without_target: StoredRun) -> list[list[str]]:
    """Return a line of cells for each family of a run, and one for all of them.

    Raises:
        ValueError: If a run does not contain one of the agents, or the runs do not belong together.
    """
    check_agents(agents, run)
    run = run._replace(rows=[row for row in run.rows if row["agent"] in agents])
    pairs = list(zip(run.rows, detected_rows(run, without_target), strict=True))
    pairs = [pair for pair in pairs if without_fcw_driver([pair[0]])]
    families = sorted({_family(row) for row, _ in pairs})
    groups = {name: [pair for pair in pairs if _family(pair[0]) == name] for name in families} | {
        "all": pairs
    }
    return [
        [str(run.config.suite), name, *(_cell(agent, group) for agent in agents)]
        for name, group in groups.items()
    ]


def _family(row: Row) -> str:
    return row["case"].split("/")[1]


def _cell(agent: str, pairs: Sequence[tuple[Row, Row]]) -> str:
    avoided, detected = (
        summarise(agent, "", [row for row in rows if row["agent"] == agent]).avoided
        for rows in zip(*pairs, strict=True)
    )
    return f"{rate_text(detected)} ({avoided.k})"


def main(agents: Sequence[str], folders: Sequence[Path]) -> None:
    """Print the table of pairs of run folders."""
    table = [["suite", "family", *(f"`{agent}`" for agent in agents)]]
    runs = [read_run(folder) for folder in folders]
    for run, without_target in zip(runs[::2], runs[1::2], strict=True):
        table += lines(agents, run, without_target)
    print(*markdown(table), sep="\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Contacts avoided because of the target")
    parser.add_argument("runs", type=Path, nargs="+", help="run folders, and those without targets")
    parser.add_argument("--agents", nargs="+", required=True, help="agents of the runs")
    options = parser.parse_args()
    if len(options.runs) % 2:
        parser.error(f"runs must be pairs of folders with and without targets, got {len(options.runs)}")
    try:
        main(options.agents, options.runs)
    except ValueError as error:
        parser.error(str(error))
