"""Turning scenarios: every distance, time and offset is computed by hand.

The ego is 4.3 m by 1.8 m, the target car 4.023 m by 1.712 m, a lane is 3.5 m wide, and the first possible
contact is 5 s after the start.
"""

from math import pi, sqrt

import pytest
from support.scenarios import check_actor, invalid, scenario, shape

from lgmd_gym.envs.dynamics.script import Bend, Segment


def kmh(value):
    return value / 3.6


@pytest.mark.parametrize(("left", "sign", "radius"), [(True, 1, 9.0), (False, -1, 6.0)])
def test_turn_before_an_oncoming_car(left, sign, radius):
    made = scenario("TurnBeforeOncoming", left=left)
    # 4 s at 30 km/h, then 2.5 m/s² to 17 km/h, 1 m more, then the turn.
    onset = 4 * kmh(30) + (kmh(30) ** 2 - kmh(17) ** 2) / 5 + 1
    check_actor(made.actors[0], gap=onset + 12.5, lateral_offset=3.5, heading=pi)
    assert made.ego_profile == (Segment(start=4.0, acceleration=-2.5, final_speed=kmh(17)),)
    # Clothoids of 3 m and an arc that turn by 90° together.
    k, arc = sign / radius, radius * pi / 2 - 3
    assert shape(made.ego_path) == [(onset, 0.0, 0.0), (3.0, 0.0, k), (arc, k, k), (3.0, k, 0.0)]
    assert made.duration == pytest.approx(4 + (kmh(30) - kmh(17)) / 2.5 + (arc + 6 + 10) / kmh(17))
    assert (made.ego_speed, made.road.kind) == (pytest.approx(kmh(30)), "crossing")
    assert made.road.distance == pytest.approx(onset + radius + 1.5 - sign * 1.75)


@pytest.mark.parametrize(("left", "sign"), [(True, 1), (False, -1)])
def test_lead_car_that_turns_off(left, sign):
    made = scenario("LeadTurnsOff", left=left)
    # From 40 to 10 km/h with 3 m/s²; in this time the ego slows to 27 km/h.
    time = kmh(30) / 3
    lead = 4 * kmh(40) + (kmh(40) ** 2 - kmh(10) ** 2) / 6
    ease = kmh(13) / time
    ego = 4 * kmh(40) + (kmh(40) ** 2 - kmh(27) ** 2) / (2 * ease)
    gap_at_turn = 4.6 * kmh(17)
    (actor,) = made.actors
    assert actor.gap == pytest.approx(gap_at_turn + ego - lead)
    assert actor.speed == made.ego_speed == pytest.approx(kmh(40))
    (slowing,) = actor.profile
    assert (slowing.start, slowing.acceleration, slowing.final_speed) == (4.0, -3.0, pytest.approx(kmh(10)))
    (easing,) = made.ego_profile
    assert (easing.start, easing.acceleration, easing.final_speed) == (
        4.0, pytest.approx(-ease), pytest.approx(kmh(27)),
    )  # fmt: skip
    k, arc = sign / 8, 4 * pi - 2
    assert shape(actor.path) == [(lead, 0.0, 0.0), (2.0, 0.0, k), (arc, k, k), (2.0, k, 0.0)]
    assert made.duration == pytest.approx(4 + time + 6)
    centre = 2.15 + ego + gap_at_turn + 4.023 / 2 + 8 + 1 - sign * 1.75
    assert (made.road.kind, made.road.distance) == ("crossing", pytest.approx(centre))


@pytest.mark.parametrize(("left", "sign"), [(True, 1), (False, -1)])
def test_curve_with_a_car_outside(left, sign):
    made = scenario("CurveObjectOutside", left=left)
    onset = 4 * kmh(30) + (kmh(30) ** 2 - kmh(22.5) ** 2) / 4 + 1
    # The pipes' outer side is 1.75 + 0.25 + 0.11 m from the ego's path, the car's corner 0.1 m further out.
    ahead = sqrt((23.25 + 2.11 + 0.1) ** 2 - (23.25 - 0.856) ** 2)
    check_actor(made.actors[0], gap=onset - 2.15 + ahead)
    curve = made.ego_path[1]
    length = 23.25 * pi / 2
    assert shape(made.ego_path) == [(onset, 0.0, 0.0), (pytest.approx(length), sign / 23.25, sign / 23.25)]
    pipes = made.actors[1:]
    assert len(pipes) == int((length + 20) / 2)
    assert pipes[0].gap == pytest.approx(onset - 10 - 2.15)
    assert [pipe.lateral_offset for pipe in pipes[:5]] == pytest.approx([-sign * 2.055] * 5)
    assert {(pipe.kind, pipe.width, pipe.height) for pipe in pipes} == {("box", 0.11, 0.8)}
    assert (made.road.kind, made.road.distance, made.road.bends) == ("curve", pytest.approx(onset), (curve,))
    (slowing,) = made.ego_profile
    assert (slowing.start, slowing.acceleration, slowing.final_speed) == (4.0, -2.0, kmh(22.5))
    assert made.duration == pytest.approx(4 + kmh(7.5) / 2 + (length + 10) / kmh(22.5))
    assert made.ego_speed == kmh(30)


@pytest.mark.parametrize(("left", "sign"), [(True, 1), (False, -1)])
def test_lane_closure(left, sign):
    made = scenario("LaneClosure", ego_speed=10.0, left=left)
    expected = {"kind": "box", "shade": 225, "length": 0.3, "width": 1.5, "height": 1.8}
    check_actor(made.actors[0], gap=40.0 + 41.0, **expected)
    assert (made.ego_speed, made.duration) == (10.0, pytest.approx(10.1))
    assert made.ego_path[0] == Bend(40.0)
    # Four clothoids of 33/4 m; a shift of w over L needs about 8·w/L².
    assert [bend.length for bend in made.ego_path[1:]] == [33.0 / 4] * 4
    assert made.ego_path[1].last_curvature == pytest.approx(sign * 8 * 3.5 / 33**2, rel=0.02)
    for speed in (kmh(20), kmh(60)):
        scenario("LaneClosure", ego_speed=speed)
    for speed in (kmh(20) - 0.001, kmh(60) + 0.001):
        invalid("LaneClosure", "ego_speed", ego_speed=speed)
    assert scenario("LaneClosure").ego_speed == kmh(40)
