"""Crossing scenarios: every distance, time and offset is computed by hand.

The ego is 4.3 m by 1.8 m, the target car 4.023 m by 1.712 m, a lane is 3.5 m wide, and the first possible
contact is 5 s after the start.
"""

from math import pi

import pytest
from numba import config
from support.scenarios import check_actor, invalid, scenario

from lgmd_gym.envs.dynamics.script import Segment


@pytest.mark.parametrize(("side", "sign"), [("right", 1), ("left", -1)])
def test_crossing_car(side, sign):
    made = scenario("CCCscp", ego_speed=10.0, target_speed=6.0, side=side)
    # The car's near side is 50 m ahead of the ego's front; `gap` is to half a length before its centre.
    # After 5 s its centre is a quarter of its length beyond the ego's centreline.
    expected = {"gap": 50 + 0.856 - 2.0115, "lateral_offset": -sign * (30 + 4.023 / 4)}
    check_actor(made.actors[0], **expected, heading=sign * pi / 2, speed=6.0)
    assert (made.ego_speed, made.ego_profile, made.duration) == (10.0, (), 11.0)
    assert (made.road.kind, made.road.relative_to_ego) == ("crossing", True)
    # The crossing road's centre is half a lane before or beyond the car's path.
    assert made.road.distance == pytest.approx(2.15 + 50 + 0.856 - sign * 1.75)


@pytest.mark.skipif(config.DISABLE_JIT, reason="the search of the contact needs compilation")
def test_crossing_from_a_stop():
    made = scenario("CCCscp", ego_speed=3.0, target_speed=6.0, from_stop=True)
    assert (made.ego_speed, made.top_speed) == (0.0, 3.0)
    assert made.ego_profile == (Segment(start=4.5, acceleration=1.5, final_speed=3.0),)
    # 2.9 m with 1.5 m/s² take √(2·2.9/1.5) = 1.966 s; the step of that search is 1 ms.
    contact = 4.5 + (2 * 2.9 / 1.5) ** 0.5
    assert made.duration == pytest.approx(contact + 6, abs=2e-3)
    assert made.actors[0].lateral_offset == pytest.approx(-(6 * contact + 4.023 / 4), abs=0.012)
    assert made.actors[0].gap == pytest.approx(2.9 + 0.856 - 2.0115)


@pytest.mark.parametrize(("side", "sign"), [("right", 1), ("left", -1)])
def test_crossing_car_that_clears(side, sign):
    made = scenario("CrossingClears", ego_speed=10.0, target_speed=8.0, clear_by=2.0, side=side)
    # After 3 s and 24 m its rear is half a lane beyond the ego's centreline.
    offset = -sign * (24 - 1.75 - 2.0115)
    check_actor(
        made.actors[0], gap=50 + 0.856 - 2.0115, lateral_offset=offset, heading=sign * pi / 2, speed=8.0
    )
    assert (made.duration, made.road.kind) == (7.0, "crossing")
    for value in (0.5, 4.0):
        scenario("CrossingClears", clear_by=value)
    for value in (0.499, 4.001):
        invalid("CrossingClears", "clear_by", clear_by=value)
    invalid("CrossingClears", "unknown side 'rigt'; did you mean 'right'", side="rigt")
    default = scenario("CrossingClears")
    assert default.actors[0].lateral_offset == pytest.approx(-(3.5 * 40 / 3.6 - 1.75 - 2.0115))
