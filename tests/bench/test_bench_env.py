"""Speed and memory of the closed loop: `pytest -m bench tests/bench/test_bench_env.py`."""

import gymnasium as gym
import numpy as np
import pytest
from table import closed_loop, engine_rates, interleaved, shares, top_view

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


def test_engine_against_the_top_view_of_highway_env():
    peer, rates = engine_rates()
    ratios = {kind: rate / peer for kind, rate in rates.items()}
    print("".join(f"\n{kind}: {rates[kind]:.0f} frames/s, {ratio:.1f}x" for kind, ratio in ratios.items()))
    assert ratios[64, 1] > 6
    assert ratios[64, 2] > 12


def test_overhead_of_the_engine():
    camera, neuron, physics, rest = shares()
    print(f"\ncamera {camera:.1%}, neuron {neuron:.1%}, physics {physics:.1%}, rest {rest:.1%}")
    assert camera + neuron > 0.9


def test_memory_does_not_grow():
    """Run 100,000 steps with resets in one environment."""
    import resource

    env = gym.make("LGMD/CCRs-v0", ego_speed=15.0, world="laboratory")
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
