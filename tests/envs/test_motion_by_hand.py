"""Longitudinal motion, scripts and paths: every expected value is computed by hand."""

from math import inf, pi

import numpy as np
import pytest
from support.records import record

from lgmd_gym.envs.dynamics.longitudinal import (
    SCRIPT_FIELDS,
    advance,
    segment_table,
    step_script,
    time_to_stop,
)
from lgmd_gym.envs.dynamics.path import path_table, pose_at
from lgmd_gym.envs.dynamics.script import Bend, Pose, Segment, arc, turn
from lgmd_gym.envs.dynamics.units import check_speed
from lgmd_gym.errors import check_within

NO_SEGMENTS = np.zeros((0, 4))
ORIGIN = Pose(0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        # (speed, acceleration, target, jerk, dt): distance, speed, acceleration.
        ((10.0, 0.0, 2.0, inf, 1.0), (11.0, 12.0, 2.0)),
        ((10.0, 0.0, -2.0, inf, 1.0), (9.0, 8.0, -2.0)),
        # A ramp of 1 s at 2 m/s³: v = 10 - 1, s = 10 - 2/6.
        ((10.0, 0.0, -2.0, 2.0, 1.0), (10 - 1 / 3, 9.0, -2.0)),
        ((10.0, 0.0, -2.0, 2.0, 0.5), (5 - 2 * 0.125 / 6, 10 - 0.25, -1.0)),
        # The ramp, then 1 s at -2 m/s²: 9 - 1 m more.
        ((10.0, 0.0, -2.0, 2.0, 2.0), (10 - 1 / 3 + 8, 7.0, -2.0)),
        # From -2 back to 0 m/s² at 2 m/s³: v = 10 - 2 + 1, s = 10 - 1 + 2/6.
        ((10.0, -2.0, 0.0, 2.0, 1.0), (10 - 1 + 1 / 3, 9.0, 0.0)),
        ((10.0, -2.0, -2.0, 2.0, 1.0), (9.0, 8.0, -2.0)),
        # A stop after 1 s.
        ((2.0, 0.0, -2.0, inf, 3.0), (1.0, 0.0, 0.0)),
        ((2.0, 0.0, -2.0, inf, 1.0), (1.0, 0.0, 0.0)),
        # A stop within the ramp: v = 1 - t², s = 1 - 1/3.
        ((1.0, 0.0, -8.0, 2.0, 3.0), (2 / 3, 0.0, 0.0)),
        ((0.0, 0.0, 2.0, inf, 2.0), (4.0, 4.0, 2.0)),
        ((5.0, 1.0, 3.0, 4.0, 0.0), (0.0, 5.0, 1.0)),
    ],
)
def test_advance(arguments, expected):
    assert advance(*arguments) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ((4.0, -2.0, 0.0), 2.0),
        ((4.0, 0.0, 0.0), inf),
        ((4.0, 2.0, 0.0), inf),
        ((0.0, -2.0, 0.0), 0.0),
        ((0.0, 0.0, 0.0), 0.0),
        ((0.0, 0.0, -1.0), 0.0),
        ((0.0, 0.0, 1.0), inf),
        ((0.0, 2.0, 0.0), inf),
        ((2.0, 0.0, -1.0), 2.0),  # 2 - t²/2
        ((1.5, 1.0, -1.0), 3.0),  # 1.5 + t - t²/2
        ((1.5, -1.0, -1.0), 1.0),  # 1.5 - t - t²/2
        ((1.5, -2.0, 1.0), 1.0),  # 1.5 - 2t + t²/2
        ((2.0, -2.0, 1.0), 2.0),  # touches zero at its minimum
        ((2.001, -2.0, 1.0), inf),
        ((2.0, 1.0, 1.0), inf),
    ],
)
def test_time_to_stop(arguments, expected):
    assert time_to_stop(*arguments) == pytest.approx(expected)


def play(speed, rows, *steps):
    """Return distance, speed, acceleration and finished segments of a script after steps."""
    segments = np.array(rows, float).reshape(-1, 4)
    script = record(SCRIPT_FIELDS, script_speed=speed, segment_end=len(segments))
    distance = sum(step_script(script, segments, dt) for dt in steps)
    assert script.script_time == pytest.approx(sum(steps))
    return distance, script.script_speed, script.script_acceleration, script.segment


@pytest.mark.parametrize(
    ("rows", "dt", "expected"),
    [
        ([], 2.0, (20.0, 10.0, 0.0, 0)),
        ([(1, -2, 0, 4)], 0.5, (5.0, 10.0, 0.0, 0)),
        ([(1, -2, 0, 4)], 1.0, (10.0, 10.0, 0.0, 0)),
        ([(1, -2, 0, 4)], 2.0, (10 + 9, 8.0, -2.0, 0)),
        ([(1, 2, 0, 14)], 2.0, (10 + 11, 12.0, 2.0, 0)),
        ([(1, -2, 1, 4)], 2.0, (10 + 10 - 1 / 3, 9.0, -2.0, 0)),
        ([(1, -2, 0.05, 4)], 1.05, (10 + 0.5 - 0.05**2 / 3, 9.95, -2.0, 0)),
        ([(1, -2, 0, 8)], 2.0, (10 + 9, 8.0, 0.0, 1)),
        # A stop at 6 s stays.
        ([(1, -2, 0, 0)], 8.0, (10 + 25, 0.0, 0.0, 1)),
    ],
)
def test_script(rows, dt, expected):
    assert play(10.0, rows, dt) == pytest.approx(expected)


def test_overlapping_segment_begins_at_the_end_of_the_previous_one():
    rows = [(1, -2, 0, 8), (1, 2, 0, 10)]
    assert play(10.0, rows, 2.0, 0.5) == pytest.approx((10 + 9 + 4.25, 9.0, 2.0, 1))
    assert play(10.0, rows, 2.0, 1.0) == pytest.approx((10 + 9 + 9, 10.0, 0.0, 2))


def test_script_in_steps_equals_one_step_where_no_segment_ends():
    rows = [(0.75, -2, 0.5, 0)]
    assert play(10.0, rows, *[0.25] * 8) == pytest.approx(play(10.0, rows, 2.0))


def test_segment_table_has_the_columns_of_step_script():
    segment = Segment(start=1.0, acceleration=-2.0, build_up=0.5, final_speed=3.0)
    assert segment_table((segment,)).tolist() == [[1.0, -2.0, 0.5, 3.0]]
    assert segment_table(()).shape == (0, 4)


@pytest.mark.parametrize(
    ("field", "low", "high"),
    [("start", 0, 1e4), ("acceleration", -12, 12), ("build_up", 0, 10), ("final_speed", 0, 40)],
)
def test_bounds_of_a_segment(field, low, high):
    valid = {"start": 1.0, "acceleration": -1.0}
    for value in (low, high):
        assert getattr(Segment(**(valid | {field: value})), field) == value
    for value in (low - 0.001, high + 0.001):
        with pytest.raises(ValueError, match=field):
            Segment(**(valid | {field: value}))


def test_bounds_of_a_speed():
    assert check_speed("v", 40.0) == 40.0
    assert check_speed("v", 0.001) == 0.001
    assert check_speed("v", 0.0, zero=True) == 0.0
    with pytest.raises(ValueError, match=r"v must be in \(0, 40\] m/s, got 0.0"):
        check_speed("v", 0.0)
    with pytest.raises(ValueError, match=r"v must be in \[0, 40\] m/s, got -1"):
        check_speed("v", -1, zero=True)
    with pytest.raises(ValueError, match=r"v: 50 m/s = 180 km/h, beyond 40 m/s; for 50 km/h pass 13.89"):
        check_speed("v", 50)
    assert check_within("x", 1.0, 1.0, 1.0) == 1.0


def test_bends():
    assert arc(20.0, pi / 2) == Bend(10 * pi, 1 / 20)
    assert arc(20.0, -pi / 2) == Bend(10 * pi, -1 / 20)
    assert turn(1.0, 10.0, 4.0) == (Bend(4.0, 0.0, 0.1), Bend(6.0, 0.1), Bend(4.0, 0.1, 0.0))
    assert turn(-1.0, 10.0, 4.0) == (Bend(4.0, 0.0, -0.1), Bend(6.0, -0.1), Bend(4.0, -0.1, 0.0))
    assert turn(0.25, 10.0, 4.0) == (Bend(2.5, 0.0, 0.1), Bend(2.5, 0.1, 0.0))
    assert Bend(4.0, 0.0, 0.1).turn == pytest.approx(0.2)
    assert Bend(4.0, 0.1).turn == pytest.approx(0.4)
    for curvature in (-2.0, 2.0):
        assert Bend(1.0, curvature, curvature).last_curvature == curvature


def test_cells_of_a_path():
    table = path_table(Pose(1.0, 2.0, 0.0), (Bend(3.0), Bend(1.1, -0.1), Bend(0.4, 0.0, 0.2)))
    # A straight is one cell, 1.1 m are two of 0.55 m, 0.4 m are one; then the endless straight.
    assert table[:, 0] == pytest.approx([0.0, 3.0, 3.55, 4.1, 4.5])
    assert table[:, 4] == pytest.approx([0.0, 0.1, 0.1, 0.0, 0.0])  # + to the right
    assert table[:, 5] == pytest.approx([0.0, 0.0, 0.0, -0.5, 0.0])
    assert table[:, 3] == pytest.approx([0.0, 0.0, 0.055, 0.11, 0.11 - 0.04])
    assert table[1, 1:3].tolist() == [4.0, 2.0]


def test_pose_at_the_ends_of_cells():
    table = np.array([(0.0, 1.0, 2.0, 0.0, 0.0, 0.0), (4.0, 5.0, 2.0, pi / 2, 0.0, 0.0)])
    assert pose_at(table, -1.0) == pytest.approx((0.0, 2.0, 0.0))
    assert pose_at(table, 3.75) == pytest.approx((4.75, 2.0, 0.0))
    assert pose_at(table, 4.0) == pytest.approx((5.0, 2.0, pi / 2))
    assert pose_at(table, 6.0) == pytest.approx((5.0, 4.0, pi / 2))
    turned = np.array([(0.0, 1.0, 2.0, pi / 2, 0.0, 0.0)])
    assert pose_at(turned, -1.0) == pytest.approx((1.0, 1.0, pi / 2))
