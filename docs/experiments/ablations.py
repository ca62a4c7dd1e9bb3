"""Ablations of a sensor: scores of an agent with one property of its cameras changed at a time.

    python docs/experiments/ablations.py stopping-zone --worlds 20 --jobs 2 --to docs/ablations.png

Each arm plays suites in test worlds, in the condition and with the brake of each world: r152 (contacts
avoided without premature braking) and false-reaction (false activations), or `--suites`. In r152 every case
is played once in every world, in the others in `--seeds` of them. Thresholds and weights of the agent are
those of the complete sensor at 30 frames per second. The table has 95 % intervals that cluster by case and
world, and is in Markdown.
"""

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.analysis.tables import rate_text
from lgmd_gym.benchmark.case import Row
from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.player import run_task
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import find_suite
from lgmd_gym.benchmark.summary import rate_of
from lgmd_gym.benchmark.task import NO_BRAKE, Task
from lgmd_gym.camera import Camera
from lgmd_gym.camera.worlds import SPLIT_WORLDS
from lgmd_gym.envs.appearance import MIXED
from lgmd_gym.plotting.style import COLOURS, saved_figure
from lgmd_gym.statistics.intervals import Rate

NO_VIEW = SensorConfig({"name": "wide", "shape": [8, 8]})  # no-brake needs no useful image
SUITES = ("r152", "false-reaction")
NON_THREATS = ("false-reaction", "near-miss")  # suites whose score is the share of false activations


def title_of(suite: str) -> str:
    """Return the heading of the score of a suite."""
    return f"{suite}: {'false activations' if suite in NON_THREATS else 'contacts avoided'} [%]"


def halved(camera: Camera) -> Camera:
    """Return a camera with half of the rows and columns over the same field of view."""
    height, width = camera.shape
    return replace(camera, shape=(height // 2, width // 2))


def mounted(**fields: Any) -> Callable[[Camera], Camera]:
    """Return a change of a camera that replaces fields of its mount."""
    return lambda camera: replace(camera, mount=replace(camera.mount, **fields))


def tilted(degrees: float) -> Callable[[Camera], Camera]:
    """Return a change of a camera that tilts its mount upwards."""
    return lambda camera: replace(
        camera, mount=replace(camera.mount, pitch_deg=camera.mount.pitch_deg + degrees)
    )


def without_contrast_control(camera: Camera) -> Camera:
    """Return a camera without contrast control."""
    return replace(camera, sensor=replace(camera.sensor, contrast_s=0.0))


ARMS: dict[str, Callable[[Camera], Camera]] = {
    "complete sensor": replace,
    "no stabilisation": lambda camera: replace(camera, stabiliser=None),
    "no calibration": mounted(calibrated=False),
    "no contrast control": without_contrast_control,
    "half the pixels per row and column": halved,
    "camera 1.0 m high": mounted(height_m=1.0),
    "camera 1.5 m high": mounted(height_m=1.5),
    "pitch +1°": tilted(1.0),
    "pitch −1°": tilted(-1.0),
    "15 frames/s": replace,
    "60 frames/s": replace,
}
FPS = {"15 frames/s": 15.0, "60 frames/s": 60.0}
"""Frame rates of the arms with another one than 30 Hz."""


def play(agent: str, arm: str, suite: str, worlds: range, seeds: int, jobs: int, every: int) -> list[Row]:
    """Return the rows of an arm in a suite."""
    own = SensorConfig().for_agent(make_agent(agent))
    if isinstance(own.camera, str):
        raise ValueError(f"agent {agent!r} has no cameras of its own; use for example stopping-zone")
    cameras: list[Any] = [(channel, channel.camera) for channel in own.channels]
    changed = SensorConfig(
        [replace(channel, camera=ARMS[arm](camera)) for channel, camera in cameras], own.params
    )
    schedule = RunConfig(suite=suite, seeds=seeds, worlds=len(worlds), first_world=worlds.start)
    fps = (("fps", FPS[arm]),) if arm in FPS else ()
    cases = [replace(case, arguments=case.arguments + fps) for case in find_suite(suite).cases[::every]]

    def row(index: int, seed: int) -> Row:
        world = schedule.world(seed, index)
        assert world is not None
        place: dict[str, Any] = {"condition": MIXED, "world": world}
        truth = run_task(Task(NO_BRAKE, cases[index], seed, NO_VIEW, **place)).counterfactual
        return run_task(Task(agent, cases[index], seed, changed, truth, **place)).row

    order = [(index, seed) for index in range(len(cases)) for seed in range(seeds)]
    rows: Any = Parallel(n_jobs=jobs)(delayed(row)(*each) for each in order)
    failed = next((row["error"] for row in rows if row["error"]), None)
    if failed:
        raise RuntimeError(failed)
    return rows


def draw(file: Path, agent: str, rates: Mapping[str, Mapping[str, Rate]]) -> None:
    """Draw the rates of all arms with their intervals, one panel per suite."""
    suites = list(next(iter(rates.values())))
    with saved_figure(file, 1, len(suites), sharey=True, figsize=(9.0, 3.0), squeeze=False) as (
        figure,
        panels,
    ):
        for axes, suite in zip(panels[0], suites, strict=True):
            values = [rates[arm][suite] for arm in rates]
            shares = np.array([100.0 * rate.k / rate.n for rate in values])
            limits = 100.0 * np.array([(rate.low, rate.high) for rate in values]).T
            places = np.arange(len(values))[::-1]
            axes.barh(places, shares, color=COLOURS[2], height=0.6)
            errors = np.abs(limits - shares)
            axes.errorbar(shares, places, xerr=errors, fmt="none", ecolor=COLOURS[0], capsize=2)
            axes.set_yticks(places, list(rates))
            axes.set(xlim=(0, 100), title=title_of(suite))
            axes.grid(axis="y", visible=False)
        figure.suptitle(f"{agent}: one property of the sensor changed at a time")


def main(arguments: Sequence[str] | None = None) -> dict[str, dict[str, Rate]]:
    """Print the table, draw the figure, and return the rates by arm and suite."""
    parser = argparse.ArgumentParser(description="Ablations of a sensor")
    parser.add_argument("agent", nargs="?", default="stopping-zone")
    parser.add_argument("--arms", nargs="+", choices=ARMS, default=list(ARMS))
    parser.add_argument("--worlds", type=int, default=20)
    parser.add_argument("--suites", nargs="+", default=SUITES)
    parser.add_argument("--seeds", type=int, default=3, help="runs of each case of the suites but r152")
    parser.add_argument("--every", type=int, default=1, help="every n-th case of each suite only")
    parser.add_argument("--jobs", type=int, default=1, help="number of processes")
    parser.add_argument("--to", type=Path, help="picture to write")
    chosen = parser.parse_args(arguments)
    test, rates = SPLIT_WORLDS["test"], {}
    if not 1 <= chosen.worlds <= len(test):
        parser.error(f"--worlds must be in [1, {len(test)}], the test worlds, got {chosen.worlds}")
    worlds = test[: chosen.worlds]
    print(f"| {' | '.join([chosen.agent, *map(title_of, chosen.suites)])} |")
    print("|---" * (1 + len(chosen.suites)) + "|")
    for arm in chosen.arms:
        rates[arm] = {}
        for suite in chosen.suites:
            key = "false_activation" if suite in NON_THREATS else "avoided"
            seeds = chosen.worlds if suite == "r152" else min(chosen.seeds, chosen.worlds)
            rows = play(chosen.agent, arm, suite, worlds, seeds, chosen.jobs, chosen.every)
            rates[arm][suite] = rate_of(rows, key)
        print(f"| {arm} | {' | '.join(map(rate_text, rates[arm].values()))} |", flush=True)
    if chosen.to:
        draw(chosen.to, chosen.agent, rates)
    return rates


if __name__ == "__main__":
    main()
