"""Add agents to the leaderboard: run all of its suites, and print a row per agent.

    python docs/experiments/leaderboard.py --agents my_module:MyAgent policy:my.zip --out runs/board --jobs 2

The run folders are subfolders of `--out`. A suite whose folder exists is not run again; complete an
interrupted one with `lgmd-gym bench --resume FOLDER`. The page "Leaderboard" states which levels, worlds and
seeds an entry may be trained and tuned on.
"""

import argparse
import sys
from pathlib import Path
from typing import Any

from all_scores import column, table

from lgmd_gym import benchmark
from lgmd_gym.benchmark import RunConfig
from lgmd_gym.benchmark.analysis.tables import rate_text
from lgmd_gym.benchmark.plan import make_plan
from lgmd_gym.benchmark.run_folder import StoredRun, read_run
from lgmd_gym.benchmark.summary import summarise
from lgmd_gym.errors import counted
from lgmd_gym.processes.pool import Executor

# Worlds 8,000 to 8,019 and the road "normal" are the defaults.
MIXED = {"conditions": ("mixed",)}
RUNS: dict[str, dict[str, Any]] = {
    "levels": {"suite": str(Path(__file__).with_name("levels.toml")), "seeds": 1},
    "r152": {"suite": "r152", "seeds": 20, **MIXED},
    "fmvss127": {"suite": "fmvss127", "seeds": 5, **MIXED},
    "ncap2023-vru": {"suite": "ncap2023-vru", "seeds": 1, **MIXED},
    "false-reaction": {"suite": "false-reaction", "seeds": 5, **MIXED},
    "near-miss": {"suite": "near-miss", "seeds": 5, **MIXED},
    "without-target": {"suite": "ncap2023-vru-without-target", "seeds": 1, **MIXED},
    "traffic": {"suite": "traffic", "seeds": 8, "first_seed": 110, **MIXED},
}


def main(agents: list[str], out: Path, runs: list[str], jobs: int = 1) -> None:
    """Run the suites that are missing and print the table."""
    for name in runs:
        if not (out / name).exists():
            config = RunConfig(agents=tuple(agents), **RUNS[name])
            benchmark.run(config, out / name, Executor(jobs=jobs), plots=False, report=False)
    columns = []
    for name in runs:
        run = check_run(read_run(out / name), agents, out / name)
        columns.append(column(run))
        if name == "levels":  # has both threats and other episodes
            columns.append(false_activations(run))
    print(*table(columns), sep="\n")


def check_run(run: StoredRun, agents: list[str], folder: Path) -> StoredRun:
    """Return a run that has all agents and all episodes.

    Raises:
        ValueError: If an agent or an episode is missing.
    """
    for agent in agents:
        if agent not in run.config.agents:
            known = ", ".join(run.config.agents)
            raise ValueError(f"the run in {str(folder)!r} has {known}, not {agent}; choose another --out")
    missing = make_plan(run.config).total - len(run.rows)
    if missing:
        raise ValueError(
            f"the run in {str(folder)!r} lacks {counted(missing, 'episode')}; "
            f"complete it with lgmd-gym bench --resume {folder}"
        )
    return run


def false_activations(run: StoredRun) -> dict[str, str]:
    """Return a column with the false activations of a run."""
    rates = {
        agent: summarise(agent, "", [row for row in run.rows if row["agent"] == agent]).false_activations
        for agent in run.config.agents
    }
    return {"agent": "levels: false activations"} | {agent: rate_text(rate) for agent, rate in rates.items()}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--agents", nargs="+", required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--runs", nargs="+", choices=list(RUNS), default=list(RUNS))
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    try:
        main(options.agents, options.out, options.runs, options.jobs)
    except ValueError as error:
        sys.exit(str(error))
