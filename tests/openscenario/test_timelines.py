"""Speeds over time and synchronisations, by hand."""

from math import inf

import pytest

from lgmd_gym.envs.dynamics.longitudinal import SpeedProfile
from lgmd_gym.envs.dynamics.script import Segment
from lgmd_gym.openscenario.motion import Piece, Timeline, synchronise


def test_ramp_of_speed():
    timeline = Timeline(10.0)
    assert timeline.change(2.0, -4.0, 2.0) == 4.0
    assert timeline.at(2.0)[:3] == (2.0, 20.0, 10.0)
    assert timeline.at(3.0)[:3] == (3.0, 28.0, 6.0)
    assert timeline.at(5.0)[:3] == (5.0, 34.0, 2.0)
    assert timeline.time_of(20.0) == 2.0
    assert timeline.time_of(28.0) == pytest.approx(3.0, abs=1e-12)
    assert timeline.time_of(36.0) == pytest.approx(6.0)


def test_standstill_is_never_left():
    timeline = Timeline(4.0)
    timeline.change(0.0, -4.0, 0.0)
    assert timeline.time_of(2.0) == pytest.approx(1.0, abs=1e-6)
    assert timeline.time_of(2.1) == inf


def test_a_new_change_ends_the_one_under_way():
    timeline = Timeline(0.0)
    timeline.change(1.0, 2.0, 10.0)
    timeline.change(3.0, -1.0, 0.0)
    assert timeline.segments == [
        Segment(start=1.0, acceleration=2.0, final_speed=4.0),
        Segment(start=3.0, acceleration=-1.0, final_speed=0.0),
    ]
    assert timeline.at(9.0)[1:3] == (4.0 + 8.0, 0.0)


@pytest.mark.parametrize("build_up", [0.0, 0.5, 1.0, 6.0])
@pytest.mark.parametrize(("speed", "final", "strength"), [(10.0, 3.0, -4.0), (2.0, 9.0, 3.0)])
def test_motion_equals_that_of_the_simulation(build_up, speed, final, strength):
    timeline = Timeline(speed)
    timeline.change(1.0, strength, final, build_up)
    profile = SpeedProfile(speed, tuple(timeline.segments))
    travelled = 0.0
    for number in range(1, 7001):
        travelled += profile.step(1e-3)
        if number % 500 == 0:  # the simulation ends a change at the end of its step, at most 1 ms late
            motion = timeline.at(number * 1e-3)
            assert motion.distance == pytest.approx(travelled, abs=1e-5)
            assert motion.speed == pytest.approx(profile.speed, abs=1e-9)


def test_copies_of_another_timeline():
    leader, follower = Timeline(5.0), Timeline(5.0)
    leader.change(1.0, 1.0, 6.0)
    follower.copy_from(0.5, leader)
    assert follower.at(10.0)[1:] == leader.at(10.0)[1:]


def arrival(now, approach, distance):
    """Return time, speed and the time since the last change at which a distance is covered."""
    timeline = Timeline(now.speed)
    for start, acceleration, speed in approach:
        timeline.change(start, acceleration, speed)
    reached = timeline.time_of(distance)
    return reached, timeline.at(reached).speed


def test_a_standing_target_waits_and_then_accelerates():
    """4 m in 8 s, the last 3 m at 1.5 m/s: it accelerates over 1 m, for 4/3 s, and arrives 2 s later."""
    approach = synchronise(Piece(0.0, 0.0, 0.0), 4.0, 8.0, 1.5, (3.0, 0.0))
    ((start, acceleration, final),) = approach
    assert start == pytest.approx(8.0 - 2.0 - 4 / 3)
    assert acceleration == pytest.approx(1.5 / (4 / 3))
    assert final == 1.5
    assert arrival(Piece(0.0, 0.0, 0.0), approach, 4.0) == pytest.approx((8.0, 1.5))


def test_a_late_target_accelerates_at_once():
    """70 m in 10 s, the last 2 s at 10 m/s: 50 m in 8 s, with 6 s from 0 to 10 m/s and 2 s at 10 m/s."""
    approach = synchronise(Piece(0.0, 0.0, 0.0), 70.0, 10.0, 10.0, (0.0, 2.0))
    ((start, acceleration, _),) = approach
    assert (start, acceleration) == pytest.approx((0.0, 10 / 6))
    assert arrival(Piece(0.0, 0.0, 0.0), approach, 70.0) == pytest.approx((10.0, 10.0))


def test_an_intermediate_speed_where_the_mean_is_outside():
    """90 m in 10 s from 10 to 10 m/s: a mean of 9 m/s needs 8 m/s in the middle."""
    approach = synchronise(Piece(0.0, 0.0, 10.0), 90.0, 10.0, 10.0, (0.0, 0.0))
    assert approach == ((0.0, pytest.approx(-0.4), 8.0), (5.0, pytest.approx(0.4), 10.0))
    assert arrival(Piece(0.0, 0.0, 10.0), approach, 90.0) == pytest.approx((10.0, 10.0))


def test_no_change_without_need():
    assert synchronise(Piece(0.0, 0.0, 10.0), 100.0, 10.0, 10.0, (20.0, 0.0)) == ()


def test_any_final_speed_is_a_constant_acceleration():
    approach = synchronise(Piece(2.0, 0.0, 10.0), 60.0, 4.0, None, (0.0, 0.0))
    assert approach == ((2.0, 2.5, 20.0),)


@pytest.mark.parametrize(
    ("distance", "duration", "final", "steady", "message"),
    [
        (-1.0, 5.0, 10.0, (0.0, 0.0), "-1 m in 5 s cannot be reached"),
        (10.0, 0.0, 10.0, (0.0, 0.0), "10 m in 0 s cannot be reached"),
        (10.0, 5.0, None, (0.0, 0.0), "needs a reversal"),
        (50.0, 5.0, 10.0, (60.0, 0.0), "no room before the 6 s at constant speed"),
        (10.0, 5.0, 10.0, (0.0, 0.0), "a speed of -6 m/s would be needed"),
        (200.0, 5.0, 10.0, (0.0, 0.0), "an acceleration of 24 m/s² would be needed"),
    ],
)
def test_impossible_synchronisations(distance, duration, final, steady, message):
    with pytest.raises(ValueError, match=message):
        synchronise(Piece(0.0, 0.0, 10.0), distance, duration, final, steady)
