# pyright: standard
# Not strict: matplotlib states few types.
"""What does a brake cost, and what does it bring? Threats avoided against speed lost in traffic, per agent.

    lgmd-gym bench --suite everyday-threats --agents AGENT ... --out runs/threats
    lgmd-gym bench --suite traffic --agents AGENT ... --out runs/traffic
    python docs/experiments/benefit_risk.py docs/benefit_risk.png runs/threats runs/traffic

The figure has a point for each agent of both runs, with the 95 % interval of the avoided share, clustered by
case and world. A line connects the agents that differ in their options only, such as `margin`, in the order
of their speed lost. The speed lost is that of activations that are not needed, per 100 km with attentive
drivers.
"""

import argparse
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from lgmd_gym.benchmark.case import is_traffic
from lgmd_gym.benchmark.run_folder import StoredRun, read_run
from lgmd_gym.benchmark.summary import rate_of, without_fcw_driver
from lgmd_gym.benchmark.traffic.summary import traffic_summaries
from lgmd_gym.processes.files import complete_file
from lgmd_gym.statistics.intervals import Rate

LINEAR_TO = 1.0  # [m/s per 100 km]; logarithmic beyond


class Point(NamedTuple):
    """Results of an agent."""

    agent: str
    speed_lost: float  # [m/s per 100 km]
    avoided: Rate


def points_of(threats: StoredRun, traffic: StoredRun) -> list[Point]:
    """Return the results of the agents of both runs, in the order of the first.

    Raises:
        ValueError: If one of the runs is of another kind, or they have no agent in common that has played.
    """
    if is_traffic(threats.config.suite) or not is_traffic(traffic.config.suite):
        raise ValueError(
            f"the runs must be of everyday-threats and traffic, in this order, got {threats.config.suite} "
            f"and {traffic.config.suite}"
        )
    drives = {item.agent: item for item in traffic_summaries(traffic.rows)}
    points: list[Point] = []
    for agent in threats.config.agents:
        if agent in drives:
            rows = [
                row for row in without_fcw_driver(threats.rows) if row["agent"] == agent and row["threat"]
            ]
            lost = drives[agent].per_100km(drives[agent].speed_lost)
            if rows and drives[agent].drives:
                points.append(Point(agent, lost, rate_of(rows, "avoided")))
    if not points:
        raise ValueError(
            f"the runs must have an agent in common, got {' '.join(threats.config.agents)} "
            f"and {' '.join(traffic.config.agents)}"
        )
    return points


def curves_of(points: Iterable[Point]) -> dict[str, list[Point]]:
    """Return the points by the agent without options, in the order of the speed lost, then of the avoided."""
    curves: dict[str, list[Point]] = {}
    for point in sorted(points, key=lambda item: (item.speed_lost, item.avoided.k)):
        curves.setdefault(family_of(point.agent), []).append(point)
    return curves


def family_of(agent: str) -> str:
    """Return the name of an agent without options: "policy:all-round" for "policy:all-round:margin=1"."""
    return ":".join(part for part in agent.split(":") if "=" not in part)


def draw(points: Sequence[Point], file: Path) -> None:
    """Write the figure."""
    figure = Figure(figsize=(7.0, 4.5), layout="constrained")
    axes = figure.subplots()
    for family, curve in curves_of(points).items():
        x = [point.speed_lost for point in curve]
        y, low, high = (
            100.0 * np.array([value(point.avoided) for point in curve])
            for value in (lambda rate: rate.k / rate.n, lambda rate: rate.low, lambda rate: rate.high)
        )
        axes.errorbar(x, y, [y - low, high - y], fmt="o-", markersize=4, capsize=2, linewidth=1, label=family)
        for number, (point, left, height) in enumerate(zip(curve, x, y, strict=True)):
            options = ":".join(part for part in point.agent.split(":") if "=" in part)
            # In turn above and below the curve, for room between the labels of near points.
            side = {"va": "top", "xytext": (4, -4)} if number % 2 else {"va": "bottom", "xytext": (4, 4)}
            axes.annotate(options, (left, height), textcoords="offset points", fontsize=6, **side)
    axes.set_xscale("symlog", linthresh=LINEAR_TO)
    axes.set_xlim(left=0.0)
    axes.set_ylim(0.0, 100.0)
    axes.set_xlabel("speed lost without need in traffic [m/s per 100 km]")
    axes.set_ylabel("everyday threats avoided [%]")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, loc="upper left")
    with complete_file(file) as part:
        figure.savefig(part, format="png", dpi=120)


def main(arguments: Sequence[str] | None = None) -> list[Point]:
    """Write the figure, print its points, and return them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("file", type=Path, help="PNG file to write")
    parser.add_argument("threats", type=Path, help="folder of lgmd-gym bench --suite everyday-threats")
    parser.add_argument("traffic", type=Path, help="folder of lgmd-gym bench --suite traffic")
    options = parser.parse_args(arguments)
    try:
        points = points_of(read_run(options.threats), read_run(options.traffic))
    except ValueError as error:
        parser.error(str(error))
    draw(points, options.file)
    for point in points:
        print(f"{point.agent}: {point.avoided.k}/{point.avoided.n}, {point.speed_lost:.1f} m/s per 100 km")
    return points


if __name__ == "__main__":
    main()
