"""The path of the rear axle against the front axle that it must produce."""

from math import cos, hypot, pi, sin

import pytest

from lgmd_gym.envs.dynamics.path import Path, rear_axle_path
from lgmd_gym.envs.dynamics.script import Bend, Pose, arc, turn

WHEELBASE = 2.67
PATHS = {
    "left turn": (Bend(20.0), *turn(pi / 2, 9.0, 5.0), Bend(15.0)),
    "right turn": (Bend(20.0), *turn(-pi / 2, 6.0, 3.0), Bend(15.0)),
    "s-curve": (Bend(10.0), Bend(5.0, 0.1, 0.1), Bend(10.0, -0.1, -0.1), Bend(10.0)),
}


@pytest.mark.parametrize("bends", PATHS.values(), ids=PATHS)
def test_front_axle_is_on_its_path(bends):
    front = Path(Pose(0.0, 0.0, 0.0), bends)
    rear = Path(Pose(-WHEELBASE, 0.0, 0.0), rear_axle_path(bends, WHEELBASE))
    fine = [front.pose(0.005 * number) for number in range(12_000)]
    for number in range(100):
        x, y, heading = rear.pose(0.4 * number)
        x, y = x + WHEELBASE * cos(heading), y + WHEELBASE * sin(heading)
        assert min(hypot(x - pose.x, y - pose.y) for pose in fine) < 0.003


def test_steady_circle():
    """On a circle of radius R the rear axle is on one of radius sqrt(R² - L²)."""
    bends = (Bend(5.0), arc(10.0, 2 * pi))
    sections = rear_axle_path(bends, WHEELBASE)
    inside = [bend for bend in sections if bend.length < 0.1]
    assert inside[500].curvature == pytest.approx((10.0**2 - WHEELBASE**2) ** -0.5, rel=1e-3)
    assert sections[0] == bends[0]


def test_straight_path_stays():
    assert rear_axle_path((Bend(30.0),), WHEELBASE) == (Bend(30.0),)
