"""Turns, junctions and curves of the protocols: paths, run-ups, parked cars and mirrored sides, by hand.

The turns are those of Euro NCAP Frontal Collisions v1.1, 1.2.4. The ego is 4.3 m by 1.8 m with a wheelbase of
2.67 m; x is measured from its front bumper at the start, y from its centreline, + left.
"""

from math import cos, pi, radians, sin

import numpy as np
import pytest
from numba import config
from support.contacts import ADULT_HIP, Contact
from support.scenarios import check_actor, scenario, shape

from lgmd_gym.envs.dynamics.path import Path
from lgmd_gym.envs.dynamics.script import Pose
from lgmd_gym.envs.families.turning import turn_of

SMALL = {"length": 4.316, "width": 1.79, "height": 1.48}
LARGE = {"length": 4.418, "width": 1.82, "height": 1.533}
# Whether to the left, ego speeds [km/h], radius of the arc [m], changes of heading on each clothoid and on
# the arc [degrees]. To the right at 10 km/h as in the parameters CPTAno and CPTAns of Vector's files.
TURNS = [
    (True, (5, 10), 9.0, 20.62, 48.76),
    (False, (5, 10), 8.0, 22.85, 44.3),
    *((left, (10.1, 15), 11.75, 20.93, 48.14) for left in (True, False)),
    *((left, (15.1, 20, 25), 14.75, 21.79, 46.42) for left in (True, False)),
]

compiled_only = pytest.mark.skipif(config.DISABLE_JIT, reason="an environment needs compilation")


def kmh(value):
    return value / 3.6


@pytest.mark.parametrize(("left", "speeds", "radius", "clothoid", "arc"), TURNS)
def test_turns_of_the_front_axle(left, speeds, radius, clothoid, arc):
    """Clothoids from 1500 m to the radius of the arc; their mean curvature times length is the angle."""
    low, high, sign = 1 / 1500, 1 / radius, 1 if left else -1
    eased = radians(clothoid) / ((low + high) / 2)
    expected = [
        (eased, sign * low, sign * high),
        (radius * radians(arc), sign * high, sign * high),
        (eased, sign * high, sign * low),
    ]
    for speed in speeds:
        assert shape(turn_of(kmh(speed), left).bends(left)) == expected
    assert 2 * clothoid + arc == pytest.approx(90.0)


def integrated(turn):
    """Return the places of a turn to the left, integrated in fine steps, shape (steps, 2) [m]."""
    heading, places = 0.0, [np.zeros(2)]
    for bend in turn.bends(left=True):
        step = bend.length / 2000
        for part in (np.arange(2000) + 0.5) / 2000:
            turned = step * (bend.curvature + part * (bend.last_curvature - bend.curvature))
            heading += turned / 2
            places.append(places[-1] + step * np.array([cos(heading), sin(heading)]))
            heading += turned / 2
    assert heading == pytest.approx(pi / 2)
    return np.array(places)


@pytest.mark.parametrize("speed", [10, 15, 25])
def test_the_ego_drives_the_turn_with_its_front_axle(speed):
    """The front axle, a wheelbase ahead of the rear one, is on the integrated turn, to 1 mm."""
    turn = integrated(turn_of(kmh(speed)))
    for left, sign in ((True, 1), (False, -1)):
        made = scenario("CPTA", ego_speed=kmh(speed), left=left)
        # The turn ends in a lane of the crossing road: beyond its centre, or, to the right, before it.
        places = integrated(turn_of(kmh(speed), left))
        end = 1.335 + made.ego_path[0].length + places[-1, 0]
        assert made.road.distance == pytest.approx(end - sign * 1.75, abs=0.001)
    made = scenario("CCFtap", ego_speed=kmh(speed))
    path, straight = Path(Pose(0.0, 0.0, 0.0), made.ego_path), made.ego_path[0].length
    for way in np.linspace(straight, straight + 0.8 * made.ego_path[1].length * len(made.ego_path[1:]), 9):
        rear = path.pose(way)
        front = np.array(
            [rear.x - straight - 2.67 * (1 - cos(rear.heading)), -rear.y - 2.67 * sin(rear.heading)]
        )
        if front[0] < turn[-1, 0] and front[1] < turn[-1, 1]:
            assert np.hypot(*(turn - front).T).min() < 0.001 + turn_step(turn)
    assert made.ego_reference == 1.335


def turn_step(turn):
    """Return half of the longest distance between points of the turn [m]."""
    return np.hypot(*np.diff(turn, axis=0).T).max() / 2


# Distances before the contact from which the pedestrian starts; Euro NCAP AEB/LSS VRU v4.5.1, CPTA.
@pytest.mark.parametrize(
    ("left", "direction", "start", "speeds"),
    [
        (True, "same", 9.5, (10, 15, 20)),
        (True, "opposite", 6.0, (10, 15, 20)),
        (False, "opposite", 9.5, (10,)),
        (False, "same", 6.0, (10,)),
    ],
)
def test_run_up_of_the_turning_pedestrian(left, direction, start, speeds):
    """2 m of acceleration to 5 km/h, then 7.5 or 4 m; the episode may begin after it."""
    v, ahead = kmh(5), 1 if direction == "same" else -1
    for speed in speeds:
        made = scenario("CPTA", ego_speed=kmh(speed), left=left, direction=direction)
        walker, contact = made.actors[0], made.duration - 6.0
        begin = contact - (start - 2) / v - 4 / v  # of the acceleration, v/2 over 2 m
        steady = begin <= -4 / v
        assert walker.speed == pytest.approx(v if steady else max(-begin * v**2 / 4, 0.0))
        if not steady:
            (ramp,) = walker.profile
            assert (ramp.start, ramp.acceleration) == pytest.approx((max(begin, 0.0), v**2 / 4))
        assert walker.heading == (0.0 if ahead > 0 else pi)
        assert walker.lateral_offset == pytest.approx(11.25 if left else -7.75)
        # Where the hip is at the contact, seen from the ego's front at the start.
        covered = v * contact if steady else start - walker.speed**2 * 2 / v**2
        hip = walker.gap + 0.3 + ahead * (ADULT_HIP + covered)
        ego = Path(Pose(-2.15 - 1.335, 0.0, 0.0), made.ego_path).pose(kmh(speed) * contact)
        front = 1.335 + 2.15
        x, y = ego.x + front * cos(ego.heading), -(ego.y + front * sin(ego.heading))
        aside = made.actors[0].lateral_offset - y
        assert hip == pytest.approx(x + aside / -np.tan(ego.heading), abs=0.01)


@compiled_only
@pytest.mark.parametrize("family", ["CCFtap", "CMFtap"])
@pytest.mark.parametrize("speed", [10, 15, 25])
def test_straight_before_a_turn(family, speed):
    """The turn begins 2 s after the start, or later if the contact would come before 5 s."""
    contact = Contact(made := scenario(family, ego_speed=kmh(speed), target_speed=kmh(45)))
    straight = made.ego_path[0].length
    assert straight >= 2 * kmh(speed) - 1e-9
    time = contact.travelled / kmh(speed)
    assert time == pytest.approx(made.duration - 6.0, abs=0.002)
    assert time >= 5.0 - 0.002
    assert straight == pytest.approx(2 * kmh(speed)) or time == pytest.approx(5.0, abs=0.002)
    target = made.actors[0]
    assert (target.lateral_offset, target.heading, target.speed) == (3.5, pi, kmh(45))
    assert made.ego_reference == 1.335


@pytest.mark.parametrize(("side", "sign"), [("right", 1), ("left", -1)])
def test_parked_cars_before_a_junction(side, sign):
    """Three cars 1 m apart, 24 m (right) or 21 m (left) before the target's path, beside the ego's way."""
    for family, path in (("CCCscp", 50 + 0.856), ("CMCscp", 50 - 0.43)):
        made = scenario(family, ego_speed=10.0, side=side, obstructed=True)
        cars = made.actors[1:]
        front, inner = (path - 24, -2.0) if side == "right" else (path - 21, 5.5)
        for car, size in zip(cars, (LARGE, SMALL, SMALL), strict=True):
            y = inner - sign * size["width"] / 2
            check_actor(car, gap=front - size["length"], lateral_offset=y, **size)
            front -= size["length"] + 1.0
        free = scenario(family, ego_speed=10.0, side=side)
        assert free.actors == made.actors[:1]
        assert free.road == made.road
    assert made.road.distance == pytest.approx(2.15 + 50 - 0.43 - sign * 1.75)


@pytest.mark.parametrize(("side", "sign"), [("right", 1), ("left", -1)])
def test_crossing_motorcycle(side, sign):
    made = scenario("CMCscp", ego_speed=10.0, target_speed=6.0, side=side)
    size = {"kind": "motorcycle", "length": 2.08, "width": 0.79, "height": 1.45}
    expected = {"gap": 50 - 0.43 - 1.04, "lateral_offset": -sign * (0.9 + 1.04 + 30)}
    check_actor(made.actors[0], **expected, heading=sign * pi / 2, speed=6.0, **size)
    assert (made.ego_speed, made.duration, made.road.kind) == (10.0, 11.0, "crossing")


@pytest.mark.parametrize(("left", "sign"), [(True, 1), (False, -1)])
@pytest.mark.parametrize("oncoming", [0.0, 8.0])
def test_cars_beside_a_curve(left, sign, oncoming):
    """The ego meets them after 4, 5.5 and 7 s; a right curve is the mirror image of a left one."""
    options = {"ego_speed": 10.0, "radius": 200.0, "lateral_offset": sign * 3.5, "oncoming_speed": oncoming}
    made = scenario("CurvePass", left=left, **options)
    for car, time in zip(made.actors, (4.0, 5.5, 7.0), strict=True):
        station = 2.15 + 4.023 / 2 + (10 + oncoming) * time
        angle, radius = station / 200, 200 - 3.5
        turned = sign * angle + (pi if oncoming else 0.0)
        place = {
            "gap": radius * sin(angle) - 2.15 - 4.023 / 2,
            "lateral_offset": sign * (200 - radius * cos(angle)),
        }
        way = [(station_of_last(oncoming) + 60, -sign / 196.5, -sign / 196.5)] if oncoming else []
        assert shape(car.path) == way
        check_actor(car, **place, heading=turned, speed=oncoming, path=car.path)
    (curve,) = made.ego_path
    assert shape(made.ego_path) == [(station_of_last(oncoming) + 60, sign / 200, sign / 200)]
    assert (made.road.kind, made.road.distance, made.road.bends) == ("curve", 0.0, (curve,))
    assert (made.ego_speed, made.duration) == (10.0, 9.0)


def station_of_last(oncoming):
    return 2.15 + 4.023 / 2 + (10 + oncoming) * 7.0


@pytest.mark.parametrize("place", ["entrance", "exit"])
def test_car_that_stands_in_the_outer_lane_of_a_curve(place):
    """A right curve of 60° after 4 s; the car is 10 m behind its start or before its end, 3.5 m outside."""
    made = scenario("CurveStandingCar", ego_speed=10.0, radius=150.0, place=place)
    length = 150 * pi / 3
    assert shape(made.ego_path) == [(40.0, 0.0, 0.0), (length, -1 / 150, -1 / 150)]
    angle = (10.0 if place == "entrance" else length - 10.0) / 150
    x, y = 40 + 153.5 * sin(angle), 153.5 * cos(angle) - 150
    check_actor(made.actors[0], gap=x - 2.15 - 4.023 / 2, lateral_offset=y, heading=-angle)
    assert (made.duration, made.road.distance) == (pytest.approx((40 + length) / 10 + 2), 40.0)


def test_car_that_brakes_in_the_adjacent_lane():
    made = scenario("AdjacentBraking", ego_speed=20.0, headway=1.5, deceleration=4.0)
    (other,) = made.actors
    check_actor(other, gap=30.0, lateral_offset=3.5, speed=20.0, profile=other.profile)
    assert [(item.start, item.acceleration, item.final_speed) for item in other.profile] == [(3.0, -4.0, 0.0)]
    assert (made.duration, made.ego_path) == (pytest.approx(3 + (30 + 50 + 4.023 + 4.3) / 20 + 2), ())
    curve = scenario("AdjacentBraking", ego_speed=20.0, radius=200.0)
    # Both turn right by 90°, the other car 3.5 m outside, from 1 m after its start on.
    assert shape(curve.actors[0].path) == [(1.0, 0.0, 0.0), (203.5 * pi / 2, -1 / 203.5, -1 / 203.5)]
    entry = 30 + 2.15 + 4.023 / 2 + 1.0
    assert shape(curve.ego_path) == [(entry, 0.0, 0.0), (100 * pi, -1 / 200, -1 / 200)]


def test_lane_change_before_a_head_on_contact():
    """CCFhol: 44 m of lane change of the oncoming car end 1.5 s before the contact, 5 s after the start."""
    made = scenario("CCFhol", ego_speed=20.0, target_speed=20.0)
    target, overtaken = made.actors
    straight, *shift = target.path
    assert [bend.length for bend in shift] == [11.0] * 4
    assert straight.length == pytest.approx((5 - 1.5) * 20 - 44)
    assert (target.lateral_offset, target.heading, overtaken.heading) == (3.5, pi, pi)
    assert {name: getattr(overtaken, name) for name in LARGE} == LARGE
    assert overtaken.gap == pytest.approx(target.gap - 13.9 - 4.418)
    slow = scenario("CCFhol", ego_speed=20.0, target_speed=10.0)  # 4.4 s, 1.5 s and 0.5 s before
    assert slow.duration == pytest.approx(6.4 + 6)
    assert slow.actors[0].path[0].length == pytest.approx(5.0)
