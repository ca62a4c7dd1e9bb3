"""Speed table of the README: `python tests/bench/table.py [docs/vector.png]`.

All figures are medians of interleaved rounds in one process, on one core unless a row states otherwise. A
busy machine slows both sides of a ratio. With a file name, the rates of the engine are also plotted.
"""

import argparse
import os
import platform
import statistics
import subprocess
import sys
import time
from pathlib import Path

import gymnasium as gym
import numpy as np
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv

import lgmd_gym
from lgmd_gym import LGMD, EgoCamera

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

SIZES, THREADS = (1, 16, 64), (1, 2)
KINDS = {
    "worlds": ("LGMD/CCRs-v0", {}),
    "random levels": ("LGMD/RandomBraking-v0", {}),
    "laboratory": ("LGMD/CCRs-v0", {"world": "laboratory"}),
}  # environments of the engine: every world and episode its own, the same with random scenarios, one place
COMMON_SIZE = 64  # environments of every kind; the others are measured in worlds only
ROUND = 256  # frames per round and vector environment
EPISODE = 200  # frames of an episode: a round of the engine contains the start of one in each environment
PEER_ENVS = 16  # environments of highway-env in a vector
AGENTS, WORLD = ("stopping-zone", "policy:all-round"), 8_000


def interleaved(*calls, rounds=21, repeats=50):
    """Return the median time per call of each function [s], called in turns.

    Args:
        *calls: Functions without arguments.
        rounds: Number of rounds.
        repeats: Calls of each function per round; one number, or one per function.
    """
    repeats = [repeats] * len(calls) if isinstance(repeats, int) else repeats
    times = [[] for _ in calls]
    for round_ in range(rounds + 1):
        for index, (call, count) in enumerate(zip(calls, repeats, strict=True)):
            start = time.perf_counter()
            for _ in range(count):
                call()
            if round_:  # the first round compiles the kernels
                times[index].append((time.perf_counter() - start) / count)
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


def agent_loop(name):
    """Return a function that steps an environment with an agent's sensors and runs the agent.

    The demand of the agent is not applied, so that all agents approach the same car.
    """
    from lgmd_gym.agents import make_agent

    agent, hold = make_agent(name), np.zeros(1, np.float32)
    params = getattr(agent, "neuron", None)
    env = gym.make("LGMD/CCRs-v0", camera=agent.camera, params=params, world=WORLD)
    env.reset(seed=0)
    agent.reset(0)

    def step():
        observation, _, terminated, truncated, info = env.step(hold)
        agent.act(observation, info)
        if terminated or truncated:
            env.reset()
            agent.reset(0)

    return step


def engine(kind, count, threads=1):
    """Return a function that steps `count` environments of the engine by one camera frame; see `KINDS`."""
    env_id, arguments = KINDS[kind]
    envs = gym.make_vec(env_id, num_envs=count, threads=threads, **arguments)
    envs.reset(seed=0)
    return lambda: envs.step(np.zeros((count, 1)))


def make_top_view():
    """Return highway-env with its grey top view: two cars, 30 Hz, 160×90."""
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
    return gym.make("highway-v0", config=config)


def top_view():
    """Return a function that steps highway-env with its grey top view."""
    env, hold = make_top_view(), np.zeros(2, np.float32)
    env.reset(seed=0)

    def step():
        *_, terminated, truncated, _ = env.step(hold)
        if terminated or truncated:
            env.reset()

    return step


def top_views(kind):
    """Return a function that steps a vector of highway-env's top views, and one that closes it."""
    envs = kind([make_top_view] * PEER_ENVS)
    envs.reset(seed=0)
    return lambda: envs.step(np.zeros((PEER_ENVS, 2), np.float32)), envs.close


def engine_rates():
    """Return the frames/s of a top view, and of the engine by kind, number of environments and threads."""
    sizes = {kind: SIZES if kind == "worlds" else (COMMON_SIZE,) for kind in KINDS}
    cases = [(kind, count, threads) for kind in KINDS for count in sizes[kind] for threads in THREADS]
    calls = [engine(*case) for case in cases]
    peer, *seconds = interleaved(top_view(), *calls, rounds=5, repeats=[60, *[EPISODE] * len(cases)])
    return 1 / peer, {case: case[1] / value for case, value in zip(cases, seconds, strict=True)}


def peer_rates():
    """Return the frames/s of one top view, of several in a `SyncVectorEnv`, and in an `AsyncVectorEnv`."""
    vectors = [top_views(kind) for kind in (SyncVectorEnv, AsyncVectorEnv)]
    one, *several = interleaved(top_view(), *(step for step, _ in vectors), rounds=9, repeats=[60, 4, 4])
    for _, close in vectors:
        close()
    return [1 / one, *(PEER_ENVS / seconds for seconds in several)]


def envpool_rate():
    """Return the decisions/s of EnvPool's highway, or None if the variable ENVPOOL_PYTHON is not set."""
    interpreter = os.environ.get("ENVPOOL_PYTHON")
    if interpreter is None:
        return None
    command = [interpreter, str(HERE / "envpool_highway.py")]
    return float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def shares(kind, count=64):
    """Return the shares of camera, neuron, physics and the rest in a step of the engine on one thread."""
    from lgmd_gym.camera.batch import CameraBatch
    from lgmd_gym.envs.simulation import Simulation

    parts = {(CameraBatch, "draw"): 0.0, (LGMD, "step_range"): 0.0, (Simulation, "step"): 0.0}
    step, originals = engine(kind, count), {key: getattr(*key) for key in parts}

    def timed(key):
        def call(*arguments):
            start = time.process_time()
            originals[key](*arguments)
            parts[key] += time.process_time() - start

        return call

    for key in parts:
        setattr(*key, timed(key))
    try:
        step()
        parts.update(dict.fromkeys(parts, 0.0))
        start = time.process_time()
        for _ in range(max(1, 10 * ROUND // count)):
            step()
        total = time.process_time() - start
    finally:
        for key, original in originals.items():
            setattr(*key, original)
    camera_s, neuron_s, simulation_s = parts.values()
    seconds = camera_s, neuron_s, simulation_s - camera_s - neuron_s, total - simulation_s
    return [value / total for value in seconds]


def numbered(count, noun):
    """Return a count with its noun."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def plot(peer, rates, path):
    """Plot the rates of the engine over the number of environments."""
    from matplotlib.figure import Figure

    from lgmd_gym.plotting.style import COLOURS

    figure = Figure(figsize=(7.0, 3.2), layout="constrained")
    axis = figure.subplots()
    for threads, colour in zip(THREADS, COLOURS[1:], strict=False):
        label = f"engine in worlds, {numbered(threads, 'thread')}"
        axis.plot(
            SIZES, [rates["worlds", count, threads] for count in SIZES], "o-", color=colour, label=label
        )
    axis.axhline(peer, color=COLOURS[0], linestyle="--", label="highway-env, grey top view, one environment")
    axis.set_xscale("log", base=2)
    axis.set_xticks(SIZES, [str(count) for count in SIZES])
    axis.set(xlabel="environments", ylabel="frames per second")
    most = max(rate for (kind, *_), rate in rates.items() if kind == "worlds")
    axis.set_ylim(0.0, 1.4 * most)  # leaves space for the legend
    axis.grid(alpha=0.3)
    axis.legend(frameon=False, loc="upper left")
    figure.savefig(path, dpi=110)


def import_seconds():
    """Return the median time that `import lgmd_gym` adds to the start of the interpreter [s]."""

    def timed(code):
        start = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], check=True)
        return time.perf_counter() - start

    return statistics.median(timed("import lgmd_gym") - timed("pass") for _ in range(7))


def engine_rows(path):
    """Yield the rows of the engine and of highway-env's vectors; plot the rates if there is a path."""
    peer, rates = engine_rates()
    if path is not None:
        plot(peer, rates, path)
    for (kind, count, threads), rate in rates.items():
        what = f"engine, {kind}, {numbered(count, 'environment')}, {numbered(threads, 'thread')}"
        yield what, f"{rate:,.0f} frames/s", f"{rate / peer:.1f}× highway-env with its grey top view"
    names = "camera", "neuron", "physics", "rest"
    for kind in KINDS:
        parts = [f"{name} {share:.0%}" for name, share in zip(names, shares(kind), strict=True)]
        yield f"engine, {kind}, 64 environments, 1 thread: shares", ", ".join(parts), ""
    one, *several = peer_rates()
    for kind, rate in zip(("SyncVectorEnv", "AsyncVectorEnv"), several, strict=True):
        what = f"highway-env with its grey top view, {PEER_ENVS} environments, `{kind}`"
        yield what, f"{rate:,.0f} frames/s", f"{rate / one:.1f}× one environment"
    if (rate := envpool_rate()) is not None:
        what = "EnvPool's highway-v0, 2 vehicles, no frames, 64 environments, 2 threads"
        yield what, f"{rate:,.0f} decisions/s", f"{rate / rates['worlds', 64, 2]:.1f}× the engine with frames"


def rows(path=None):
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
    places = {f"world {WORLD}": WORLD, "laboratory": "laboratory"}
    loops = [closed_loop("LGMD/CCRs-v0", world=world) for world in places.values()]
    theirs, *ours = interleaved(top_view(), *loops, repeats=60)
    for place, seconds in zip(places, ours, strict=True):
        what = f"closed loop, {place}, 2 vehicles, 160×90, physics 60 Hz"
        yield (
            what,
            f"{1 / seconds:,.0f} frames/s",
            f"{theirs / seconds:.1f}× highway-env with its grey top view",
        )
    # The cost of the smallest camera and its neuron is subtracted with that of the simulation.
    bare = closed_loop("LGMD/CCRs-v0", camera={"name": "wide", "shape": [8, 8]}, world=WORLD)
    least, *seconds = interleaved(bare, *map(agent_loop, AGENTS), repeats=100)
    for name, value in zip(AGENTS, seconds, strict=True):
        yield f"sensor and agent `{name}`, per frame, in a world", f"{(value - least) * 1e6:.0f} µs", ""
    yield from engine_rows(path)
    yield "`import lgmd_gym`", f"{import_seconds():.2f} s", ""


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("picture", nargs="?", type=Path, help="PNG file of the rates to write")
    options = parser.parse_args()
    print(f"lgmd-gym {lgmd_gym.__version__}, Python {platform.python_version()}, {platform.machine()}\n")
    print("| what | median | against |\n|---|---|---|")
    for row in rows(options.picture):
        print("| " + " | ".join(row) + " |", flush=True)
    loads = ", ".join(f"{load:.1f}" for load in os.getloadavg())
    print(f"\n{os.cpu_count()} cores; load average of the last 1, 5 and 15 minutes: {loads}")
