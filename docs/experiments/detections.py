"""Contacts avoided because of the target, in every scenario family of a suite.

    python docs/experiments/detections.py ncap2023 ncap2023-without-target --agents stopping-zone ttc-oracle

The arguments are a run folder of `lgmd-gym bench` and one of the same suite without targets, and more of such
pairs. A cell contains the contacts that the agent avoids and in which it
does not brake without the target, in the same scenario and world, with an interval; in parentheses, all
contacts avoided. Cases with an FCW driver are left out. The table is in Markdown.
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from all_scores import check_agents, markdown

from lgmd_gym.benchmark.analysis.tables import rate_text
from lgmd_gym.benchmark.case import Row
from lgmd_gym.benchmark.protocols.car_to_car_2023 import SUFFIX
from lgmd_gym.benchmark.run_folder import StoredRun, read_run
from lgmd_gym.benchmark.summary import summarise, without_fcw_driver


def detected_rows(run: StoredRun, without_target: StoredRun) -> list[Row]:
    """Return the rows of a run in which `avoided` is False where the agent also brakes without the target.

    Args:
        run: Run of a suite, "ncap2023" for example.
        without_target: Run of the same suite without targets, "ncap2023-without-target", otherwise with the
            same configuration; it may have further agents. An agent brakes where it has a false activation.

    Raises:
        ValueError: If the second run is of another suite, has another configuration, or lacks an episode of
            the first one.
    """
    expected = f"{run.config.suite}{SUFFIX}"
    if without_target.config.suite != expected:
        raise ValueError(
            f"a run of {expected} is required beside one of {run.config.suite}, got one of "
            f"{without_target.config.suite}"
        )
    same = {"suite": expected, "agents": without_target.config.agents}
    if replace(run.config, **same) != without_target.config:
        raise ValueError(
            f"the runs of {run.config.suite} and {expected} have other settings; run both with the same "
            "seeds, worlds, conditions, road, camera and params"
        )
    # A failed episode (false_activation is None) is no evidence.
    quiet = {_key(row): row["false_activation"] is False for row in without_target.rows}
    for row in run.rows:
        if _key(row) not in quiet:
            raise ValueError(
                f"the run of {expected} lacks {row['case']} of {row['agent']}, seed {row['seed']}; run both "
                "suites with the same agents, and to the end"
            )
    return [{**row, "avoided": row["avoided"] and quiet[_key(row)]} for row in run.rows]


def _key(row: Row) -> tuple[object, ...]:
    """Return what a row has in common with that of the same case without its target."""
    case = row["case"].removeprefix(row["suite"])
    return row["agent"], case, row["seed"], row["condition"], row["world"]


def lines(agents: Sequence[str], run: StoredRun, without_target: StoredRun) -> list[list[str]]:
    """Return a line of cells for each family of a run, and one for all of them.

    Raises:
        ValueError: If a run does not contain one of the agents, or the runs do not belong together.
    """
    check_agents(agents, run)
    run = run._replace(rows=[row for row in run.rows if row["agent"] in agents])
    pairs = list(zip(run.rows, detected_rows(run, without_target), strict=True))
    pairs = [pair for pair in pairs if without_fcw_driver([pair[0]])]
    families = sorted({row["family"] for row, _ in pairs})
    groups = {name: [pair for pair in pairs if pair[0]["family"] == name] for name in families} | {
        "all": pairs
    }
    return [
        [str(run.config.suite), name, *(_cell(agent, group) for agent in agents)]
        for name, group in groups.items()
    ]


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
