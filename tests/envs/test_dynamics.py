"""Longitudinal motion, brake delay and contact against closed forms."""

from math import inf, pi

import numpy as np
import pytest
from highway_env import utils
from hypothesis import given, settings
from hypothesis import strategies as st

from lgmd_gym.envs.dynamics.brake import BrakeParams, DelayLine
from lgmd_gym.envs.dynamics.contact import Rectangle, first_touch, touched_side
from lgmd_gym.envs.dynamics.longitudinal import SpeedProfile, advance, time_to_stop
from lgmd_gym.envs.dynamics.script import Segment
from lgmd_gym.envs.families.scenario import Actor, Scenario


def drive(speed, target, jerk, dt, steps):
    distance, acceleration = 0.0, 0.0
    for _ in range(steps):
        moved, speed, acceleration = advance(speed, acceleration, target, jerk, dt)
        distance += moved
    return distance, speed, acceleration


@pytest.mark.parametrize("kmh", [10, 37, 50, 80, 130])
@pytest.mark.parametrize("deceleration", [2.0, 6.0, 9.0])
@pytest.mark.parametrize("hz", [15, 60, 97])
def test_stopping_distance_equals_the_closed_form(kmh, deceleration, hz):
    speed = kmh / 3.6
    distance, end, _ = drive(speed, -deceleration, inf, 1 / hz, 20 * hz)
    assert end == 0.0
    assert distance == pytest.approx(speed**2 / (2 * deceleration), abs=1e-9)


def test_stopping_distance_with_build_up_equals_the_closed_form():
    speed, jerk, full = 50 / 3.6, 45.0, 9.0
    ramp = full / jerk
    after = speed - full * ramp / 2
    expected = speed * ramp - full * ramp**2 / 6 + after**2 / (2 * full)
    assert drive(speed, -full, jerk, 1 / 60, 600)[0] == pytest.approx(expected, abs=1e-9)


def test_motion_does_not_depend_on_the_step_size():
    coarse, fine = drive(20.0, -7.0, 30.0, 0.1, 60), drive(20.0, -7.0, 30.0, 0.001, 6000)
    assert coarse == pytest.approx(fine, abs=1e-9)


@given(
    speed=st.floats(0, 40),
    acceleration=st.floats(-12, 12),
    target=st.floats(-12, 12),
    jerk=st.floats(0.5, 500) | st.just(inf),
    dt=st.floats(0, 0.5),
)
def test_cars_never_reverse_and_distance_is_bounded(speed, acceleration, target, jerk, dt):
    distance, end, _ = advance(speed, acceleration, target, jerk, dt)
    assert distance >= -1e-9
    assert end >= 0.0
    assert distance <= (max(speed, end) + 12 * dt) * dt + 1e-9


@given(
    speed=st.floats(0.01, 40),
    acceleration=st.floats(-12, 12, allow_subnormal=False),
    jerk=st.floats(-200, 200, allow_subnormal=False),
)
def test_time_to_stop_is_a_root(speed, acceleration, jerk):
    time = time_to_stop(speed, acceleration, jerk)
    if time < 100:
        assert speed + acceleration * time + jerk * time**2 / 2 == pytest.approx(0, abs=1e-6 * (1 + time**2))
        for earlier in (0.25, 0.5, 0.75):
            part = earlier * time
            assert speed + acceleration * part + jerk * part**2 / 2 >= -1e-6


def test_stationary_car_moves_only_if_it_accelerates():
    distance, speed, _ = advance(0.0, 0.0, 2.0, inf, 1.0)
    assert (distance, speed) == pytest.approx((1.0, 2.0))
    assert advance(0.0, 0.0, -9.0, 45.0, 1.0) == (0.0, 0.0, 0.0)


def test_demands_are_delayed_by_fractions_of_a_step():
    line = DelayLine(0.05)
    line.put(-1.0)
    assert line.advance(0.04) == [(pytest.approx(0.04), 0.0)]
    assert line.advance(0.04) == [(pytest.approx(0.01), 0.0), (pytest.approx(0.03), -1.0)]
    line.put(0.0)
    line.put(0.0)
    assert [demand for _, demand in line.advance(0.1)] == [-1.0, 0.0]


def test_brake_params_error_states_the_range():
    with pytest.raises(ValueError, match=r"max_deceleration must be in \[0.1, 12\] m/s², got 20"):
        BrakeParams(max_deceleration=20)


CAR = Rectangle(0.0, 0.0, 0.0, 4.3, 1.8)


def segment(final_speed, acceleration):
    return Segment(start=0.0, acceleration=acceleration, final_speed=final_speed)


@pytest.mark.parametrize(
    "profile",
    [
        [segment(3.0, 2.0)],
        [segment(12.0, -2.0)],
        [segment(3.0, 0.0)],
        [segment(3.0, -2.0), segment(4.0, -2.0)],  # the second one begins at 3 m/s
    ],
)
def test_a_segment_whose_acceleration_does_not_lead_to_its_final_speed_is_refused(profile):
    for build in (
        lambda: SpeedProfile(10.0, tuple(profile)),
        lambda: Actor(gap=30.0, speed=10.0, profile=tuple(profile)),
        lambda: Scenario(family="Own", ego_speed=10.0, duration=5.0, ego_profile=tuple(profile)),
    ):
        with pytest.raises(ValueError, match=r"does not lead from (10|3) to final_speed \d+ m/s; use an"):
            build()


def test_a_segment_may_end_at_the_speed_before_it():
    Actor(gap=30.0, speed=10.0, profile=(segment(10.0, -2.0), segment(3.0, -2.0), segment(10.0, 2.0)))


def test_first_touch_straight_ahead():
    other = Rectangle(10.0, 0.0, 0.0, 4.0, 1.7)
    gap = 10.0 - (4.3 + 4.0) / 2
    assert first_touch(CAR, other, 20.0, 0.0) == pytest.approx(gap / 20.0)
    assert first_touch(CAR, other, gap - 0.001, 0.0) == inf  # one millimetre short
    assert first_touch(CAR, other, -20.0, 0.0) == inf


def test_passing_with_clearance_does_not_touch():
    assert first_touch(CAR, Rectangle(10.0, 1.76, 0.0, 4.0, 1.7), 20.0, 0.0) == inf
    assert first_touch(CAR, Rectangle(10.0, 1.74, 0.0, 4.0, 1.7), 20.0, 0.0) < 1.0


def test_initial_overlap_is_a_touch_at_zero():
    assert first_touch(CAR, Rectangle(1.0, 0.0, 0.3, 4.0, 1.7), 0.0, 0.0) == 0.0
    assert first_touch(CAR, Rectangle(8.0, 0.0, 0.3, 4.0, 1.7), 0.0, 0.0) == inf


def test_first_touch_of_a_corner():
    # A square turned by 45° extends by half its diagonal.
    square = Rectangle(10.0, 0.0, pi / 4, 2.0, 2.0)
    assert first_touch(CAR, square, 20.0, 0.0) == pytest.approx((10.0 - 2.15 - 2.0**0.5) / 20.0)


@settings(max_examples=200)
@given(
    x=st.floats(-20, 20), y=st.floats(-20, 20), heading=st.floats(-4, 4), turn=st.floats(-4, 4),
    dx=st.floats(-30, 30), dy=st.floats(-30, 30),
)  # fmt: skip
def test_first_touch_agrees_with_highway_env(x, y, heading, turn, dx, dy):
    """Sample highway-env's polygon test along the displacement."""
    moving, standing = Rectangle(0, 0, turn, 4.3, 1.8), Rectangle(x, y, heading, 4.0, 1.7)

    def polygon(box, shift_x=0.0, shift_y=0.0):
        corners = np.array([[-1, -1], [-1, 1], [1, 1], [1, -1], [-1, -1]]) / 2 * [box.length, box.width]
        cos, sin = np.cos(box.heading), np.sin(box.heading)
        return corners @ np.array([[cos, sin], [-sin, cos]]) + [box.x + shift_x, box.y + shift_y]

    zero = np.zeros(2)
    target = polygon(standing)
    touch = first_touch(moving, standing, dx, dy)
    for fraction in np.linspace(0, 1, 21):
        moved = polygon(moving, fraction * dx, fraction * dy)
        sampled = utils.are_polygons_intersecting(moved, target, zero, zero)[0]
        if fraction < touch - 1e-6:
            assert not sampled


@pytest.mark.parametrize(
    ("other", "side"),
    [
        (Rectangle(4.65, 0.0, 0.0, 5.0, 2.0), "front"),
        (Rectangle(4.65, 1.7, 0.0, 5.0, 2.0), "front"),
        (Rectangle(-4.65, 0.4, 0.0, 5.0, 2.0), "rear"),
        (Rectangle(0.5, 1.9, 0.0, 5.0, 2.0), "side"),
        (Rectangle(0.2, -3.4, pi / 2, 5.0, 2.0), "side"),
        (Rectangle(3.15, 1.0, pi / 2, 5.0, 2.0), "front"),
    ],
)
def test_touched_side(other, side):
    assert touched_side(CAR, other) == side
    turned = [Rectangle(-box.x, -box.y, box.heading + pi, box.length, box.width) for box in (CAR, other)]
    assert touched_side(*turned) == side
