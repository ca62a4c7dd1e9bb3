"""Cars in adjacent lanes: every distance, time and offset is computed by hand.

The ego is 4.3 m by 1.8 m, the target car 4.023 m by 1.712 m, a lane is 3.5 m wide, and the first possible
contact is 5 s after the start.
"""

from math import pi

import pytest
from numba import config
from support.scenarios import check_actor, invalid, scenario

from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.families.distribution import draw_scenario, level_generator
from lgmd_gym.envs.families.scenario import RoadPlan

compiled_only = pytest.mark.skipif(config.DISABLE_JIT, reason="an environment needs compilation")


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
    for name, low, high in (("gap", 2, 200), ("excess", -13.9985, 26), ("change_length", 10, 200)):
        for value in (low, high):
            scenario("CutIn", **{"ego_speed": 14.0, name: value})
        for value in (low - 0.001, high + 0.001):
            invalid("CutIn", name, **{"ego_speed": 14.0, name: value})


@pytest.mark.parametrize(
    # 2 s in the left lane, or longer, so that the front bumper reaches the other's rear 5 s after the start.
    ("gap", "excess", "before", "duration"),
    [(8.0, -4.0, 3.0, 3 + 2 + 6), (20.0, -4.0, 2.0, 2 + 5 + 6), (2.0, -0.5, 2.0, 2 + 4 + 6)],
)
def test_slower_car_cuts_in(gap, excess, before, duration):
    made = scenario("CutIn", ego_speed=20.0, gap=gap, excess=excess, change_length=32.0)
    (actor,) = made.actors
    # While in the left lane it falls back by `before` times the speed difference.
    assert (actor.gap, actor.speed) == (gap - before * excess, 20.0 + excess)
    assert [bend.length for bend in actor.path] == [before * (20 + excess), 8.0, 8.0, 8.0, 8.0]
    assert (made.ego_speed, made.duration) == (20.0, duration)


@compiled_only
def test_slower_car_moves_into_the_lane_and_is_hit():
    env = BrakingEnv(scenario("CutIn", ego_speed=20.0, gap=20.0, excess=-4.0, change_length=32.0))
    env.reset(seed=0)
    ego, other = env.road.vehicles

    def advance(seconds):
        for _ in range(round(30 * seconds)):
            _, _, terminated, _, info = env.step([0.0])
        ahead, aside = other.position - ego.position
        return terminated, ahead - (4.3 + 4.023) / 2, -aside, info

    terminated, distance, aside, _ = advance(2.0)  # the lane change begins
    assert (distance, aside) == (pytest.approx(20.0), pytest.approx(3.5))
    _, distance, aside, _ = advance(1.0)  # half of the 2 s of the change, 16 m of 32 m
    assert (distance, aside) == (pytest.approx(16.0, abs=0.3), pytest.approx(1.75))
    _, distance, aside, info = advance(1.0)
    assert (distance, aside) == (pytest.approx(12.0, abs=0.6), pytest.approx(0.0, abs=1e-6))
    assert not info["collision"]
    # 12 m minus the 0.4 m by which the change is shorter along the road, at 4 m/s.
    terminated, _, _, info = advance(distance / 4 + 1 / 30)
    assert terminated
    assert info["relative_impact_speed"] == pytest.approx(4.0)


@compiled_only
def test_much_slower_car_is_passed():
    """At 15 m/s faster, the ego covers 2 m and both lengths in 0.7 s of a change of 6.4 s."""
    env = BrakingEnv(scenario("CutIn", ego_speed=20.0, gap=2.0, excess=-15.0, change_length=32.0))
    env.reset(seed=0)
    done = False
    while not done:
        _, _, terminated, truncated, info = env.step([0.0])
        done = terminated or truncated
    assert not info["collision"]
    assert env.road.vehicles[0].position[0] > env.road.vehicles[1].position[0]


def test_bounds_of_a_slower_car():
    scenario("CutIn", ego_speed=14.0, excess=-0.5)
    for excess in (-0.499, -0.001):
        invalid("CutIn", "excess must be >= 0 or <= -0.5 m/s in CutIn", ego_speed=14.0, excess=excess)
    invalid("CutIn", r"ego_speed \+ excess must be in \(0, 40\] m/s, got 0.0", ego_speed=14.0, excess=-14.0)
    invalid("CutIn", "excess must be in", ego_speed=14.0, excess=-41.0)


@pytest.mark.parametrize(
    ("level", "ego_speed", "gap", "speed", "straight"),
    [
        (15, "0x1.31d12b31234cdp+4", "0x1.3fc5d423207d2p+3", "0x1.480a0ebf5c306p+4", "0x1.480a0ebf5c306p+5"),
        (103, "0x1.08445f52afd63p+4", "0x1.19feccaa3ac42p+4", "0x1.1e7d42e0e8b9cp+4", "0x1.1e7d42e0e8b9cp+5"),
    ],
)
def test_random_levels_keep_their_bits(level, ego_speed, gap, speed, straight):
    """Values before slower cars could cut in."""
    made = draw_scenario(level_generator("train", level))
    (actor,) = made.actors
    assert (made.family, made.duration) == ("CutIn", 9.0)
    values = made.ego_speed, actor.gap, actor.speed, actor.path[0].length
    assert [value.hex() for value in values] == [ego_speed, gap, speed, straight]


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
