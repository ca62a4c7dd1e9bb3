"""Paths against circles, closed forms and numerical integrals."""

from math import cos, pi, sin

import numpy as np
import pytest

from lgmd_gym.envs.dynamics.path import Path
from lgmd_gym.envs.dynamics.script import Bend, Pose, arc, lane_change, turn

ORIGIN = Pose(0.0, 0.0, 0.0)


def test_straight_path_extends_in_both_directions():
    path = Path(Pose(1.0, 2.0, 0.3))
    for distance in (-5.0, 0.0, 7.5):
        assert path.pose(distance) == pytest.approx((1 + distance * cos(0.3), 2 + distance * sin(0.3), 0.3))


@pytest.mark.parametrize("left", [1, -1])
def test_arc_is_part_of_a_circle(left):
    radius = 12.0
    path = Path(ORIGIN, (arc(radius, left * pi / 2),))
    for share in (0.1, 0.37, 0.5, 1.0):
        angle = share * pi / 2
        x, y, heading = path.pose(radius * angle)
        # A left turn has decreasing y and heading in highway-env's axes.
        assert (x, y) == pytest.approx((radius * sin(angle), -left * radius * (1 - cos(angle))), abs=1e-10)
        assert heading == pytest.approx(-left * angle)
    end = path.pose(radius * pi / 2 + 3.0)
    assert (end.x, end.y) == pytest.approx((radius, -left * (radius + 3.0)), abs=1e-10)


def test_clothoid_equals_its_numerical_integral():
    bend = Bend(20.0, 0.0, 0.08)
    path = Path(ORIGIN, (bend,))
    s = (np.arange(200_000) + 0.5) * 1e-4
    heading = -(0.08 / 20.0) * s**2 / 2
    assert path.pose(20.0).x == pytest.approx(np.cos(heading).sum() * 1e-4, abs=1e-7)
    assert path.pose(20.0).y == pytest.approx(np.sin(heading).sum() * 1e-4, abs=1e-7)
    assert bend.turn == pytest.approx(0.8)


@pytest.mark.parametrize("offset", [3.5, -3.5, 1.0])
def test_lane_change_shifts_the_path_and_restores_its_heading(offset):
    path = Path(ORIGIN, lane_change(40.0, offset))
    end = path.pose(40.0)
    assert end.y == pytest.approx(-offset, abs=1e-8)
    assert end.heading == pytest.approx(0.0, abs=1e-12)
    ys = [path.pose(distance).y for distance in np.linspace(0, 40, 50)]
    assert (np.diff(ys) * -np.sign(offset) >= 0).all()


@pytest.mark.parametrize("angle", [pi / 2, -pi / 2, 0.3])
def test_turn_changes_the_heading_by_its_angle(angle):
    bends = turn(angle, 10.0, 4.0)
    assert sum(bend.turn for bend in bends) == pytest.approx(angle)
    assert all(abs(bend.curvature) <= 0.1 + 1e-12 for bend in bends)


def test_path_is_continuous_across_cells():
    path = Path(ORIGIN, (*turn(1.2, 9.0, 5.0), *lane_change(30.0, 2.0)))
    s = np.linspace(-2, 60, 6201)
    poses = np.array([path.pose(value) for value in s])
    steps = np.hypot(np.diff(poses[:, 0]), np.diff(poses[:, 1]))
    np.testing.assert_allclose(steps, 0.01, rtol=1e-5)
    assert np.abs(np.diff(poses[:, 2])).max() < 0.01 / 8.9


def test_invalid_bends_raise():
    with pytest.raises(ValueError, match="length of a Bend must be > 0 m, got 0"):
        Bend(0)
    with pytest.raises(ValueError, match=r"curvature must be in \[-2, 2\] 1/m, got 3"):
        Bend(1.0, 3)
