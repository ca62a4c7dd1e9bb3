"""Pictures per second of the composed view: drawn, and written to a file."""

import gymnasium as gym
import numpy as np
import pytest

from lgmd_gym import LGMDView
from lgmd_gym.video import VideoWriter

LIVE, WRITING = 30.0, 60.0  # pictures/s to reach

pytestmark = pytest.mark.bench


@pytest.fixture
def view():
    env = LGMDView(gym.make("LGMD/CCRm-v0"))
    env.reset(seed=0)
    env.step([0.0])
    env.render()
    yield env
    env.close()


def drive(env, take):
    """Play 90 decisions into a sink."""
    env.reset(seed=0)
    for _ in range(90):
        env.step(np.zeros(1, np.float32))
        take(env.render())


def test_pictures_drawn(benchmark, view):
    benchmark.pedantic(drive, (view, lambda picture: None), rounds=5, warmup_rounds=1)
    assert 90 / benchmark.stats["median"] > LIVE


def test_pictures_written(benchmark, view, tmp_path):
    names = iter(range(100))

    def write():
        with VideoWriter(tmp_path / f"{next(names)}.mp4", 30.0) as writer:
            drive(view, writer.write)

    benchmark.pedantic(write, rounds=5, warmup_rounds=1)
    assert 90 / benchmark.stats["median"] > WRITING
