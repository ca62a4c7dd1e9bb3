"""Contacts that an agent avoids because of the target, and not because of the road."""

from dataclasses import replace

from lgmd_gym.benchmark.protocols.without_target import SUFFIX
from lgmd_gym.benchmark.rows import Row
from lgmd_gym.benchmark.stored_run import StoredRun


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
    return [row | {"avoided": row["avoided"] and quiet[_key(row)]} for row in run.rows]


def _key(row: Row) -> tuple[object, ...]:
    """Return what a row has in common with that of the same case without its target."""
    case = row["case"].split("/", 1)[1]
    return row["agent"], case, row["seed"], row["condition"], row["world"]
