"""Maps of what breaks first: the share of avoided contacts over two quantities at a time, per agent.

    python docs/examples/failure_maps.py --agents stopping-zone policy:zones --worlds 8 --jobs 2 \
        --to docs/failure_maps.png

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
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

from failure_map_figure import draw
from failure_map_planes import DEFAULT_PLANES, GRIDS, PLANES, Map, Plane, check_cells, make_planes
from joblib import delayed

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.analysis.tables import rate_text
from lgmd_gym.benchmark.batch import play_unit
from lgmd_gym.benchmark.rows import Row, key_of
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.summary import rate_of
from lgmd_gym.benchmark.task import NO_BRAKE, Result, Task
from lgmd_gym.benchmark.units import Unit, make_units
from lgmd_gym.camera.params import ROADS
from lgmd_gym.camera.worlds import SPLIT_WORLDS
from lgmd_gym.envs.appearance import MIXED
from lgmd_gym.processes.worker_processes import run_parallel
from lgmd_gym.statistics.intervals import Rate

NO_VIEW = SensorConfig({"name": "wide", "shape": [8, 8]})  # no-brake and oracles need no useful image


def sensors_of(agent: str, texture: float | None) -> SensorConfig:
    """Return the agent's own sensors, with another contrast of the ground unless it is None."""
    if texture is None:
        return SensorConfig()
    own = SensorConfig().for_agent(make_agent(agent))
    camera: Any = own.plain.camera
    cameras = camera if isinstance(camera, list) else [camera]
    named = [{"name": item} if isinstance(item, str) else item for item in cameras]
    return replace(own, camera=[item | {"texture": texture} for item in named])


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

    def tasks(agent: str, sensors: dict[float | None, SensorConfig]) -> list[Task]:
        # The seed draws the grey of the target and its place on the texture: one for each world.
        return [
            Task(agent, cell.case, world - worlds.start, sensors[cell.texture], None, MIXED, world, cell.road)
            for cell, world in cells
        ]

    every = tuple(dict.fromkeys((*agents, bound)))
    textures = {cell.texture for cell, _ in cells}
    no_views = dict.fromkeys(textures, NO_VIEW)
    unbraked = play(tasks(NO_BRAKE, no_views), jobs, every)
    truths = {key_of(result.row)[1:]: result.counterfactual for result in unbraked}
    maps = {}
    for agent in every:
        views = {texture: sensors_of(agent, texture) for texture in textures} if agent in agents else no_views
        paired = [replace(task, counterfactual=truths[task.key[1:]]) for task in tasks(agent, views)]
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


def read_options(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Return the options of the command line."""
    first = SPLIT_WORLDS["test"].start
    parser = argparse.ArgumentParser(description="Maps of avoided contacts")
    parser.add_argument("--agents", nargs="+", default=["stopping-zone", "policy:zones"])
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
