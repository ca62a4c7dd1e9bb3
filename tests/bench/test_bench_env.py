"""Speed and memory of the closed loop: `pytest -m bench tests/bench/test_bench_env.py`."""

import gymnasium as gym
import numpy as np
import pytest
from table import closed_loop, interleaved, many, top_view

import lgmd_gym  # noqa: F401

pytestmark = pytest.mark.bench


def test_env_step(benchmark):
    step = closed_loop("LGMD/CCRs-v0")
    benchmark(step)
    assert benchmark.stats.stats.median < 500e-6  # 2,000 camera frames a second


def test_faster_than_the_top_view_of_highway_env():
    ours, theirs = interleaved(closed_loop("LGMD/CCRs-v0"), top_view(), rounds=15, repeats=100)
    print(f"\nclosed loop {ours * 1e6:.0f} us, highway-env's top view {theirs * 1e6:.0f} us")
    assert ours < theirs


def test_sixty_four_environments_in_one_process():
    seconds = interleaved(many(64), rounds=9, repeats=4)[0] / 64
    print(f"\n64 environments: {1 / seconds:.0f} camera frames/s")
    assert 1 / seconds > 3000


def test_memory_does_not_grow():
    """Run 100,000 steps with resets in one environment."""
    import resource

    env = gym.make("LGMD/CCRs-v0", ego_speed=15.0)
    hold, seed = np.zeros(1, np.float32), 0
    peaks = []
    for _ in range(4):
        for _ in range(25_000 // 150):
            env.reset(seed=seed)
            seed += 1
            done = False
            while not done:
                *_, done, _, _ = env.step(hold)
        peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    print(f"\npeak memory {peaks[-1]:.0f} MiB after 100,000 steps, {peaks[0]:.0f} after 25,000")
    assert peaks[-1] - peaks[0] < 5
