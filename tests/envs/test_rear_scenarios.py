"""Rear scenarios: every distance, time and offset is computed by hand.

The ego is 4.3 m by 1.8 m, the target car 4.023 m by 1.712 m, a lane is 3.5 m wide, and the first possible
contact is 5 s after the start.
"""

from math import pi

import pytest
from support.scenarios import check_actor, invalid, scenario

from lgmd_gym.envs.dynamics.script import Segment
from lgmd_gym.envs.families.scenario import RoadPlan


def test_approach_of_a_stationary_car():
    made = scenario("CCRs", ego_speed=10.0, shade=7, target_heading=0.5)
    assert (made.ego_speed, made.duration, made.road, made.top_speed) == (10.0, 11.0, RoadPlan(), 10.0)
    assert len(made.actors) == 1
    check_actor(made.actors[0], gap=50.0, shade=7, heading=0.5)
    assert scenario("CCRs").ego_speed == pytest.approx(50 / 3.6)
    for heading in (pi / 2, -pi / 2):
        assert scenario("CCRs", target_heading=heading).actors[0].heading == heading
        invalid("CCRs", "target_heading", target_heading=1.001 * heading)


@pytest.mark.parametrize("family", ["CCRs", "CCRm", "CCRb"])
@pytest.mark.parametrize(
    ("position", "offset"),
    [
        ({}, 0.0),
        ({"lateral_offset": 1.25}, 1.25),
        ({"lateral_offset": -20.0}, -20.0),
        ({"overlap": 1.0}, 0.0),
        ({"overlap": -1.0}, 0.0),
        ({"overlap": 0.5}, (1.8 + 1.712) / 2 - 0.9),
        ({"overlap": -0.5}, -((1.8 + 1.712) / 2 - 0.9)),
        ({"overlap": 0.75}, (1.8 + 1.712) / 2 - 1.35),
        ({"impact_location": 0.5}, 0.0),
        ({"impact_location": 1.25}, 1.35),
        ({"impact_location": -0.25}, -1.35),
    ],
)
def test_lateral_position_of_the_target(family, position, offset):
    made = scenario(family, beside=True, shade=9, **position)
    target, second = made.actors
    assert target.lateral_offset == pytest.approx(offset)
    assert (second.lateral_offset, second.gap, second.speed, second.profile) == (
        3.5, target.gap, target.speed, target.profile,
    )  # fmt: skip
    assert (target.shade, second.shade, second.heading) == (9, None, 0.0)


def test_bounds_of_the_lateral_position():
    for name, low, high in (
        ("lateral_offset", -20, 20),
        ("overlap", -1, 1),
        ("impact_location", -0.25, 1.25),
    ):
        for value in (low, high):
            scenario("CCRs", **{name: value})
        for value in (low - 0.001, high + 0.001):
            invalid("CCRs", name, **{name: value})
    message = "lateral_offset=1.0 and overlap=0.5 both set the lateral position; pass one"
    invalid("CCRs", message, lateral_offset=1.0, overlap=0.5)


def test_approach_of_a_slower_car():
    made = scenario("CCRm", ego_speed=10.0, target_speed=4.0)
    assert (made.ego_speed, made.duration) == (10.0, 11.0)
    check_actor(made.actors[0], gap=30.0, speed=4.0)
    invalid("CCRm", "target_speed must be below ego_speed 10 m/s", ego_speed=10.0, target_speed=10.0)
    scenario("CCRm", ego_speed=10.0, target_speed=9.999)
    assert scenario("CCRm").actors[0].speed == pytest.approx(20 / 3.6)


def test_approach_of_a_braking_car():
    made = scenario("CCRb", ego_speed=10.0, gap=20.0, deceleration=5.0, build_up=0.5)
    # Braking after 3 s, in effect 0.25 s later; 10/(2·5) s for the lead car's way, and 2 s for the gap.
    assert (made.ego_speed, made.duration) == (10.0, pytest.approx(3 + 0.25 + 1 + 2 + 6))
    braking = Segment(start=3.0, acceleration=-5.0, build_up=0.5, final_speed=0.0)
    check_actor(made.actors[0], gap=20.0, speed=10.0, profile=(braking,))
    (default,) = scenario("CCRb").actors
    assert (default.gap, default.profile[0]) == (40.0, Segment(start=3.0, acceleration=-6.0, build_up=1.0))
    assert scenario("CCRb", ego_speed=10.0, headway=1.5).actors[0].gap == pytest.approx(15.0)
    invalid("CCRb", "both set the distance", gap=20.0, headway=1.0)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [("gap", 1, 200), ("headway", 0.3, 10), ("deceleration", 0.5, 10), ("build_up", 0, 5)],
)
def test_bounds_of_a_braking_car(name, low, high):
    for value in (low, high):
        scenario("CCRb", **{name: float(value)})
    for value in (low - 0.001, high + 0.001):
        invalid("CCRb", name, **{name: value})


def test_steady_following():
    made = scenario("Following", ego_speed=10.0, headway=1.5)
    assert (made.ego_speed, made.duration, len(made.actors)) == (10.0, 10.0, 1)
    check_actor(made.actors[0], gap=15.0, speed=10.0)
    assert scenario("Following", ego_speed=10.0).actors[0].gap == 20.0
    for headway in (0.299, 10.001):
        invalid("Following", "headway", headway=headway)
    for headway in (0.3, 10.0):
        scenario("Following", headway=headway)


def test_lead_car_that_brakes_and_releases():
    made = scenario("BrakeRelease", ego_speed=10.0, headway=2.0, speed_drop=4.0)
    slower = Segment(start=3.0, acceleration=-2.5, final_speed=6.0)
    faster = Segment(start=3.0, acceleration=2.5, final_speed=10.0)
    assert (made.ego_speed, made.duration) == (10.0, 10.0)
    check_actor(made.actors[0], gap=20.0, speed=10.0, profile=(slower, faster))
    # A drop of 5 m/s reduces the gap by 25/2.5 = 10 m, which must be less than the gap.
    scenario("BrakeRelease", ego_speed=10.0, headway=1.001, speed_drop=5.0)
    message = r"speed_drop 5 m/s reduces the gap of 10.0 m by 10.0 m"
    invalid("BrakeRelease", message, ego_speed=10.0, headway=1.0, speed_drop=5.0)
    scenario("BrakeRelease", ego_speed=10.0, headway=5.0, speed_drop=10.0)
    scenario("BrakeRelease", ego_speed=10.0, speed_drop=0.1)
    for drop in (0.099, 10.001):
        invalid("BrakeRelease", "speed_drop", ego_speed=10.0, headway=9.0, speed_drop=drop)
    default = scenario("BrakeRelease").actors[0]
    assert (default.gap, default.profile[0].final_speed) == (
        pytest.approx(1.5 * 50 / 3.6), pytest.approx(50 / 3.6 - 5),
    )  # fmt: skip


def test_the_lead_car_brakes_as_it_reaches_the_shadow():
    made = scenario("BrakeRelease", ego_speed=10.0, headway=2.0, shadow_length=12.0)
    lead, shadow = made.actors
    braking = lead.profile[0]
    assert shadow.gap == lead.gap + 10.0 * braking.start
    assert (shadow.length, shadow.kind) == (12.0, "road_marking")
    assert scenario("BrakeRelease", ego_speed=10.0, headway=2.0).actors == (lead,)
    invalid("BrakeRelease", "shadow_length", shadow_length=-1.0)
