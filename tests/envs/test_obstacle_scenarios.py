"""Obstacles: every distance, time and offset is computed by hand.

The ego is 4.3 m by 1.8 m, the target car 4.023 m by 1.712 m, a lane is 3.5 m wide, and the first possible
contact is 5 s after the start.
"""

from math import pi

import pytest
from support.scenarios import check_actor, invalid, scenario, shape


def test_flat_objects():
    made = scenario("SteelPlate", ego_speed=20.0)
    flat = {"kind": "road_marking", "gap": 100.0}
    check_actor(made.actors[0], **flat, shade=150, length=3.7, width=2.4, height=0.025)
    assert (made.ego_speed, made.duration) == (20.0, 7.0)
    made = scenario("BridgeShadow", ego_speed=20.0, length=30.0)
    check_actor(made.actors[0], **flat, shade=30, length=30.0, width=40.0, height=0.0)
    assert (made.ego_speed, made.duration) == (20.0, pytest.approx(8.5))
    default = scenario("BridgeShadow")
    assert (default.actors[0].length, default.ego_speed) == (12.0, pytest.approx(80 / 3.6))
    for length in (1.0, 100.0):
        scenario("BridgeShadow", length=length)
    for length in (0.999, 100.001):
        invalid("BridgeShadow", "length", length=length)
    assert scenario("SteelPlate").ego_speed == pytest.approx(80 / 3.6)
    empty = scenario("EmptyRoad")
    assert (empty.actors, empty.ego_speed, empty.duration) == ((), pytest.approx(50 / 3.6), 10.0)


def test_pedestrian():
    made = scenario("PedestrianPass", ego_speed=10.0, clearance=1.5, walking_speed=2.0)
    size = {"kind": "pedestrian", "length": 0.6, "width": 0.5, "height": 1.8}
    check_actor(made.actors[0], gap=40.0, lateral_offset=-(0.9 + 1.5 + 0.25), speed=2.0, **size)
    assert (made.ego_speed, made.duration) == (10.0, pytest.approx(5 + 4.9 / 8 + 2))
    default = scenario("PedestrianPass")
    assert (default.actors[0].speed, default.actors[0].lateral_offset) == (pytest.approx(5 / 3.6), -2.15)
    assert default.ego_speed == pytest.approx(30 / 3.6)
    assert scenario("PedestrianPass", walking_speed=0.0).actors[0].speed == 0.0
    invalid("PedestrianPass", "walking_speed must be below", ego_speed=2.0, walking_speed=2.0)
    for clearance in (0.2, 10.0):
        scenario("PedestrianPass", clearance=clearance)
    for clearance in (0.199, 10.001):
        invalid("PedestrianPass", "clearance", clearance=clearance)


@pytest.mark.parametrize(("left", "sign"), [(True, 1), (False, -1)])
def test_guard_rail_in_a_curve(left, sign):
    made = scenario("CurveGuardRail", ego_speed=10.0, radius=40.0, left=left)
    # 3 s of straight, then 90° of the curve, 62.8 m.
    curve = made.ego_path[1]
    assert shape(made.ego_path) == [(30.0, 0.0, 0.0), (20 * pi, sign / 40, sign / 40)]
    assert (made.road.kind, made.road.distance, made.road.bends) == ("curve", 30.0, (curve,))
    assert (made.ego_speed, made.duration) == (10.0, pytest.approx((30 + 20 * pi) / 10 + 2))
    # The rail is 2.75 m beside the ego's path in a left curve, and 6.25 m in a right one.
    outside = 2.75 if left else 6.25
    assert len(made.actors) == int((20 * pi + 30) / 4)  # from 15 m before the curve to 15 m behind it
    first, middle = made.actors[0], made.actors[10]
    size = {"kind": "box", "shade": 175, "width": 0.3, "height": 0.75}
    check_actor(first, gap=17 - 2.15 - 2, lateral_offset=-sign * outside, length=4.0, **size)
    # Piece 10 is from 55 to 59 m: chord of a circle of radius 40 m + outside, its middle at 27 m of the arc.
    chord = 2 * (40 + outside) * 0.0499791693  # sin(2/40)
    assert middle.length == pytest.approx(chord, rel=1e-6)
    assert middle.heading == pytest.approx(sign * 27 / 40)


def test_limits_of_a_curve_with_a_guard_rail():
    scenario("CurveGuardRail", ego_speed=10.0, radius=25.0)  # 4 m/s²
    invalid("CurveGuardRail", "lateral acceleration of 4.0 m/s², beyond 4", ego_speed=10.001, radius=25.0)
    for radius in (14.999, 500.001):
        invalid("CurveGuardRail", "radius", ego_speed=5.0, radius=radius)
    scenario("CurveGuardRail", ego_speed=5.0, radius=15.0)
    wide = scenario("CurveGuardRail", ego_speed=5.0, radius=500.0)
    assert wide.ego_path[1].length == pytest.approx(120.0)  # at most
    default = scenario("CurveGuardRail")
    assert (default.ego_speed, default.ego_path[1].curvature) == (
        pytest.approx(50 / 3.6),
        pytest.approx(1 / 60),
    )
