"""Closed-loop braking benchmark: compare two thresholds of the spike-threshold rule with an oracle.

    python docs/examples/braking_benchmark.py runs/example docs/tutorials/braking_benchmark.png

Writes the run folder, prints avoided threats and false activations per agent, and plots both with their
intervals.
"""

import sys
from pathlib import Path

from matplotlib.figure import Figure

from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.runner import Run
from lgmd_gym.benchmark.summary import AgentSummary, summaries
from lgmd_gym.plotting.style import COLOURS
from lgmd_gym.statistics.intervals import Rate

AGENTS = ("spike-threshold:threshold=30", "spike-threshold:threshold=90,frames=2", "ttc-oracle")


def main(folder: Path, picture: Path | None = None, seeds: int = 1) -> list[AgentSummary]:
    """Run the quick suite, print one line per agent and plot the rates."""
    run = Run.new(RunConfig(suite="quick", agents=AGENTS, seeds=seeds, worlds=0), folder)
    run.play()
    found = summaries(run.rows, lambda row: "")
    for item in found:
        avoided, false = item.avoided, item.false_activations
        print(f"{item.agent:40} avoided {avoided.k}/{avoided.n}  false activations {false.k}/{false.n}")
    if picture is not None:
        draw(found, picture)
    return found


def draw(found: list[AgentSummary], picture: Path) -> None:
    """Plot the rates of each agent with their 95 % intervals."""
    figure = Figure(figsize=(8.0, 2.6), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    columns = (("threats avoided", "avoided", 2), ("false activations", "false_activations", 1))
    for axis, (title, field, colour) in zip(axes, columns, strict=True):
        for row, item in enumerate(found):
            rate: Rate = getattr(item, field)
            axis.plot([rate.low, rate.high], [row, row], color=COLOURS[colour], linewidth=2)
            axis.plot(rate.k / rate.n, row, "o", color=COLOURS[colour])
            axis.annotate(f"{rate.k}/{rate.n}", (rate.k / rate.n, row), (0, 6), textcoords="offset points")
        axis.set(title=title, xlabel="share of episodes", xlim=(-0.05, 1.2), ylim=(len(found) - 0.5, -0.7))
        axis.grid(alpha=0.3)
    axes[0].set_yticks(range(len(found)), [item.agent.replace(",", ",\n") for item in found])
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    arguments = [Path(item) for item in sys.argv[1:3]]
    main(*arguments or [Path("runs/example")])
