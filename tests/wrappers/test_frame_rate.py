"""Camera frame rate of `LGMDObservation` against simulation and decision rates."""

import gymnasium as gym
import highway_env  # noqa: F401  (registers the stock environments)
import numpy as np
import pytest
from support.rollouts import HOLD, rollout

from lgmd_gym import LGMDObservation


@pytest.mark.parametrize(
    ("policy_frequency", "counts"), [(30, [1, 1, 1]), (60, [0, 1, 0]), (15, [2, 2, 2]), (20, [1, 2, 1])]
)
def test_camera_rate_does_not_depend_on_the_decision_rate(policy_frequency, counts):
    env = gym.make("LGMD/CCRs-v0", config={"policy_frequency": policy_frequency}, trace=True)
    traces = [info["lgmd/trace"] for *_, info in rollout(env, HOLD, 6)]
    assert [len(trace) for trace in traces[:4]] == [1, *counts]
    times = [frame.time for trace in traces for frame in trace]
    np.testing.assert_allclose(np.diff(times), 1 / 30)


def test_decision_without_a_frame_keeps_the_last_values():
    env = gym.make("LGMD/CCRs-v0", config={"policy_frequency": 60}, ego_speed=20.0)
    results = rollout(env, HOLD, 260)
    changed = np.diff([float(observation["ffi"][0]) for observation, *_ in results]) != 0
    assert not changed[::2].any()  # a frame in every second decision
    assert changed[1::2].mean() > 0.9


def test_stock_default_rate_is_used_with_a_warning():
    with pytest.warns(UserWarning, match="simulation_frequency 15 Hz, not 30 Hz"):
        env = LGMDObservation(gym.make("highway-v0"))
    assert env.fps == 15.0
    env.reset(seed=0)
    observation, *_ = env.step(1)
    assert env.observation_space.contains(observation)


def test_too_low_simulation_frequency_raises():
    with pytest.raises(ValueError, match=r">= 15 Hz for a camera, got 5; use .*'simulation_frequency': 30"):
        LGMDObservation(gym.make("highway-fast-v0"))


@pytest.mark.parametrize(
    ("fps", "message"),
    [
        (25, r"fps must divide simulation_frequency 60 Hz, got 25; .*'simulation_frequency': 50"),
        (0, "fps must be > 0, got 0"),
    ],
)
def test_invalid_fps_raises(fps, message):
    with pytest.raises(ValueError, match=message):
        gym.make("LGMD/CCRs-v0", fps=fps)


def test_reset_may_change_the_simulation_frequency():
    config = {"vehicles_count": 3, "simulation_frequency": 30}
    env = LGMDObservation(gym.make("highway-v0", config=config), camera="wide", trace=True)
    assert env.fps == 30.0
    env.reset(seed=0, options={"config": {"simulation_frequency": 60}})
    *_, info = env.step(1)
    assert len(info["lgmd/trace"]) == 30
    assert env.fps == 30.0


def test_a_reset_refuses_a_frequency_that_the_camera_rate_does_not_divide():
    env = gym.make("LGMD/CCRs-v0", fps=30)
    env.reset(seed=0)
    config = {"simulation_frequency": 40, "policy_frequency": 20}
    with pytest.raises(ValueError, match="fps must divide simulation_frequency 40 Hz, got 30"):
        env.reset(seed=0, options={"config": config})
    assert env.unwrapped.config["simulation_frequency"] == 60
