"""Pictures per second of `LGMDView`, drawn and written to a file."""

import gymnasium as gym
import numpy as np
import pytest

from lgmd_gym import LGMDView
from lgmd_gym.clips import VideoWriter

MIN_DRAWN, MIN_WRITTEN = 30.0, 60.0  # [pictures/s]

pytestmark = pytest.mark.bench


@pytest.fixture
def view():
    env = LGMDView(gym.make("LGMD/CCRm-v0", world="laboratory"))
    env.reset(seed=0)
    env.step([0.0])
    env.render()
    yield env
    env.close()


def play(env, consume):
    """Run 90 decisions and pass each picture to a function."""
    env.reset(seed=0)
    for _ in range(90):
        env.step(np.zeros(1, np.float32))
        consume(env.render())


def test_drawing_speed(benchmark, view):
    benchmark.pedantic(play, (view, lambda picture: None), rounds=5, warmup_rounds=1)
    assert 90 / benchmark.stats["median"] > MIN_DRAWN


def test_writing_speed(benchmark, view, tmp_path):
    names = iter(range(100))

    def write():
        with VideoWriter(tmp_path / f"{next(names)}.mp4", 30.0) as writer:
            play(view, writer.write)

    benchmark.pedantic(write, rounds=5, warmup_rounds=1)
    assert 90 / benchmark.stats["median"] > MIN_WRITTEN
