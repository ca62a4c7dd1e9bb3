"""The decision in which an episode ends by contact, and contacts that begin and end within a step, by hand.

The ego is 4.3 m by 1.8 m and drives at 10 m/s; the target car is 4.023 m by 1.712 m.
"""

from math import inf, pi

import numpy as np
import pytest
from numba import config
from support.records import bodies

from lgmd_gym.envs import BrakingEnv
from lgmd_gym.envs.dynamics.contact import PathMotion, Rectangle, gap_on_path, time_on_paths
from lgmd_gym.envs.dynamics.path import path_table
from lgmd_gym.envs.dynamics.script import Bend, Pose
from lgmd_gym.envs.families.scenario import Actor, Scenario
from lgmd_gym.envs.surrogate_safety import contact_time

compiled_only = pytest.mark.skipif(config.DISABLE_JIT, reason="an environment needs compilation")


def decisions_to_contact(scenario, policy_hz, simulation_hz=60):
    """Return the number of decisions up to the contact, and the last two infos; None without contact."""
    env = BrakingEnv(scenario, {"policy_frequency": policy_hz, "simulation_frequency": simulation_hz})
    _, info = env.reset(seed=0)
    for decision in range(1, 1000):
        before = info
        *_, terminated, truncated, info = env.step(np.zeros(1, np.float32))
        if terminated or truncated:
            return (decision, before, info) if info["collision"] else None
    return None


@compiled_only
@pytest.mark.parametrize("policy_hz", [10, 15, 30, 60])
@pytest.mark.parametrize("time", [1.001, 1.049, 1.051, 1.099, 1.332, 1.334])
def test_contact_ends_the_episode_in_its_decision(policy_hz, time):
    """A standing car after `time` [s]; the decisions before it have no contact."""
    scenario = Scenario(family="Own", ego_speed=10.0, duration=5.0, actors=(Actor(gap=10.0 * time),))
    decision, before, info = decisions_to_contact(scenario, policy_hz)
    assert decision == int(np.ceil(time * policy_hz))
    assert (before["collision"], info["collision"]) == (False, True)
    assert (info["impact_speed"], info["relative_impact_speed"]) == pytest.approx((10.0, 10.0))
    assert before["ttc"] == pytest.approx(time - (decision - 1) / policy_hz, abs=1e-6)


@compiled_only
@pytest.mark.parametrize("moment", [0.1, 0.5, 0.9])
@pytest.mark.parametrize(("overlap", "touched"), [(0.02, True), (-0.02, False)])
def test_contact_that_begins_and_ends_within_a_step(moment, overlap, touched):
    """A box of 0.2 m crosses from the right at 30 m/s just before the ego: only two corners may meet.

    The step of 1/15 s from 1 s on moves the box by 2 m. `moment` is the part of it after which the box's rear
    leaves the ego's left side, with the ego's front `overlap` beyond the box's near side: 2 ms of contact.
    """
    leaving = 1.0 + moment / 15
    right = 30.0 * leaving - 0.9 - 0.1  # of the box's centre at the start, from the ego's centreline
    size = {"length": 0.2, "width": 0.2, "height": 1.0}
    box = Actor(
        gap=10.0 * leaving - overlap, lateral_offset=-right, heading=pi / 2, speed=30.0, kind="box", **size
    )
    scenario = Scenario(family="Own", ego_speed=10.0, duration=3.0, actors=(box,))
    found = decisions_to_contact(scenario, 15, 15)
    assert (found[0] if found else None) == (16 if touched else None)


@pytest.mark.parametrize("place", [0.31, 0.5, 0.77])
def test_prediction_of_a_contact_within_a_step(place):
    """On a path, a car meets a crossing post only between two samples that are 0.5 s and 5 m apart."""
    table = path_table(Pose(0.0, 0.0, 0.0))
    one = PathMotion(table, 0.0, 10.0, 4.0, 2.0)
    time = 2.0 + place * 0.5
    # The post crosses at 20 m/s; its sides leave the car's way after 0.105 s, as the front is 0.1 m beyond.
    y = -20.0 * time - 1.0 + 0.05
    post = PathMotion(path_table(Pose(10.0 * time + 2.0, y, pi / 2)), 0.0, 20.0, 0.1, 0.1)
    assert time_on_paths(one, post, 10.0, 0.5) == pytest.approx(time, abs=0.01)
    assert time_on_paths(one, post, 10.0, 0.1) == pytest.approx(time, abs=0.01)
    assert gap_on_path(one, Rectangle(20.0 + place, 0.0, 0.0, 0.1, 0.1), 300.0, 5.0) == pytest.approx(
        17.95 + place
    )


def test_predicted_contact_of_bodies_on_paths():
    """A path of one straight bend predicts what a straight path does."""
    cars = {"x": 0.0, "speed": 10.0}, {"x": 44.023, "speed": 2.0, "kind": 1}
    table, paths = bodies(*cars)
    length = (table[0].length + table[1].length) / 2
    assert contact_time(table, 2, paths) == pytest.approx((44.023 - length) / 8)
    bent = path_table(Pose(0.0, 0.0, 0.0), (Bend(500.0, 0.0),))
    motion = PathMotion(bent, 0.0, 10.0, table[0].length, table[0].width)
    other = PathMotion(bent, 44.023, 2.0, table[1].length, table[1].width)
    assert time_on_paths(motion, other, 10.0, 0.1) == pytest.approx((44.023 - length) / 8)
    far = PathMotion(bent, 44.023 + 81.0, 2.0, table[1].length, table[1].width)
    assert time_on_paths(motion, far, 10.0, 0.1) == inf
