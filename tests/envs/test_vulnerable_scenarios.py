"""Pedestrians and bicycles: start distances, run-ups and parked cars of every family, computed by hand.

The distances are those of Euro NCAP AEB/LSS VRU v4.5.1. The ego is 4.3 m by 1.8 m; x is measured from its
front bumper at the start, y from its centreline, + left, and the contact is 5 s after the start. An adult is
0.6 m by 0.5 m with the hip 0.36 m behind the front, a child 0.711 m by 0.298 m with the hip 0.396 m behind
it, and a bicycle 1.89 m by 0.5 m with the crankshaft 15 mm ahead of its centre.
"""

from math import pi

import pytest
from support.scenarios import invalid, scenario

from lgmd_gym.envs.families.road_users import run_up
from lgmd_gym.envs.families.scenario import RoadPlan

ADULT = {"kind": "pedestrian", "length": 0.6, "width": 0.5, "height": 1.8}
CHILD = {"kind": "pedestrian", "length": 0.711, "width": 0.298, "height": 1.154}
BICYCLE = {"kind": "bicycle", "length": 1.89, "width": 0.5, "height": 1.86}
LARGE = {"kind": "car", "length": 4.418, "width": 1.82, "height": 1.533}
SMALL = {"kind": "car", "length": 4.316, "width": 1.79, "height": 1.48}
CRANK = 0.015  # [m] ahead of the bicycle's centre
TO_LEFT, TO_RIGHT, BACK = pi / 2, -pi / 2, pi  # headings relative to the ego's


def kmh(value):
    return value / 3.6


def check(actor, size, x, y, heading=0.0, speed=0.0):
    """Assert size, centre, heading and initial speed of an actor."""
    assert {name: getattr(actor, name) for name in size} == size
    assert (actor.gap + actor.length / 2, actor.lateral_offset) == pytest.approx((x, y))
    assert (actor.heading, actor.speed) == pytest.approx((heading, speed))


def check_ramp(actor, start, acceleration, final):
    """Assert the one change of speed of an actor."""
    (ramp,) = actor.profile
    found = ramp.start, ramp.acceleration, ramp.final_speed, ramp.build_up
    assert found == pytest.approx((start, acceleration, final, 0.0))


@pytest.mark.parametrize(
    ("family", "side", "start", "ramp", "speed"),
    [("CPNA", -1, 4.0, 1.0, 5), ("CPNCO", -1, 4.0, 1.0, 5), ("CPFA", 1, 6.0, 1.5, 8)],
)
@pytest.mark.parametrize("location", [0.5, 0.25, 0.75])
def test_crossing_pedestrian(family, side, start, ramp, speed, location):
    """The centre starts at rest 4 m or 6 m from the ego's centreline and accelerates over 1 m or 1.5 m."""
    made = scenario(family, ego_speed=10.0, impact_location=location)
    size, hip = (CHILD, 0.711 / 2 - 0.396) if family == "CPNCO" else (ADULT, -0.06)
    walker, v = made.actors[0], kmh(speed)
    check(walker, size, 50.0 + size["width"] / 2, side * start, -side * pi / 2)
    way = start - side * (location - 0.5) * 1.8 - hip  # of the centre up to the contact
    check_ramp(walker, 5 - (way - ramp) / v - 2 * ramp / v, v**2 / (2 * ramp), v)
    assert (made.ego_speed, made.duration, made.road) == (10.0, 11.0, RoadPlan(kind="two-way"))


def test_child_that_crosses_in_the_open():
    made = scenario("CPNA", ego_speed=10.0, child=True)
    check(made.actors[0], CHILD, 50.149, -4.0, TO_LEFT)
    check(scenario("CPFA", ego_speed=10.0, child=True).actors[0], CHILD, 50.149, 6.0, TO_RIGHT)
    assert len(made.actors) == 1


def test_parked_cars_of_cpnco():
    """1 m beside the ego and 1 m apart, the front of the small car 1 m before the child's near side."""
    _, small, large = scenario("CPNCO", ego_speed=10.0).actors
    check(small, SMALL, 50 - 1 - 4.316 / 2, -(0.9 + 1 + 1.79 / 2))
    check(large, LARGE, 50 - 1 - 4.316 - 1 - 4.418 / 2, -(0.9 + 1 + 1.82 / 2))
    nearer = scenario("CPNCO", ego_speed=5.0).actors[1]
    assert nearer.gap - small.gap == pytest.approx(-25.0)


@pytest.mark.parametrize(
    ("family", "side", "speed", "steady"),
    [("CBNA", -1, 15, 17.0), ("CBNAO", -1, 10, 4.5), ("CBFA", 1, 20, 22.0)],
)
@pytest.mark.parametrize("location", [0.5, 0.25])
def test_crossing_bicycle(family, side, speed, steady, location):
    """It accelerates over 7 m before a steady way of 17, 4.5 or 22 m; the episode begins meanwhile."""
    made = scenario(family, ego_speed=10.0, impact_location=location)
    rider, v = made.actors[0], kmh(speed)
    acceleration, began = v**2 / 14, 5 - steady / v - 14 / v
    assert -14 / v < began < 0.0
    left_over = steady + 7 - acceleration * began**2 / 2  # from the start of the episode to the contact
    y = (location - 0.5) * 1.8 + side * (CRANK + left_over)
    check(rider, BICYCLE, 50.25, y, -side * pi / 2, -acceleration * began)
    check_ramp(rider, 0.0, acceleration, v)
    # The lane of the crossing road on which the bicycle rides has its centre on the bicycle's path.
    assert made.road.distance == pytest.approx(2.15 + 50.25 + side * 1.75)
    assert (made.ego_speed, made.duration, made.road.kind) == (10.0, 11.0, "crossing")


@pytest.mark.parametrize(
    ("family", "side", "beside", "clearance"),
    [("CBNA", -1, 17.0, 1.0), ("CBNAO", -1, 3.55, 4.8), ("CBFA", 1, 22.0, 1.0)],
)
def test_parked_cars_of_crossing_bicycles(family, side, beside, clearance):
    """They stand rear to the ego's way on the near side of the bicycle's, flush and 0.2 m apart."""
    _, large, small = scenario(family, ego_speed=10.0).actors
    near = 50 - clearance  # of the cars' sides that face the bicycle's way
    away = side * pi / 2
    check(large, LARGE, near - 1.82 / 2, side * (beside + 4.418 / 2), away)
    check(small, SMALL, near - 1.79 / 2, side * (beside + 4.418 + 0.2 + 4.316 / 2), away)


def test_bicycle_without_parked_cars():
    free, hidden = (scenario("CBNA", obstructed=obstructed) for obstructed in (False, True))
    assert free.actors == hidden.actors[:1]
    assert scenario("CBNA") == hidden


def test_defaults_of_crossing_families():
    for family, name, speed in (
        *(("CPNA", "walking_speed", 5), ("CPFA", "walking_speed", 8), ("CPNCO", "walking_speed", 5)),
        *(("CBNA", "bicycle_speed", 15), ("CBNAO", "bicycle_speed", 10), ("CBFA", "bicycle_speed", 20)),
    ):
        made = scenario(family, ego_speed=kmh(40), impact_location=0.5, **{name: kmh(speed)})
        assert scenario(family) == made


@pytest.mark.parametrize("location", [0.25, 0.5])
def test_road_users_ahead(location):
    y = (location - 0.5) * 1.8
    made = scenario("CPLA", ego_speed=10.0, walking_speed=2.0, impact_location=location)
    check(made.actors[0], ADULT, 40.3, y, speed=2.0)
    assert (made.duration, made.road, made.actors[0].profile) == (11.0, RoadPlan(kind="two-way"), ())
    made = scenario("CBLA", ego_speed=10.0, bicycle_speed=4.0, impact_location=location)
    check(made.actors[0], BICYCLE, 30 + 1.89 / 2, y, speed=4.0)
    assert scenario("CPLA").actors[0].speed == pytest.approx(kmh(5))
    assert (scenario("CBLA").actors[0].speed, scenario("CBLA").ego_speed) == (kmh(15), kmh(50))
    for family, name in (("CPLA", "walking_speed"), ("CBLA", "bicycle_speed")):
        scenario(family, ego_speed=3.0, **{name: 2.999})
        invalid(family, f"{name} must be below ego_speed 3 m/s in {family}", ego_speed=3.0, **{name: 3.0})


@pytest.mark.parametrize(
    ("child", "size"),
    [
        (False, {"kind": "box", "length": 0.5, "width": 1.8, "height": 0.3}),
        (True, {"kind": "box", "length": 0.298, "width": 1.154, "height": 0.2}),
    ],
)
def test_lying_person(child, size):
    (person,) = scenario("CPLA", ego_speed=10.0, walking_speed=0.0, lying=True, child=child).actors
    check(person, size, 50 + size["length"] / 2, 0.0)
    invalid("CPLA", "lying requires walking_speed=0, got 0.1 m/s", walking_speed=0.1, lying=True)


def test_road_users_towards_the_ego_brake_from_1_s_before_the_contact():
    """At 2 m/s with 1 m/s² from 4 s on they cover 9.5 m up to the contact, and stop 1 s later."""
    walker = scenario("CPLA", ego_speed=10.0, walking_speed=2.0, towards=True).actors[0]
    check(walker, ADULT, 50 + 9.5 + 0.3, 0.0, BACK, 2.0)
    check_ramp(walker, 4.0, -1.0, 0.0)
    rider = scenario("CBLA", ego_speed=10.0, bicycle_speed=4.0, towards=True).actors[0]
    check(rider, BICYCLE, 50 + 19 + 1.89 / 2, 0.0, BACK, 4.0)
    check_ramp(rider, 4.0, -2.0, 0.0)
    faster = scenario("CPLA", ego_speed=1.0, walking_speed=0.9, towards=True).actors[0]
    assert faster.gap == pytest.approx(5 + 0.95 * 4.5)


@pytest.mark.parametrize(("child", "size", "hip"), [(False, ADULT, -0.06), (True, CHILD, -0.0405)])
def test_reversing_towards_a_pedestrian(child, size, hip):
    made = scenario("CPRA", ego_speed=2.0, child=child)
    walker, v = made.actors[0], kmh(5)
    # 1.5 m of acceleration and 2.5 m of walking up to the contact.
    check(walker, size, 10 + size["width"] / 2, -(4.0 + hip), TO_LEFT)
    check_ramp(walker, 5 - 2.5 / v - 3.0 / v, v**2 / 3, v)
    standing = scenario("CPRA", ego_speed=2.0, moving=False, child=child, impact_location=0.75).actors[0]
    check(standing, size, 10 + size["length"] / 2, 0.45)
    assert (made.duration, made.road, scenario("CPRA").ego_speed) == (11.0, RoadPlan(kind="two-way"), kmh(4))


def test_oncoming_bicycle_that_is_passed():
    made = scenario("BicyclePass", ego_speed=10.0, clearance=1.5, bicycle_speed=4.0)
    check(made.actors[0], BICYCLE, 70 + 1.89 / 2, 0.9 + 1.5 + 0.25, BACK, 4.0)
    assert (made.duration, made.road) == (7.0, RoadPlan(kind="two-way"))
    default = scenario("BicyclePass")
    check(default.actors[0], BICYCLE, 5 * kmh(30) + 1.89 / 2, 2.15, BACK)


@pytest.mark.parametrize(
    ("contact", "speed", "steady", "ramp", "start", "wait", "distance"),
    [
        (5.0, 2.0, 4.0, 1.0, 0.0, 2.0, 5.0),  # 2 s of waiting, 1 s of ramp, 2 s of 2 m/s
        (3.0, 2.0, 4.0, 1.0, 0.0, 0.0, 5.0),
        (2.5, 2.0, 4.0, 1.0, 1.0, 0.0, 4.75),  # begins in the middle of the ramp, 0.25 m on the way
        (2.05, 2.0, 4.0, 1.0, 1.9, 0.0, 4.0975),
        (1.5, 2.0, 4.0, 1.0, 2.0, None, 3.0),  # begins after the ramp
        (2.0, 2.0, 4.0, 1.0, 2.0, None, 4.0),
    ],
)
def test_run_up(contact, speed, steady, ramp, start, wait, distance):
    run = run_up(contact, speed, steady, ramp)
    assert (run.speed, run.distance) == pytest.approx((start, distance))
    ramps = [(item.start, item.acceleration, item.final_speed) for item in run.profile]
    assert ramps == ([] if wait is None else [pytest.approx((wait, 2.0, 2.0))])
