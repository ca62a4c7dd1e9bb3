"""Memory of the engine: `pytest -m slow tests/engine/test_memory.py`."""

import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

PEAK = """
import sys
import gymnasium as gym, numpy as np, lgmd_gym
sys.path.insert(0, sys.argv[1])
from support.processes import peak_memory
num_envs, camera = int(sys.argv[2]), {"name": "fovea", "shape": [int(sys.argv[3]), 2 * int(sys.argv[3])]}
envs = gym.make_vec(
    "LGMD/RandomBraking-v0", num_envs=num_envs, threads=2, camera=camera, autoreset_mode="SameStep"
)
envs.reset(seed=0)
rng = np.random.default_rng(0)
for steps in map(int, sys.argv[4:]):
    for _ in range(steps // num_envs):
        envs.step(rng.choice([0.0, 0.0, 0.0, -1.0], (num_envs, 1)))
    print(peak_memory())
"""
TESTS = Path(__file__).parents[1]


def peaks(*arguments):
    """Return the peak memory of a fresh process after each number of steps [MiB]."""
    command = [sys.executable, "-c", PEAK, str(TESTS), *map(str, arguments)]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    return [float(line) for line in result.stdout.split()]


@pytest.fixture(scope="module", autouse=True)
def compiled_kernels():
    """Compile the kernels in a process of its own: the compiler takes up to 0.8 GB."""
    peaks(1, 90, 1)


@pytest.mark.parametrize(("num_envs", "limit_mib"), [(64, 1024), (1024, 4096)])
def test_peak(num_envs, limit_mib):
    (peak,) = peaks(num_envs, 90, 8 * num_envs)
    print(f"\n{num_envs} environments: {peak:.0f} MiB")
    assert peak < limit_mib


def test_no_growth():
    """Memory does not keep growing over 160,000 steps of environments with small frames and two threads.

    A leak grows in every part of the run. A new peak in some of them is none: two large roads, for example,
    may be built at the same time.
    """
    values = peaks(16, 20, *[40_000] * 4)
    print(f"\n{values} MiB after 40,000, 80,000, 120,000 and 160,000 steps")
    assert min(after - before for before, after in pairwise(values)) < 2
