"""Learning curves of training runs: mean return on validation levels over the number of decisions.

    python docs/experiments/learning_curves.py docs/tutorials/rl_training.png runs/dqn0 runs/dqn1

A curve contains the evaluations of a folder of `lgmd-gym train`.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from lgmd_gym.plotting.style import COLOURS


def main(path: Path, folders: list[Path]) -> None:
    """Draw the curves and print the best evaluation of each run."""
    figure = Figure(figsize=(7.0, 3.0), layout="constrained")
    axis = figure.subplots()
    for index, folder in enumerate(folders):
        with np.load(folder / "best" / "evaluations.npz") as log:
            decisions, returns = log["timesteps"], log["results"]
        means = returns.mean(axis=1)
        axis.plot(decisions / 1000.0, means, ".-", color=COLOURS[index % len(COLOURS)], label=folder.name)
        best, n = int(means.argmax()), returns.shape[1]
        print(f"{folder.name}: best return {means[best]:.2f} at {decisions[best]} decisions, n = {n}")
    axis.set(xlabel="thousand decisions", ylabel="mean return, validation")
    axis.grid(alpha=0.3)
    axis.legend(frameon=False)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]), list(map(Path, sys.argv[2:])))
