"""Closed-loop braking benchmark: hold two thresholds of the plain rule against the oracle.

    python docs/examples/braking_benchmark.py RUN_FOLDER

Writes the folder (rows, summary, time series) and prints avoided threats and false braking per agent.
"""

import sys
from pathlib import Path

from lgmd_gym.benchmark.runner import Run
from lgmd_gym.benchmark.summary import scores

AGENTS = ["spike-threshold:threshold=30", "spike-threshold:threshold=90,frames=2", "ttc-oracle"]


def main(folder: Path, seeds: int = 1) -> None:
    """Play the quick suite and print one line per agent."""
    run = Run("quick", AGENTS, seeds=seeds, jobs=1, out=folder)
    run.play()
    for item in scores(run.rows, lambda row: ""):
        avoided, false = item.avoided, item.false_brakes
        print(f"{item.agent:40} avoided {avoided.k}/{avoided.n}  false braking {false.k}/{false.n}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "runs/example"))
