"""Speed table of the README: `python tests/bench/table.py`.

All figures are medians of interleaved rounds in one process, on one core unless a row states otherwise. A
busy machine slows both sides of a ratio.
"""

import platform
import statistics
import subprocess
import sys
import time
from pathlib import Path

import gymnasium as gym
import numpy as np

import lgmd_gym
from lgmd_gym import LGMD, EgoCamera

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]


def interleaved(*calls, rounds=21, repeats=50):
    """Return the median time per call of each function [s], called in turns."""
    times = [[] for _ in calls]
    for round_ in range(rounds + 1):
        for index, call in enumerate(calls):
            start = time.perf_counter()
            for _ in range(repeats):
                call()
            if round_:  # the first round compiles the kernels
                times[index].append((time.perf_counter() - start) / repeats)
    return [statistics.median(part) for part in times]


def neuron(shape, kind=LGMD):
    """Return a function that steps a neuron on a drifting texture."""
    from test_bench_neuron import scene

    frames, model, index = scene(shape), kind(shape), iter(range(10**9))
    return lambda: model.step(frames[next(index) % len(frames)])


def camera(name, vehicles):
    """Return a function that renders a road with vehicles."""
    from test_bench_camera import busy_env

    env, ego_camera = busy_env(vehicles), EgoCamera(name)
    out = ego_camera.render(env)
    return lambda: ego_camera.render(env, out)


def closed_loop(env_id, **arguments):
    """Return a function that steps an environment by one camera frame and resets it when it ends."""
    env, hold = gym.make(env_id, **arguments), np.zeros(1, np.float32)
    env.reset(seed=0)

    def step():
        *_, terminated, truncated, _ = env.step(hold)
        if terminated or truncated:
            env.reset()

    return step


def many(count):
    """Return a function that steps `count` environments in one process; two threads step the neurons."""
    from lgmd_gym.wrappers.vector import LGMDObservation

    bare = gym.make_vec("LGMD/CCRs-v0", num_envs=count, vectorization_mode="sync", camera=None)
    envs, hold = LGMDObservation(bare, threads=2), np.zeros((count, 1), np.float32)
    envs.reset(seed=0)
    return lambda: envs.step(hold)


def top_view():
    """Return a function that steps highway-env with its grey top view: two cars, 30 Hz, 160×90."""
    import highway_env  # noqa: F401

    config = {
        "observation": {
            "type": "GrayscaleObservation",
            "observation_shape": (160, 90),
            "stack_size": 1,
            "weights": [0.2989, 0.5870, 0.1140],
        },
        "action": {"type": "ContinuousAction"},
        "simulation_frequency": 30,
        "policy_frequency": 30,
        "vehicles_count": 1,
        "lanes_count": 3,
    }
    env, hold = gym.make("highway-v0", config=config), np.zeros(2, np.float32)
    env.reset(seed=0)

    def step():
        *_, terminated, truncated, _ = env.step(hold)
        if terminated or truncated:
            env.reset()

    return step


def import_seconds():
    """Return the median time that `import lgmd_gym` adds to the start of the interpreter [s]."""

    def timed(code):
        start = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], check=True)
        return time.perf_counter() - start

    return statistics.median(timed("import lgmd_gym") - timed("pass") for _ in range(7))


def rows():
    """Yield the rows: what is measured, its median, and the comparison."""
    from support.opencv_lgmd import OpenCVLGMD

    for shape in ((90, 160), (288, 352)):
        ours, theirs = interleaved(neuron(shape), neuron(shape, OpenCVLGMD))
        size = f"{shape[1]}×{shape[0]}"
        yield (
            f"LGMD step, {size}",
            f"{ours * 1e6:.0f} µs",
            f"{theirs / ours:.1f}× OpenCV + NumPy, one thread each",
        )
    for name, vehicles in (("wide", 5), ("fovea", 5), ("paper", 5)):
        (seconds,) = interleaved(camera(name, vehicles))
        height, width = EgoCamera(name).shape
        yield f"camera `{name}`, {width}×{height}, {vehicles} vehicles", f"{seconds * 1e6:.0f} µs", ""
    ours, theirs = interleaved(closed_loop("LGMD/CCRs-v0"), top_view(), repeats=60)
    what = "closed loop, 2 vehicles, 160×90, physics 60 Hz"
    yield what, f"{1 / ours:,.0f} frames/s", f"{theirs / ours:.1f}× highway-env with its grey top view"
    (seconds,) = interleaved(many(64), rounds=9, repeats=4)
    yield "64 environments in one process", f"{64 / seconds:,.0f} frames/s", "neurons batched, two threads"
    yield "`import lgmd_gym`", f"{import_seconds():.2f} s", ""


if __name__ == "__main__":
    print(f"lgmd-gym {lgmd_gym.__version__}, Python {platform.python_version()}, {platform.machine()}\n")
    print("| what | median | against |\n|---|---|---|")
    for row in rows():
        print("| " + " | ".join(row) + " |", flush=True)
