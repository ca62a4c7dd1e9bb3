"""Wrong use of the engine raises one line that states the value and a fix."""

import gymnasium as gym
import numpy as np
import pytest

import lgmd_gym  # noqa: F401

TWO_SHAPES = ["wide", {"name": "small", "shape": [40, 60]}]
CONSTRUCTION = [
    ({"num_envs": 0}, r"num_envs must be a whole number in \[1, 65536\], got 0"),
    ({"num_envs": 2.5}, r"num_envs must be a whole number in \[1, 65536\], got 2.5"),
    ({"threads": 0}, r"threads must be a whole number in \[1, 1024\], got 0"),
    ({"threads": None}, r"threads must be a whole number in \[1, 1024\], got None"),
    ({"threads": True}, r"threads must be a whole number in \[1, 1024\], got True"),
    ({"autoreset_mode": "same"}, r"unknown autoreset_mode 'same'; did you mean 'SameStep'\?"),
    ({"autoreset_mode": "same_step"}, r"unknown autoreset_mode 'same_step'; did you mean 'SameStep'\?"),
    ({"render_mode": "human"}, r"render_mode must be None or 'rgb_array' for a vector, got 'human'"),
    ({"camera": "fova"}, r"fova.*did you mean 'fovea'\?"),
    ({"ego_sped": 3.0}, r"ego_sped.*did you mean 'ego_speed'\?"),
    ({"thread": 2}, r"unknown argument of CCRs 'thread'; did you mean 'threads'\?"),
    ({"include_frames": True}, r"'include_frames'; did you mean 'include_frame'\?"),
    ({"config": {"polcy_frequency": 30}}, r"polcy_frequency.*did you mean 'policy_frequency'\?"),
    ({"camera": "birdseye", "threads": 2}, r"threads must be 1 for top views.*, got 2"),
    (
        {"camera": ["wide", {"name": "small", "shape": [40, 60]}], "include_frame": True},
        r"include_frame.*shape",
    ),
    ({"ego_speed": 50.0}, r"50 m/s = 180 km/h"),
    ({"fps": 7}, r"fps must divide simulation_frequency 60 Hz, got 7"),
]


@pytest.mark.parametrize(("arguments", "message"), CONSTRUCTION)
def test_construction(arguments, message):
    with pytest.raises(ValueError, match=message) as caught:
        gym.make_vec("LGMD/CCRs-v0", **{"num_envs": 2} | arguments)
    assert "\n" not in str(caught.value)


def test_step_before_reset():
    envs = gym.make_vec("LGMD/CCRs-v0", num_envs=2)
    with pytest.raises(RuntimeError, match=r"call reset\(\) before step\(\)"):
        envs.step(np.zeros((2, 1)))


def test_render_before_reset():
    envs = gym.make_vec("LGMD/CCRs-v0", num_envs=2, render_mode="rgb_array")
    with pytest.raises(RuntimeError, match=r"call reset\(\) before render\(\)"):
        envs.render()


RESETS = [
    ({"seed": [1, 2, 3]}, r"seed must be one number or 2 numbers, got \[1, 2, 3\]"),
    ({"seed": -1}, r"seed must be .*>= 0.*-1"),
    ({"seed": 1.5}, r"seed must be .*1\.5"),
    ({"seed": "a"}, r"seed must be .*'a'"),
    ({"options": {"mask": None}}, r"unknown option 'mask'; did you mean 'reset_mask'\?"),
    ({"options": {"reset_mask": [True, False]}}, r"must be a bool array of shape \(2,\)"),
    ({"options": {"reset_mask": np.zeros(3, bool)}}, r"must be a bool array of shape \(2,\)"),
    ({"options": {"reset_mask": np.zeros(2, bool)}}, r"must select at least one environment"),
]


@pytest.mark.parametrize(("arguments", "message"), RESETS)
def test_reset(arguments, message):
    envs = gym.make_vec("LGMD/CCRs-v0", num_envs=2)
    with pytest.raises(ValueError, match=message) as caught:
        envs.reset(**arguments)
    assert "\n" not in str(caught.value)


ACTIONS = [
    (np.zeros((3, 1)), r"actions must be 2 numbers, one per environment, got shape \(3, 1\)"),
    (np.zeros((2, 2)), r"actions must be 2 numbers, one per environment, got shape \(2, 2\)"),
    (np.zeros((1, 2)), r"actions must be 2 numbers, one per environment, got shape \(1, 2\)"),
    (0.0, r"actions must be 2 numbers, one per environment, got shape \(\)"),
    (
        np.array([[0.0], [np.nan]]),
        r"an action must be a finite number in \[-1, 1\], got nan in .* 1",
    ),
    (["brake", "hold"], r"actions must be 2 numbers, got \['brake', 'hold'\]"),
]


@pytest.mark.parametrize(("actions", "message"), ACTIONS)
def test_actions(actions, message):
    envs = gym.make_vec("LGMD/CCRs-v0", num_envs=2)
    envs.reset(seed=0)
    with pytest.raises(ValueError, match=message) as caught:
        envs.step(actions)
    assert "\n" not in str(caught.value)
    envs.step(np.zeros((2, 1)))  # the environments are still usable


@pytest.mark.parametrize("actions", [[0, 2], [-1, 0], [0.5, 0.0]])
def test_discrete_actions(actions):
    config = {"action": {"type": "DiscreteDemand", "demands": [0.0, -1.0]}}
    envs = gym.make_vec("LGMD/CCRs-v0", num_envs=2, config=config)
    envs.reset(seed=0)
    with pytest.raises(ValueError, match=r"an action must be an index in \[0, 1\], got .* in .* [01]"):
        envs.step(np.array(actions))


def test_step_of_an_ended_environment_without_autoreset():
    envs = gym.make_vec("LGMD/CCRs-v0", num_envs=2, autoreset_mode="Disabled", ego_speed=3.0, world=7)
    envs.reset(seed=0)
    ended = np.zeros(2, bool)
    while not ended.any():
        _, _, terminated, truncated, _ = envs.step(-np.ones((2, 1)))
        ended = terminated | truncated
    with pytest.raises(ValueError, match=r"environments \[0, 1\] have ended; call reset\(options="):
        envs.step(np.zeros((2, 1)))
