"""The decision in which an episode ends by contact, and contacts that begin and end within a step, by hand.

The ego is 4.3 m by 1.8 m and drives at 10 m/s; the target car is 4.023 m by 1.712 m.
"""

from math import inf, pi

import numpy as np
import pytest
from numba import config
from support.records import bodies, record, records

from lgmd_gym.envs import BrakingEnv
from lgmd_gym.envs.dynamics.bodies import STEP_START
from lgmd_gym.envs.dynamics.contact import PathMotion, Rectangle, gap_on_path, time_on_paths, touched_side
from lgmd_gym.envs.dynamics.episode import (
    EPISODE,
    StepMotion,
    first_contact_of,
    is_terminated,
    is_truncated,
    touch_between,
    touch_time,
)
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


def braking_ego(time, aside=0.0, length=4.0):
    """Return bodies after a step of 0.5 s, and the step, of an ego that brakes from 10 m/s with 4 m/s².

    A standing car of 4 m by 2 m is touched after `time` [s], at 10·t - 2·t² of the way.
    """
    ahead = 10 * time - 2 * time**2 + (4.0 + length) / 2
    ego = {"x": 4.5, "travelled": 4.5, "speed": 8.0, "length": length}
    table, paths = bodies(ego, {"x": ahead, "y": aside})
    paths[0] = 0.0  # the ego's path begins where the step does
    before = records(STEP_START, {"speed": 10.0}, {"x": ahead, "y": aside}, {})
    return table, StepMotion(before, np.array([(inf, -4.0)]), inf, np.zeros((0, 4)), paths, 0.5)


@pytest.mark.parametrize("time", [0.01, 0.1, 0.25, 0.26, 0.333, 0.49])
def test_contact_while_braking_has_the_time_of_the_parabola(time):
    table, step = braking_ego(time)
    assert touch_time(table, 1, step) == pytest.approx(time / 0.5, abs=2e-4)
    assert first_contact_of(table, 2, step) == (pytest.approx(time / 0.5, abs=2e-4), 1)
    table, step = braking_ego(time, aside=2.0)  # side by side
    assert touch_time(table, 1, step) == inf
    assert first_contact_of(table, 2, step) == (inf, 0)


def test_no_contact_beyond_the_distance_of_the_step():
    for time in (0.501, 0.6):
        table, step = braking_ego(time)
        assert touch_time(table, 1, step) == inf


def test_a_body_that_turns_has_its_mean_heading_in_a_part_of_a_step():
    """A box of 4 m by 2 m turns by 180° on 10 m: a wall 9 m ahead is 1 m, half its width, from its middle."""
    wall = Rectangle(9.5, 0.0, 0.0, 1.0, 8.0)
    turning = Rectangle(0.0, 0.0, 0.0, 4.0, 2.0), Rectangle(10.0, 0.0, pi, 4.0, 2.0)
    assert touch_between(*turning, wall, wall) == pytest.approx(0.8)
    moved = wall._replace(x=7.5)  # the wall comes 2 m nearer
    assert touch_between(*turning, wall, moved) == pytest.approx(8 / 12)


def test_ends_of_an_episode_by_contact_and_by_its_duration():
    table, _ = bodies({"speed": 10.0}, {"x": 50.0})
    for touched in (0, 1):
        episode = record(EPISODE, bodies=2, touched=touched, duration=5.0)
        assert is_terminated(table, episode, False, 0.1, 2.0) == bool(touched)
    for time, ended in ((4.9, False), (5.0 - 1e-8, False), (5.0, True), (5.1, True)):
        assert is_truncated(record(EPISODE, duration=5.0, time=time)) == ended


@pytest.mark.parametrize(("decisions", "ended"), [(19, False), (20, True)])
def test_a_standstill_ends_the_episode_after_the_follow_up(decisions, ended):
    """2 s at 10 Hz, from the first decision at rest on; a car that approaches begins it anew."""
    table, _ = bodies({"speed": 0.0, "script_speed": 10.0}, {"x": 50.0})
    episode = record(EPISODE, bodies=2, duration=60.0)
    assert not is_terminated(table, episode, True, 0.1, 2.0)
    found = [is_terminated(table, episode, False, 0.1, 2.0) for _ in range(decisions)]
    assert found == [False] * (decisions - 1) + [ended]
    assert not is_terminated(table, episode, True, 0.1, 2.0)
    assert episode.resolved == 0.0


def test_rear_of_a_short_ego():
    short = Rectangle(0.0, 0.0, 0.0, 1.0, 1.0)
    assert touched_side(short, Rectangle(-2.5, 0.0, 0.0, 4.0, 1.0)) == "rear"
    assert touched_side(short, Rectangle(2.5, 0.0, 0.0, 4.0, 1.0)) == "front"
