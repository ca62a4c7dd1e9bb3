"""Maps of what breaks first: the share of avoided contacts over two quantities at a time, per agent.

    python docs/experiments/failure_maps.py --agents stopping-zone policy:all-round --worlds 8 --jobs 2 \
        --to failure_maps.png

Each cell of a map is one approach to a standing target, played once per test world in the condition and with
the brake of that world. A run counts as avoided if it has neither contact nor premature braking. Five planes,
of which the last one is played only if `--planes` names it:

- `vibration`: motion of the car's body, as a multiple of the measured motion, and contrast of the ground's
  texture, as a multiple of that of the world; a car, at 50 km/h;
- `width`: width of the target, a box as long and as high as a car, and ego speed;
- `brake`: deceleration of full braking, in place of that of the world, and ego speed; a car;
- `curve`: radius of the road and ego speed; a car in the ego's lane. The whole approach is on the curve, to
  the right in even worlds and to the left in odd ones; an infinite radius is a straight road. Lateral
  accelerations above 4 m/s² are left out;
- `height`: height of a box 2 m wide and as long as a car, and ego speed.

Tables in Markdown list k/n with a 95 % interval. In the figure, a line separates the cells with at least 90 %
from the others; the dashed line is that of `--bound`, an agent that uses no camera. No value is interpolated
between cells.
"""

import argparse
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from joblib import delayed

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.analysis.tables import rate_text
from lgmd_gym.benchmark.case import Case, Row, key_of, make_case, to_mps
from lgmd_gym.benchmark.player import play_unit
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.summary import rate_of
from lgmd_gym.benchmark.task import NO_BRAKE, Result, Task
from lgmd_gym.benchmark.units import Unit, make_units
from lgmd_gym.camera.scene import ROADS
from lgmd_gym.camera.worlds import SPLIT_WORLDS
from lgmd_gym.envs.appearance import MIXED
from lgmd_gym.envs.families.curves import MAX_LATERAL
from lgmd_gym.errors import counted
from lgmd_gym.plotting.style import COLOURS, saved_figure
from lgmd_gym.processes.pool import run_parallel
from lgmd_gym.rendering.playback import make_target
from lgmd_gym.statistics.intervals import Rate

SUITE = "failure-maps"
PLANES = ("vibration", "width", "brake", "curve", "height")
DEFAULT_PLANES = PLANES[:4]  # of the figure in the documentation
LOW_BOX_WIDTH = 2.0  # of the plane `height` [m]
GRIDS = {
    "textures": ([0.5, 1.0, 1.6, 2.5], "contrasts of the ground, relative to that of the world"),
    "widths": ([0.3, 0.5, 0.8, 1.2, 1.7, 2.5], "widths of the target [m]"),
    "decelerations": ([5.0, 6.0, 7.0, 8.0, 9.5], "decelerations of full braking [m/s²]"),
    "radii": ([60.0, 100.0, 200.0, 400.0, 800.0, math.inf], "radii of the curve [m]; inf for a straight"),
    "heights": ([0.3, 0.5, 0.8, 1.2, 1.7], "heights of the box [m]"),
    "speeds": ([20.0, 40.0, 60.0, 80.0, 100.0], "ego speeds of all planes but vibration [km/h]"),
}

Map = list[list[Rate | None]]  # rate of each cell by row and column; None for one that is left out


class Cell(NamedTuple):
    """One cell of a map: a case, and the road in place of the usual one."""

    case: Case
    road: str | None = None


class Axis(NamedTuple):
    """One quantity of a map: its label and its values."""

    label: str
    values: Sequence[Any]

    @property
    def ticks(self) -> list[str]:
        """Labels of the values; the number of a road is its multiple of the measured motion."""
        special = {math.inf: "∞"} | {road: f"{road}\n{gain:g} ×" for road, gain in ROADS.items()}
        return [special.get(value) or f"{value:g}" for value in self.values]


class Plane(NamedTuple):
    """Two quantities, and the cell for their values and for the number of a world; None if left out."""

    title: str
    x: Axis
    y: Axis
    cell: Callable[[Any, Any, int], Cell | None]


def vibration_cell(road: str, texture: float, world: int) -> Cell:
    """Return the cell of a road and a texture contrast."""
    name, scene = f"road-{road}-texture-{texture:g}", {"texture": texture}
    return Cell(make_case(SUITE, "CCRs", name, ego_speed=to_mps(50), scene=scene), road)


def width_cell(width: float, speed_kmh: float, world: int) -> Cell:
    """Return the cell of a target width [m]."""
    name = f"width-{width:g}-v{speed_kmh:g}"
    return Cell(make_case(SUITE, "StandingBox", name, ego_speed=to_mps(speed_kmh), width=width))


def brake_cell(deceleration: float, speed_kmh: float, world: int) -> Cell:
    """Return the cell of a deceleration [m/s²]; dead time and build-up are those of the world's brake."""
    brake = {"max_deceleration": deceleration}
    name = f"brake-{deceleration:g}-v{speed_kmh:g}"
    return Cell(make_case(SUITE, "CCRs", name, ego_speed=to_mps(speed_kmh), config=brake))


def curve_cell(radius: float, speed_kmh: float, world: int) -> Cell | None:
    """Return the cell of a radius [m], infinite for a straight; None with too much lateral acceleration."""
    speed, name = to_mps(speed_kmh), f"radius-{radius:g}-v{speed_kmh:g}"
    if math.isinf(radius):
        return Cell(make_case(SUITE, "CCRs", name, ego_speed=speed))
    if speed**2 / radius > MAX_LATERAL:
        return None
    left = bool(world % 2)
    return Cell(make_case(SUITE, "CCRsCurve", name, ego_speed=speed, radius=radius, left=left))


def height_cell(height: float, speed_kmh: float, world: int) -> Cell:
    """Return the cell of a height [m] of a box."""
    name, speed = f"height-{height:g}-v{speed_kmh:g}", to_mps(speed_kmh)
    return Cell(make_case(SUITE, "StandingBox", name, ego_speed=speed, width=LOW_BOX_WIDTH, height=height))


def make_planes(chosen: argparse.Namespace) -> dict[str, Plane]:
    """Return the planes by name."""
    motion = Axis("road (1 ×: measured motion)", chosen.roads)
    contrast = Axis("contrast of the ground [×]", chosen.textures)
    width, speed = Axis("width [m]", chosen.widths), Axis("ego speed [km/h]", chosen.speeds)
    brake, radius = Axis("deceleration [m/s²]", chosen.decelerations), Axis("radius [m]", chosen.radii)
    height = Axis("height [m]", chosen.heights)
    return {
        "vibration": Plane("vibration, at 50 km/h", motion, contrast, vibration_cell),
        "width": Plane("width of the target", width, speed, width_cell),
        "brake": Plane("brake", brake, speed, brake_cell),
        "curve": Plane("curve", radius, speed, curve_cell),
        "height": Plane("height of a box 2 m wide", height, speed, height_cell),
    }


def check_cells(plane: Plane, world: int) -> None:
    """Raise ValueError if a value is outside the range of its scenario or environment."""
    for x, y in product(plane.x.values, plane.y.values):
        cell = plane.cell(x, y, world)
        if cell is not None:
            make_target(cell.case, {}, camera=None).close()


NO_VIEW = SensorConfig({"name": "wide", "shape": [8, 8]})  # no-brake and oracles need no useful image


def play_all(unit: Unit) -> list[Result]:
    """Return the results of a unit of tasks."""
    return list(play_unit(unit))


def play(tasks: Sequence[Task], jobs: int, agents: tuple[str, ...]) -> list[Result]:
    """Return the results of tasks; each process makes all agents at its first task, see `make_units`."""
    parts = run_parallel((delayed(play_all)(unit) for unit in make_units(tasks, jobs, agents)), jobs)
    results = [result for part in parts for result in part]
    failed = next((result.row["error"] for result in results if result.row["error"]), None)
    if failed:
        raise RuntimeError(failed)
    return results


def play_plane(plane: Plane, agents: Sequence[str], bound: str, worlds: range, jobs: int) -> dict[str, Map]:
    """Return the map of every agent and of the bound."""
    cells = [
        (cell, world)
        for x, y, world in product(plane.x.values, plane.y.values, worlds)
        if (cell := plane.cell(x, y, world)) is not None
    ]

    def tasks(agent: str, sensors: SensorConfig) -> list[Task]:
        # The seed draws the grey of the target and its place on the texture: one for each world.
        return [
            Task(agent, cell.case, world - worlds.start, sensors, None, MIXED, world, cell.road)
            for cell, world in cells
        ]

    every = tuple(dict.fromkeys((*agents, bound)))
    unbraked = play(tasks(NO_BRAKE, NO_VIEW), jobs, every)
    truths = {key_of(result.row)[1:]: result.counterfactual for result in unbraked}
    maps = {}
    for agent in every:
        sensors = SensorConfig() if agent in agents else NO_VIEW
        paired = [replace(task, counterfactual=truths[task.key[1:]]) for task in tasks(agent, sensors)]
        maps[agent] = to_map(plane, [result.row for result in play(paired, jobs, every)], worlds)
    return maps


def to_map(plane: Plane, rows: Sequence[Row], worlds: range) -> Map:
    """Return the rates of avoided contacts of an agent's rows."""
    by_case: dict[str, list[Row]] = {}
    for row in rows:
        by_case.setdefault(row["case"], []).append(row)

    def rate(x: Any, y: Any) -> Rate | None:
        cell = plane.cell(x, y, worlds.start)
        return None if cell is None else rate_of(by_case[cell.case.name], "avoided")

    return [[rate(x, y) for x in plane.x.values] for y in plane.y.values]


def table(plane: Plane, rates: Map) -> list[str]:
    """Return the lines of a map in Markdown."""
    lines = [[f"{plane.y.label} \\ {plane.x.label}", *(tick.replace("\n", " ") for tick in plane.x.ticks)]]
    lines.append(["---"] * len(lines[0]))
    for tick, row in zip(plane.y.ticks, rates, strict=True):
        lines.append([tick, *("–" if rate is None else rate_text(rate) for rate in row)])
    return [f"| {' | '.join(line)} |" for line in lines]


CONTOUR_LEVEL = 0.9

AGENT_LINE: dict[str, Any] = {"color": COLOURS[1], "linewidth": 3.0, "solid_capstyle": "projecting"}
BOUND_LINE: dict[str, Any] = {"color": COLOURS[0], "linewidth": 1.4, "linestyle": "--"}

LEFT_OUT = "0.85"  # grey
LEAST_WIDTH = 6.4  # of the figure, for its title and legend [inches]


def to_shares(rates: Map) -> np.ndarray:
    """Return rates as shares, shape (rows, columns), NaN where left out."""
    return np.array(
        [[math.nan if rate is None else rate.k / max(rate.n, 1) for rate in row] for row in rates]
    )


def edges(shares: np.ndarray) -> list[tuple[list[int], list[int]]]:
    """Return the edges between cells that reach the level and others, as x and y of their two ends.

    Args:
        shares: Share of each cell, shape (rows, columns), NaN if left out; cell (i, j) has its corners at
            x = j, j + 1 and y = i, i + 1.
    """

    def differ(*cells: tuple[int, int]) -> bool:
        one, other = (float(shares[cell]) for cell in cells)
        return math.isfinite(one + other) and (one >= CONTOUR_LEVEL) != (other >= CONTOUR_LEVEL)

    found = []
    for i, j in np.ndindex(*shares.shape):
        if j and differ((i, j - 1), (i, j)):
            found.append(([j, j], [i, i + 1]))
        if i and differ((i - 1, j), (i, j)):
            found.append(([j, j + 1], [i, i]))
    return found


def draw_map(axes: Any, plane: Plane, rates: Map, bound: Map) -> None:
    """Draw a map as coloured cells with numbers, its contour, and that of the bound."""
    shares = to_shares(rates)
    axes.set_facecolor(LEFT_OUT)
    axes.pcolormesh(shares, cmap="Blues", vmin=0.0, vmax=1.1, edgecolors="white", linewidth=0.5)
    for (i, j), share in np.ndenumerate(shares):
        if math.isfinite(share):
            style = {"ha": "center", "va": "center", "color": "white" if share > 0.6 else "black"}
            axes.text(j + 0.5, i + 0.5, f"{100 * share:.0f}", fontsize=8, **style)
    for x, y in edges(shares):
        axes.plot(x, y, **AGENT_LINE)
    for x, y in edges(to_shares(bound)):
        axes.plot(x, y, **BOUND_LINE)
    axes.set_xticks(np.arange(len(plane.x.ticks)) + 0.5, plane.x.ticks, fontsize=8)
    axes.set_yticks(np.arange(len(plane.y.ticks)) + 0.5, plane.y.ticks, fontsize=8)
    axes.set_ylabel(plane.y.label, fontsize=8)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)


def draw(played: Sequence[tuple[Plane, dict[str, Map]]], chosen: argparse.Namespace) -> None:
    """Draw one row of maps per agent."""
    shape = len(chosen.agents), len(played)
    size = (max(0.3 + 2.65 * shape[1], LEAST_WIDTH), 1.1 + 2.2 * shape[0])
    with saved_figure(chosen.to, *shape, grid=False, squeeze=False, figsize=size) as (figure, panels):
        for row, agent in zip(panels, chosen.agents, strict=True):
            for axes, (plane, maps) in zip(row, played, strict=True):
                draw_map(axes, plane, maps[agent], maps[chosen.bound])
            row[0].set_ylabel(f"{agent}\n\n{row[0].get_ylabel()}")
        for top, bottom, (plane, _) in zip(panels[0], panels[-1], played, strict=True):
            top.set_title(plane.title, fontsize=9)
            bottom.set_xlabel(plane.x.label, fontsize=8)
        lines = [panels[0, 0].plot([], [], **style)[0] for style in (AGENT_LINE, BOUND_LINE)]
        left_out = panels[0, 0].fill([], [], color=LEFT_OUT)[0]
        names = [f"edge of {CONTOUR_LEVEL:.0%} avoided", f"the same for {chosen.bound}", "left out"]
        figure.legend([*lines, left_out], names, loc="outside lower center", ncols=3, fontsize=8)
        worlds = counted(chosen.worlds, "test world")
        figure.suptitle(f"Contacts avoided without premature braking in {worlds} [%]")


def read_options(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Return the options of the command line."""
    first = SPLIT_WORLDS["test"].start
    parser = argparse.ArgumentParser(description="Maps of avoided contacts")
    parser.add_argument("--agents", nargs="+", default=["stopping-zone", "policy:all-round"])
    parser.add_argument("--bound", default="ttc-oracle", help="agent that uses no camera")
    parser.add_argument("--worlds", type=int, default=8, help="number of worlds, the sample of each cell")
    parser.add_argument("--first-world", type=int, default=first)
    parser.add_argument("--planes", nargs="+", choices=PLANES, default=DEFAULT_PLANES)
    parser.add_argument("--roads", nargs="+", choices=ROADS, default=list(ROADS))
    for name, (values, text) in GRIDS.items():
        parser.add_argument(f"--{name}", nargs="+", type=float, default=values, help=text)
    parser.add_argument("--jobs", type=int, default=1, help="number of processes")
    parser.add_argument("--to", type=Path, help="picture to write")
    chosen = parser.parse_args(arguments)
    test = SPLIT_WORLDS["test"]
    if chosen.worlds < 1 or not test.start <= chosen.first_world <= test.stop - chosen.worlds:
        parser.error(f"worlds must be test worlds, {test.start} to {test.stop - 1}")
    try:
        bound, *_ = (make_agent(name) for name in (chosen.bound, *chosen.agents))  # all names, before any run
        for plane in (make_planes(chosen)[name] for name in chosen.planes):
            check_cells(plane, chosen.first_world)
    except ValueError as error:
        parser.error(str(error))
    if bound.reads_neuron or bound.include_frame:
        parser.error(f"--bound must use no camera, got {chosen.bound}; add it to --agents")
    return chosen


def main(arguments: Sequence[str] | None = None) -> list[dict[str, Map]]:
    """Print the tables, draw the figure, and return the maps of each plane by agent."""
    chosen = read_options(arguments)
    worlds = range(chosen.first_world, chosen.first_world + chosen.worlds)
    planes, played = make_planes(chosen), []
    for name in chosen.planes:
        played.append(
            (planes[name], play_plane(planes[name], chosen.agents, chosen.bound, worlds, chosen.jobs))
        )
        for agent, rates in played[-1][1].items():
            print("\n".join([f"\n{agent}: {planes[name].title}\n", *table(planes[name], rates)]), flush=True)
    if chosen.to:
        draw(played, chosen)
    return [maps for _, maps in played]


if __name__ == "__main__":
    main()
