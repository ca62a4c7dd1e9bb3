"""Cars in adjacent lanes: every distance, time and offset is computed by hand.

The ego is 4.3 m by 1.8 m, the target car 4.023 m by 1.712 m, a lane is 3.5 m wide, and the first possible
contact is 5 s after the start.
"""

from math import pi

import pytest
from support.scenarios import check_actor, invalid, scenario

from lgmd_gym.envs.scenarios.scenario import RoadPlan


def test_queue_in_the_adjacent_lane():
    made = scenario("AdjacentPass", ego_speed=10.0, cars=3, lateral_offset=-3.0)
    assert [actor.gap for actor in made.actors] == pytest.approx([50, 50 + 6.023, 50 + 12.046])
    for actor in made.actors:
        check_actor(actor, gap=actor.gap, lateral_offset=-3.0)
    assert made.duration == pytest.approx((50 + 3 * 6.023 + 4.3) / 10 + 2)
    check_actor(scenario("AdjacentPass").actors[0], gap=250 / 3.6, lateral_offset=3.5)
    assert len(scenario("AdjacentPass").actors) == 1
    # Contact up to (1.8 + 1.712)/2 = 1.756 m.
    for offset in (1.7561, -1.7561):
        scenario("AdjacentPass", lateral_offset=offset)
    for offset in (1.756, -1.756, 0.0):
        invalid("AdjacentPass", "lateral_offset must exceed 1.756 m", lateral_offset=offset)
    for cars in (0, 21):
        invalid("AdjacentPass", "cars", cars=cars)
    assert len(scenario("AdjacentPass", cars=20).actors) == 20


def test_parked_cars_on_both_sides():
    made = scenario("PassBetween", ego_speed=20.0, inner_gap=4.0)
    left, right = made.actors
    check_actor(left, gap=100.0, lateral_offset=2 + 0.856)
    check_actor(right, gap=100.0, lateral_offset=-(2 + 0.856))
    assert (made.ego_speed, made.duration) == (20.0, pytest.approx((100 + 4.023 + 4.3) / 20 + 2))
    assert scenario("PassBetween", ego_speed=5.0).actors[0].gap == 50.0  # at least
    # 49 CFR 571.127 S9.3: 4.5 m between front wheels with a track of 1.434 m and tyres of 0.205 m
    assert scenario("PassBetween").actors[0].lateral_offset == pytest.approx(2.25 + 0.717 + 0.1025)
    assert scenario("PassBetween", wheel_gap=4.0).actors[1].lateral_offset == pytest.approx(-2.8195)
    invalid("PassBetween", "wheel_gap and inner_gap cannot both be given", wheel_gap=4.5, inner_gap=4.5)
    invalid("PassBetween", "wheel_gap", wheel_gap=1.999)
    for gap in (1.999, 10.001):
        invalid("PassBetween", "inner_gap", inner_gap=gap)
    for gap in (2.0, 10.0):
        scenario("PassBetween", inner_gap=gap)


def test_overtaking_car():
    made = scenario("Overtaken", ego_speed=20.0, excess=5.0)
    # Next to the ego after 3 s.
    check_actor(made.actors[0], gap=-(4.3 + 4.023) - 15.0, lateral_offset=3.5, speed=25.0)
    assert (made.ego_speed, made.duration) == (20.0, 10.0)
    scenario("Overtaken", excess=0.1)
    for excess in (0.099, 20.001):
        invalid("Overtaken", "excess", ego_speed=20.0, excess=excess)
    assert scenario("Overtaken", ego_speed=20.0, excess=20.0).actors[0].speed == 40.0
    assert scenario("Overtaken").actors[0].speed == pytest.approx(110 / 3.6)


def test_oncoming_car():
    made = scenario("Oncoming", ego_speed=20.0, oncoming_speed=15.0)
    check_actor(made.actors[0], gap=175.0, lateral_offset=3.5, heading=pi, speed=15.0)
    assert (made.ego_speed, made.duration, made.road) == (20.0, 7.0, RoadPlan(kind="two-way"))
    assert scenario("Oncoming").actors[0].gap == pytest.approx(5 * 160 / 3.6)


def test_cut_in():
    made = scenario("CutIn", ego_speed=10.0, gap=12.0, excess=1.5, change_length=30.0)
    (actor,) = made.actors
    # 2 s in the left lane, in which it gains 3 m, then four clothoids of 7.5 m to the right.
    assert (actor.gap, actor.lateral_offset, actor.speed) == (9.0, 3.5, 11.5)
    assert [bend.length for bend in actor.path] == [23.0, 7.5, 7.5, 7.5, 7.5]
    assert actor.path[1].last_curvature == pytest.approx(-8 * 3.5 / 30**2, rel=0.02)
    assert (made.ego_speed, made.duration) == (10.0, 9.0)
    default = scenario("CutIn").actors[0]
    assert (default.gap, default.speed) == (pytest.approx(12 - 10 / 3.6), pytest.approx(55 / 3.6))
    assert sum(bend.length for bend in default.path) == pytest.approx(2 * 55 / 3.6 + 44)
    for name, low, high in (("gap", 2, 200), ("excess", 0, 26), ("change_length", 10, 200)):
        for value in (low, high):
            scenario("CutIn", **{"ego_speed": 14.0, name: value})
        for value in (low - 0.001, high + 0.001):
            invalid("CutIn", name, **{"ego_speed": 14.0, name: value})


def test_cut_out():
    made = scenario("CutOut", ego_speed=10.0, headway=2.0, change_length=30.0)
    (actor,) = made.actors
    assert (actor.gap, actor.lateral_offset, actor.speed) == (20.0, 0.0, 10.0)
    assert [bend.length for bend in actor.path] == [30.0, 7.5, 7.5, 7.5, 7.5]
    assert actor.path[1].last_curvature == pytest.approx(8 * 3.5 / 30**2, rel=0.02)
    assert (made.ego_speed, made.duration) == (10.0, 9.0)
    assert scenario("CutOut", ego_speed=10.0).actors[0].gap == 15.0
    assert sum(bend.length for bend in scenario("CutOut", ego_speed=10.0).actors[0].path) == pytest.approx(
        74.0
    )
    for headway in (0.3, 10.0):
        scenario("CutOut", headway=headway)
    for headway in (0.299, 10.001):
        invalid("CutOut", "headway", headway=headway)
