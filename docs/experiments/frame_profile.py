"""Where the time of a camera frame goes, by stage and by effect, in the laboratory and in worlds.

    python docs/experiments/frame_profile.py [AGENT …] [--worlds 20] [--frames 60] [--engine 64]

Prints a table per camera: microseconds per environment and frame, medians over the worlds, on one thread of
an idle machine. The stages of drawing are read from the counter of the processor inside the kernels, which
are compiled for this purpose into a cache of their own (about a minute). "Neurons" includes the columns,
"observation" observations and infos, and "rest" physics and Python. Reading the counter adds up to a tenth to
stages with many short parts.
"""

import argparse
import os
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

os.environ["LGMD_GYM_PROFILE"] = "1"
os.environ.setdefault("NUMBA_CACHE_DIR", str(Path(tempfile.gettempdir()) / f"lgmd-gym-profile-{os.getuid()}"))

import gymnasium as gym
import numpy as np

from lgmd_gym.agents import make_agent
from lgmd_gym.camera.render.buffers import STAGES
from lgmd_gym.kernels.clock import PROFILING, ticks
from lgmd_gym.sensing.assembly import Assembly
from lgmd_gym.sensing.neurons import NeuronGroup

ARMS: dict[str, dict[str, object]] = {
    "laboratory": {"world": "laboratory"},
    "worlds, clear": {"weather": "clear"},
    "worlds, clear, still road": {"weather": "clear", "road": "still"},
    "worlds, night": {"weather": "night"},
    "worlds, fog": {"weather": "fog"},
    "worlds, rain": {"weather": "rain"},
    "worlds, low sun": {"weather": "low_sun"},
}
"""Arguments of the environment by row of the table."""
METHODS = (
    ("neurons", NeuronGroup, "step"),
    ("observation", Assembly, "observations"),
    ("observation", Assembly, "infos"),
)
"""Methods by the part of a frame that their time counts for."""
COLUMNS = (*STAGES, "neurons", "observation", "rest", "sum")


def ticks_per_s() -> float:
    """Return the rate of the processor's counter."""
    start, before = time.perf_counter(), ticks()
    time.sleep(0.2)
    return (ticks() - before) / (time.perf_counter() - start)


@contextmanager
def timed(seconds: dict[str, float]) -> Iterator[None]:
    """Add the time of neurons and observation to `seconds`."""
    originals = [getattr(kind, method) for _, kind, method in METHODS]

    def wrap(name: str, original: Callable[..., object]) -> Callable[..., object]:
        def call(*arguments: object) -> object:
            start = time.perf_counter()
            result = original(*arguments)
            seconds[name] += time.perf_counter() - start
            return result

        return call

    for (name, kind, method), original in zip(METHODS, originals, strict=True):
        setattr(kind, method, wrap(name, original))
    try:
        yield
    finally:
        for (_, kind, method), original in zip(METHODS, originals, strict=True):
            setattr(kind, method, original)


def clocks_of(sensors: object) -> list[np.ndarray]:
    """Return the clocks of the workspaces of an array of sensors."""
    groups = sensors._drawing.groups
    return [workspace.buffers.clock for group in groups for workspace in group._workspaces]


def measure(env: gym.Env | gym.vector.VectorEnv, sensors: object, frames: int, count: int) -> np.ndarray:
    """Return the microseconds of `COLUMNS` per environment and frame; the environment has been reset."""
    hold = np.zeros((count, 1), np.float32) if count > 1 else np.zeros(1, np.float32)
    env.step(hold)
    for clock in clocks_of(sensors):
        clock[:] = 0
    seconds = {"neurons": 0.0, "observation": 0.0}
    rate = ticks_per_s()
    with timed(seconds):
        start = time.perf_counter()
        for _ in range(frames):
            *_, terminated, truncated, _ = env.step(hold)
            if count == 1 and (terminated or truncated):
                env.reset()
        total = time.perf_counter() - start
    stages = np.sum(clocks_of(sensors), axis=0)[1:] / rate
    rest = total - stages.sum() - seconds["neurons"] - seconds["observation"]
    values = (*stages, seconds["neurons"], seconds["observation"], rest, total)
    return 1e6 * np.array(values) / (frames * count)


def sensors_of(env: gym.Env) -> object:
    """Return the array of sensors of a single environment."""
    while not hasattr(env, "sensors"):
        env = env.env
    return env.sensors


def single(camera: object, arm: dict[str, object], world: int, frames: int) -> np.ndarray:
    """Return the times of a single environment in a world."""
    env = gym.make("LGMD/CCRs-v0", ego_speed=8.3, camera=camera, **({"world": world} | arm))
    env.reset(seed=world)
    try:
        return measure(env, sensors_of(env), frames, 1)
    finally:
        env.close()


def engine(camera: object, arm: dict[str, object], count: int, frames: int) -> np.ndarray:
    """Return the times of `count` environments of the engine, each in a world of its own."""
    envs = gym.make_vec("LGMD/CCRs-v0", ego_speed=8.3, num_envs=count, camera=camera, **arm)
    envs.reset(seed=0)
    try:
        return measure(envs, envs.unwrapped.batch.sensors, frames, count)
    finally:
        envs.close()


def table(rows: dict[str, np.ndarray]) -> str:
    """Return a Markdown table of microseconds."""
    lines = ["| µs per frame | " + " | ".join(COLUMNS) + " |", "|---" + "|---:" * len(COLUMNS) + "|"]
    lines += [
        f"| {name} | " + " | ".join(f"{value:.1f}" for value in row) + " |" for name, row in rows.items()
    ]
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> dict[str, dict[str, np.ndarray]]:
    """Print the tables, and return their rows by camera."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("agents", nargs="*", default=["fovea"], metavar="AGENT")
    parser.add_argument("--worlds", type=int, default=20)
    parser.add_argument("--first", type=int, default=6_100)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument(
        "--engine", type=int, default=64, help="environments of the engine; 0 to leave it out"
    )
    options = parser.parse_args(arguments)
    if not PROFILING:
        raise SystemExit("frame_profile must be imported before lgmd_gym, or run with LGMD_GYM_PROFILE=1")
    worlds, results = range(options.first, options.first + options.worlds), {}
    for name in options.agents:
        camera = "fovea" if name == "fovea" else make_agent(name).camera
        rows: dict[str, np.ndarray] = {}
        for arm, values in ARMS.items():
            seen = worlds[:1] if "world" in values else worlds
            each = [single(camera, values, world, options.frames) for world in seen]
            rows[arm] = np.array([statistics.median(column) for column in np.transpose(each)])
        if options.engine:
            for arm in ("laboratory", "worlds, clear"):
                rows[f"engine, {arm}"] = engine(camera, ARMS[arm], options.engine, options.frames)
        results[name] = rows
        print(f"{name}, medians over worlds {worlds[0]} to {worlds[-1]}\n\n{table(rows)}\n", flush=True)
    return results


if __name__ == "__main__":
    main()
