"""Contact of rectangles, within a step and on paths: every expected value is computed by hand."""

from math import cos, hypot, inf, nan, pi, sin

import numpy as np
import pytest
from support.records import bodies, brake_of, record, records

from lgmd_gym.envs.dynamics.bodies import BOX, EGO_STATE, ROAD_MARKING, STEP_START
from lgmd_gym.envs.dynamics.brake import DELAY_LINE
from lgmd_gym.envs.dynamics.contact import (
    Contact,
    PathMotion,
    Rectangle,
    first_touch,
    gap_on_path,
    time_on_paths,
    touched_side,
)
from lgmd_gym.envs.dynamics.episode import EPISODE, StepMotion, first_contact_of, step_bodies
from lgmd_gym.envs.dynamics.path import path_table, pose_at
from lgmd_gym.envs.dynamics.script import Pose, arc

NO_SEGMENTS = np.zeros((0, 4))
ORIGIN = Pose(0.0, 0.0, 0.0)


CAR = Rectangle(0.0, 0.0, 0.0, 4.0, 2.0)


@pytest.mark.parametrize(
    ("other", "dx", "dy", "expected"),
    [
        (Rectangle(14.0, 0.0, 0.0, 4.0, 2.0), 10.0, 0.0, 1.0),  # touches at the very end
        (Rectangle(14.0, 0.0, 0.0, 4.0, 2.0), 9.999, 0.0, inf),
        (Rectangle(14.0, 0.0, 0.0, 4.0, 2.0), 20.0, 0.0, 0.5),
        (Rectangle(-14.0, 0.0, 0.0, 4.0, 2.0), -20.0, 0.0, 0.5),
        (Rectangle(0.0, 12.0, 0.0, 4.0, 2.0), 0.0, 20.0, 0.5),
        (Rectangle(0.0, -12.0, 0.0, 4.0, 2.0), 0.0, -20.0, 0.5),
        (Rectangle(14.0, 2.0, 0.0, 4.0, 2.0), 20.0, 0.0, inf),  # sides at the same line do not touch
        (Rectangle(14.0, 1.999, 0.0, 4.0, 2.0), 20.0, 0.0, 0.5),
        (Rectangle(14.0, -2.0, 0.0, 4.0, 2.0), 20.0, 0.0, inf),
        (Rectangle(3.0, 1.0, 0.0, 4.0, 2.0), 0.0, 0.0, 0.0),
        (Rectangle(4.0, 0.0, 0.0, 4.0, 2.0), 0.0, 0.0, inf),
        # Crossing: 2 m wide, 13 m ahead, half lengths 2 and 1.
        (Rectangle(13.0, 0.0, pi / 2, 4.0, 2.0), 20.0, 0.0, 0.5),
        # A diamond with a half diagonal of √2 on the ego's axis, and beyond its side.
        (Rectangle(12.0 + 2**0.5, 0.0, pi / 4, 2.0, 2.0), 20.0, 0.0, 0.5),
        (Rectangle(12.0, 1.001 + 2**0.5, pi / 4, 2.0, 2.0), 20.0, 0.0, inf),
        # Diagonal motion: front after 0.5, side after 0.25.
        (Rectangle(14.0, 4.0, 0.0, 4.0, 2.0), 20.0, 8.0, 0.5),
        # Gone sideways before the front arrives: sides touch from 0.25 to 0.75, fronts from 0.8.
        (Rectangle(20.0, 4.0, 0.0, 4.0, 2.0), 20.0, 8.0, inf),
    ],
)
def test_first_touch(other, dx, dy, expected):
    assert first_touch(CAR, other, dx, dy) == pytest.approx(expected)
    # The same after a rotation of everything by 90°, and with exchanged roles.
    turned = [Rectangle(-box.y, box.x, box.heading + pi / 2, box.length, box.width) for box in (CAR, other)]
    if expected not in (1.0, inf):
        assert first_touch(*turned, -dy, dx) == pytest.approx(expected)
        assert first_touch(other, CAR, -dx, -dy) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("along", "side"),
    # A square of 1 m at the ego's side; 0.25 m from an end belongs to that end, which is 2 m from the centre.
    [(1.75, "front"), (1.74, "side"), (0.0, "side"), (-1.74, "side"), (-1.75, "rear")],
)
def test_touched_side_at_its_boundary(along, side):
    tip = Rectangle(along, 1.0 + 0.5**0.5, pi / 4, 1.0, 1.0)  # touches with one corner
    assert touched_side(CAR, tip) == side


def test_corners_within_2_cm_of_the_nearest_one_touch():
    # The other car's side lies on the ego's, with corners at ±1.9 m. A turn lifts one of them off.
    def side(lift):
        return touched_side(CAR, Rectangle(0.0, 2.0, lift / 1.9, 3.8, 2.0))

    assert [side(lift) for lift in (0.0, 0.019, -0.019)] == ["side"] * 3  # the mean of both is 0
    assert (side(0.021), side(-0.021)) == ("rear", "front")


def test_contact_of_road_objects():
    class Car:
        def __init__(self, x, y, heading, speed):
            self.position, self.heading, self.speed, self.LENGTH, self.WIDTH = (
                (x, y),
                heading,
                speed,
                4.0,
                2.0,
            )

    ego = Car(0.0, 0.0, pi / 2, 10.0)
    for heading, relative in ((pi / 2, 6.0), (0.0, 10.0), (-pi / 2, 14.0), (pi / 2 + pi / 3, 8.0)):
        contact = Contact.between(ego, Car(0.0, 4.0, heading, 4.0))
        assert (contact.side, contact.impact_speed) == ("front", 10.0)
        assert contact.relative_impact_speed == pytest.approx(relative)


def scratch(count):
    """Return the scratch memory of a step of `count` bodies."""
    return records(STEP_START, *[{}] * (count + 1)), np.zeros((9, 2))


def collide(other, ego=(), kind=(), dt=0.5):
    """Return the episode and bodies after a step of `dt` [s] with an ego at 20 m/s."""
    moving = {"speed": 20.0, "script_speed": 20.0} | dict(ego)
    rows = [moving, *([dict(other)] if isinstance(other, dict) else other)]
    rows = [row | {"script_speed": row.get("speed", 0.0)} for row in rows]
    table, paths = bodies(*rows)
    episode = record(EPISODE, bodies=len(rows), impact_speed=inf, relative_impact_speed=inf)
    step_bodies(
        table, episode, record(EGO_STATE, on_script=1), record(DELAY_LINE), np.zeros((8, 2)), brake_of(),
        NO_SEGMENTS, paths, *scratch(len(rows)), dt,
    )  # fmt: skip
    return episode, table


@pytest.mark.parametrize(
    ("heading", "relative"), [(0.0, 20 - 4), (pi, 20 + 4), (pi / 2, 20), (pi / 3, 18), (2 * pi / 3, 22)]
)
def test_relative_impact_speed_is_along_the_heading_of_the_ego(heading, relative):
    episode, _ = collide({"x": 8.0, "heading": heading, "speed": 4.0})
    assert (episode.touched, episode.impact_speed) == (1, pytest.approx(20.0))
    assert episode.relative_impact_speed == pytest.approx(relative)


@pytest.mark.parametrize("turn", [0.0, 0.6, pi / 2, 4.0])
def test_contact_does_not_depend_on_the_axes(turn):
    """A car from the left at 10 m/s: its front reaches the ego's side after 0.3 s, at 6 of 10 m."""

    def turned(x, y, heading, speed):
        c, s = cos(turn), sin(turn)
        return {"x": 7 + x * c - y * s, "y": -9 + x * s + y * c, "heading": heading + turn, "speed": speed}

    episode, table = collide(turned(6.0, -6.0, pi / 2, 10.0), turned(0.0, 0.0, 0.0, 20.0))
    assert (episode.touched, episode.impact_speed) == (1, pytest.approx(20.0))
    assert episode.relative_impact_speed == pytest.approx(20.0)
    moved = hypot(table[0].x - 7, table[0].y + 9), hypot(table[0].x - table[1].x, table[0].y - table[1].y)
    assert moved == pytest.approx((6.0, 3.0))


def test_bodies_stop_at_the_contact():
    # A gap of 5 m closes with 20 - 4 m/s in 5/16 s.
    episode, table = collide({"x": 9.0, "speed": 4.0})
    assert episode.touched == 1
    assert (table[0].x, table[1].x) == pytest.approx((20 * 5 / 16, 9 + 4 * 5 / 16))
    assert (table[0].speed, table[1].speed) == pytest.approx((20.0, 4.0))
    touched, places = episode.touched, table.x.copy()
    step_bodies(
        table, episode, record(EGO_STATE, on_script=1), record(DELAY_LINE), np.zeros((8, 2)), brake_of(),
        NO_SEGMENTS, bodies({}, {})[1], *scratch(2), 0.5,
    )  # fmt: skip
    assert (episode.touched, table.x.tolist()) == (touched, places.tolist())


def test_no_contact_within_the_step():
    episode, table = collide({"x": 14.5})
    assert (episode.touched, episode.impact_speed, table[0].x) == (0, inf, 10.0)


def test_first_of_several_contacts():
    rows = [{"x": 12.0}, {"x": 10.0, "kind": BOX}, {"x": 7.0, "kind": ROAD_MARKING}, {"x": 11.0}]
    episode, table = collide(rows)
    assert (episode.touched, table[0].x) == (2, pytest.approx(6.0))
    table, paths = bodies({"x": 10.0, "speed": 20.0}, {"x": 12.0}, {"x": 10.0})
    starts = records(STEP_START, {"speed": 20.0}, {"x": 12.0}, {"x": 10.0}, {})

    def first_of(table, count):
        parts = np.array([(inf, nan)])
        return first_contact_of(table, count, StepMotion(starts, parts, inf, NO_SEGMENTS, paths, 0.5))

    assert first_of(table, 3) == (pytest.approx(0.6), 2)
    assert first_of(table, 2) == (pytest.approx(0.8), 1)
    assert first_of(table, 1) == (inf, 0)
    table, paths = bodies({"x": 10.0, "speed": 20.0}, {"x": 18.0})
    assert first_of(table, 2) == (inf, 0)


def test_time_on_paths_of_straight_motion():
    table = path_table(ORIGIN)
    one = PathMotion(table, 0.0, 10.0, 4.0, 2.0)
    for travelled, speed, expected in (
        (20.0, 4.0, 16 / 6),
        (66.0, 4.0, inf),
        (20.0, 10.0, inf),
        (3.0, 0.0, 0.0),
    ):
        other = PathMotion(table, travelled, speed, 4.0, 2.0)
        assert time_on_paths(one, other, 10.0, 0.1) == pytest.approx(expected)
    slow = PathMotion(table, 0.0, 0.05, 4.0, 2.0)
    assert time_on_paths(slow, PathMotion(table, 4.25, 0.0, 4.0, 2.0), 10.0, 0.1) == pytest.approx(5.0)
    rest = PathMotion(table, 20.0, 0.0, 4.0, 2.0)
    assert time_on_paths(PathMotion(table, 0.0, 0.0, 4.0, 2.0), rest, 10.0, 0.1) == inf
    oncoming = PathMotion(path_table(Pose(30.0, 0.0, pi)), 0.0, 3.0, 4.0, 2.0)
    assert time_on_paths(one, oncoming, 10.0, 0.1) == pytest.approx(26 / 13)


def test_gap_on_a_path_is_measured_along_its_arc():
    path = path_table(ORIGIN, (arc(50.0, pi / 2),))  # to the left
    one = PathMotion(path, 0.0, 0.0, 4.0, 2.0)
    place = pose_at(path, 40.0)
    gap = gap_on_path(one, Rectangle(*place, 4.0, 2.0), 300.0, 1.0)
    assert gap == pytest.approx(36.0, abs=0.15)  # corners of the arc meet a little earlier
    straight = PathMotion(path_table(ORIGIN), 5.0, 0.0, 4.0, 2.0)
    assert gap_on_path(straight, Rectangle(45.2, 0.0, 0.0, 4.0, 2.0), 300.0, 0.5) == pytest.approx(36.2)
    for x, expected in ((45.0, 36.0), (308.9, 299.9), (311.0, inf), (2.0, 0.0)):
        assert gap_on_path(straight, Rectangle(x, 0.0, 0.0, 4.0, 2.0), 300.0, 1.0) == pytest.approx(expected)
