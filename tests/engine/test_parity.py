"""The engine equals the vector of single environments to the bit: frames, numbers, flags, infos, resets."""

from itertools import cycle

import numpy as np
import pytest
from support.brakes import draw_all_brakes
from support.vectors import assert_equal_steps, make_pair, random_demands

from lgmd_gym.camera import Camera
from lgmd_gym.envs import FAMILIES, env_id
from lgmd_gym.sensing.channel import Channel

MODES = ["NextStep", "SameStep", "Disabled"]
LEVELS = env_id("RandomBraking")
FAST = {"ego_speed": 3.0}  # a second of braking ends the episode
TWO_CAMERAS = ["wide", {"name": "fovea", "shape": [60, 100]}]
ASIDE = Camera(mount={"yaw_deg": 30.0})
FRAMES = {"include_frame": True}

ARGUMENTS = {
    "two cameras": {"camera": TWO_CAMERAS},
    "frames of two cameras": {"camera": ["wide", "fovea"], "include_frame": True},
    "frames of three decisions in two": {"config": {"policy_frequency": 20}, "trace": True},
    "three neurons": {
        "camera": [
            "wide",
            *(
                {"name": name, "camera": {"mount": {"yaw_deg": 30.0}}, "neuron": name}
                for name in ("lplc2", "dsn")
            ),
        ],
        **FRAMES,
    },
    "several frames per decision": {"config": {"policy_frequency": 10}, "trace": True},
    "fast camera": {"fps": 60, "trace": True},
    "simulation at 30 Hz": {"config": {"simulation_frequency": 30}},
    "base": {"include_base": True},
    "no camera": {"camera": None},
    "throttle": {"config": {"throttle": True, "max_acceleration": 4.0}},
    "reward": {"config": {"reward": {"contact": 3.0, "brake": 0.5}}},
    "brake": {"config": {"max_deceleration": 5.0, "dead_time": 0.3}},
    "known brake": {
        "camera": {"name": "zone", "shape": [20, 80], "gaze": {"kind": "stopping", "brake_known": True}},
        "config": {"max_deceleration": 5.0},
        "world": 6003,
        "include_frame": True,
    },
    "weather": {"weather": "night", "include_frame": True},
    "neuron": {"params": {"t_sf": 10.0}},
    "night fog": {"camera": "wide", "weather": {"light": "night", "visibility_m": 30.0}, **FRAMES},
    "automatic exposure": {
        "camera": {"name": "wide", "sensor": {"auto_exposure_s": 0.3}},
        "include_frame": True,
    },
    "columns": {
        "camera": [
            "fovea",
            Channel(camera="wide", columns=5),
            Channel(camera="tele", neuron="dsn", columns=4),
        ]
    },
}
TO_THE_CONTACT = ("base", "known brake", "reward")  # the contact is at 5 s


def random_actions(rng, num_envs):
    """Return demands over the whole range."""
    return rng.uniform(-1.0, 1.0, (num_envs, 1)).astype(np.float32)


def hold_or_brake(rng, num_envs):
    """Return demands that let the first car drive to its contact and stop the others."""
    demands = rng.choice(np.array([0.0, -1.0, -1.0, -1.0], np.float32), (num_envs, 1))
    demands[0] = 0.0
    return demands


def random_indices(rng, num_envs):
    """Return indices of discrete demands."""
    return rng.choice(3, num_envs, p=[0.2, 0.2, 0.6])


def compare(family, mode, threads, steps, draw=random_demands, num_envs=3, seed=0, **arguments):
    """Compare both for a number of steps; return the number of episodes that ended.

    Episodes end at a standstill, so that several fit in the steps.
    """
    arguments["config"] = {"follow_up": 0.0} | arguments.get("config", {})
    reference, engine = make_pair(env_id(family), num_envs, mode, threads, **arguments)
    assert engine.single_observation_space == reference.single_observation_space
    assert engine.observation_space == reference.observation_space
    assert engine.single_action_space == reference.single_action_space
    assert engine.action_space == reference.action_space
    episodes = assert_equal_steps(reference, engine, steps, np.random.default_rng(seed), draw, seed)
    reference.close()
    engine.close()
    return episodes


@pytest.mark.parametrize(
    ("mode", "threads"),
    [("NextStep", 2), ("SameStep", 1), ("Disabled", 2)],
)
def test_random_levels(mode, threads):
    assert compare("RandomBraking", mode, threads, 260, include_frame=True, trace=True) >= 3


@pytest.mark.parametrize("case", ARGUMENTS)
def test_arguments(case):
    arguments = ARGUMENTS[case]
    rate = arguments.get("config", {}).get("policy_frequency", 30)
    steps = int((5.3 if case in TO_THE_CONTACT else 2.7) * rate)
    assert compare("CCRs", "SameStep", 2, steps, hold_or_brake, **arguments, **FAST) >= 2


@pytest.mark.parametrize("rate", [10, 30])
def test_drawn_brakes(monkeypatch, rate):
    draw_all_brakes(monkeypatch)
    config = {"policy_frequency": rate, "build_up": 0.3}
    assert compare("CCRs", "SameStep", 2, 8 * rate, hold_or_brake, 4, config=config, **FAST) >= 6


def test_drawn_brakes_of_random_levels(monkeypatch):
    draw_all_brakes(monkeypatch)
    assert compare("RandomBraking", "NextStep", 1, 260, camera=None) >= 3


def test_discrete_actions():
    action = {"type": "DiscreteDemand", "demands": [0.0, -0.5, -1.0]}
    assert compare("CCRs", "SameStep", 1, 100, random_indices, config={"action": action}, **FAST) >= 3


@pytest.mark.parametrize("family", ["CCCscp", "CurveGuardRail", "CutIn"])
def test_families(family):
    compare(family, "SameStep", 2, 60, include_frame=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("family", "mode", "threads", "draw"),
    list(zip(FAMILIES, cycle(MODES), cycle((1, 2)), cycle((random_demands, random_actions)))),
)
def test_every_family(family, mode, threads, draw):
    """`test_random_levels` draws families in every mode."""
    compare(family, mode, threads, 300, draw, num_envs=2, include_frame=True, trace=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mode", "threads", "draw"),
    [("NextStep", 1, random_demands), ("SameStep", 2, random_actions), ("Disabled", 4, random_demands)],
)
def test_many_random_levels(mode, threads, draw):
    assert compare("RandomBraking", mode, threads, 350, draw, 20, 1000 * threads, include_frame=True) >= 10
