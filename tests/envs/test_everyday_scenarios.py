"""Everyday threats and their neighbours: every distance and time is computed by hand.

The ego is 4.3 m by 1.8 m, the target car 4.023 m by 1.712 m, a lane is 3.5 m wide, and the first possible
contact is 5 s after the start.
"""

from math import pi

import numpy as np
import pytest
from numba import config
from support.scenarios import check_actor, invalid, scenario

from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.dynamics.path import Path
from lgmd_gym.envs.dynamics.script import Pose, Segment
from lgmd_gym.envs.families import LEVELS
from lgmd_gym.envs.families.distribution import EXTRA_FAMILIES, draw_scenario, level_generator

compiled_only = pytest.mark.skipif(config.DISABLE_JIT, reason="an environment needs compilation")
THREATS = (
    *("CutInThreat", "ClosingLead", "HardBrakingLead", "RollingCar", "PedestrianTowards", "BicycleTowards"),
    *("StandingPerson", "StandingChild", "LyingPerson", "LowBox", "AnimalCrossing"),
)
NEIGHBOURS = (
    *("CutInRecovers", "AdjacentSlower", "BoxPass", "RoadsidePerson", "ManholeCover", "AnimalClears"),
)


def coast(made):
    """Return the time [s] and the info of the end of an episode without braking."""
    env = BrakingEnv(made)
    _, info = env.reset(seed=0)
    for decision in range(1, 2000):
        *_, terminated, truncated, info = env.step(np.zeros(1, np.float32))
        if terminated or truncated:
            return decision / 30, info
    raise AssertionError("the episode does not end")


def drawn(name, number=200):
    """Return the scenarios of random levels."""
    return [draw_scenario(level_generator("train", level), [name]) for level in range(number)]


def test_every_new_level_has_its_kind_and_twin():
    for name in (*THREATS, "SecondThreat"):
        assert LEVELS[name].threat is True
    for name in THREATS:
        twin = LEVELS[f"{name}WithoutTarget"]
        assert (twin.threat, twin.has_target, twin.weight) == (False, False, LEVELS[name].weight / 2)
    assert "SecondThreatWithoutTarget" not in LEVELS
    for name in NEIGHBOURS:
        assert LEVELS[name].threat is False
    assert {*THREATS, *NEIGHBOURS, "SecondThreat"} < {*EXTRA_FAMILIES}
    assert (LEVELS["CutIn"].threat, LEVELS["StandingBox"].threat) == (False, True)


@compiled_only
@pytest.mark.parametrize("name", [*THREATS, *NEIGHBOURS, "SecondThreat"])
def test_contact_without_braking_exactly_in_threats(name):
    for made in drawn(name, 25):
        end, info = coast(made)
        assert info["collision"] is LEVELS[name].threat, made
        assert end >= 4.5


@compiled_only
@pytest.mark.parametrize(
    ("ego_speed", "excess", "end_ttc", "left"), [(20, -5, 1.0, True), (30, -1.5, 3.0, False)]
)
def test_cut_in_has_the_stated_time_to_contact_at_the_end_of_the_lane_change(
    ego_speed, excess, end_ttc, left
):
    """A lane change of 60 m at 15 or 28.5 m/s takes 4.0 or 2.105 s."""
    made = scenario(
        "CutIn", ego_speed=ego_speed, excess=excess, end_ttc=end_ttc, change_length=60.0, left=left
    )
    (other,) = made.actors
    assert other.lateral_offset == (3.5 if left else -3.5)
    end = Path(Pose(0.0, 0.0, 0.0), other.path).pose(sum(bend.length for bend in other.path))
    assert -end.y == pytest.approx(-other.lateral_offset)
    time = sum(bend.length for bend in other.path) / (ego_speed + excess)
    gap = other.gap + end.x - ego_speed * time
    assert gap / -excess == pytest.approx(end_ttc)
    contact, info = coast(made)
    assert info["collision"]
    assert contact == pytest.approx(time + end_ttc, abs=1 / 30)
    assert contact >= 5.0


def test_cut_in_of_a_slower_car():
    made = scenario("CutIn", ego_speed=20.0, excess=-5.0, end_ttc=2.0, change_length=60.0)
    assert scenario("CutIn", gap=12.0) == scenario("CutIn")
    # The change takes 4 s and ends 2 s before the contact, so that it begins after 2 s.
    assert made.actors[0].path[0].length == pytest.approx(2.0 * 15.0)
    assert made.duration == pytest.approx(2.0 + 4.0 + 2.0 + 6.0)
    recovering = scenario("CutIn", ego_speed=20.0, excess=-5.0, end_ttc=2.0, change_length=60.0, recovery=2.5)
    assert recovering.actors[0].profile == (Segment(start=6.0, acceleration=2.5, final_speed=20.0),)
    invalid("CutIn", "end_ttc requires a slower car, got excess 1 m/s", excess=1.0, end_ttc=2.0)
    invalid("CutIn", "recovery requires a slower car", excess=1.0, recovery=2.0)
    invalid("CutIn", "gap=12.0 and end_ttc=2.0 both set the distance", excess=-5.0, gap=12.0, end_ttc=2.0)


@compiled_only
def test_a_car_that_recovers_takes_a_part_of_the_distance():
    """10 m at the end of the lane change, of which 5 m/s and 2.5 m/s² take 5²/(2 · 2.5) = 5 m."""
    _, info = coast(scenario("CutIn", ego_speed=20.0, excess=-5.0, end_ttc=2.0, recovery=2.5))
    assert not info["collision"]
    assert info["gap"] == pytest.approx(5.0, abs=1e-6)
    assert coast(scenario("CutIn", ego_speed=20.0, excess=-5.0, end_ttc=2.0, recovery=1.2))[1]["collision"]


def test_random_cut_ins():
    for made in drawn("CutInThreat"):
        (other,) = made.actors
        slower_by = (made.ego_speed - other.speed) * 3.6
        change = sum(bend.length for bend in other.path[1:]) / other.speed
        assert 5.0 <= slower_by <= 40.0 + 1e-9
        assert 30.0 <= made.ego_speed * 3.6 <= 130.0
        assert 2.5 <= change <= 5.0 + 1e-9
    assert {actor.lateral_offset for made in drawn("CutInThreat") for actor in made.actors} == {3.5, -3.5}


def test_random_leads():
    closing = [(made.ego_speed - made.actors[0].speed) * 3.6 for made in drawn("ClosingLead", 400)]
    assert 5.0 <= min(closing) < 6.0
    assert 80.0 < max(closing) < 130.0
    assert 0.3 < np.mean(np.array(closing) < 20.0) < 0.8
    braking = [made.actors[0] for made in drawn("HardBrakingLead", 400)]
    strengths = [-actor.profile[0].acceleration for actor in braking]
    headways = [actor.gap / actor.speed for actor in braking]
    for values, low, high in ((strengths, 2.0, 9.0), (headways, 0.5, 2.0)):
        assert low <= min(values) < low + 0.1
        assert high - 0.1 < max(values) <= high


@compiled_only
def test_a_rolling_car_yields():
    """At 4 m/s it covers 4 · 4 + (4 + 2)/2 = 19 m in 5 s, and comes to rest another 1 m ahead."""
    made = scenario("CCFhos", ego_speed=10.0, target_speed=4.0, yields=True)
    check_actor(
        made.actors[0],
        gap=50.0 + 19.0,
        heading=pi,
        speed=4.0,
        profile=(Segment(start=4.0, acceleration=-2.0),),
    )
    contact, info = coast(made)
    assert contact == pytest.approx(5.0, abs=1 / 30)
    assert info["relative_impact_speed"] == pytest.approx(12.0)
    assert scenario("CCFhos") == scenario("CCFhos", yields=False)


def test_persons_in_the_lane():
    check_actor(
        scenario("CPLA", ego_speed=10.0, walking_speed=0.0, lying=True).actors[0],
        gap=50.0, kind="box", length=0.5, width=1.8, height=0.3,
    )  # fmt: skip
    check_actor(
        scenario("CPLA", ego_speed=10.0, walking_speed=0.0, lying=True, child=True).actors[0],
        gap=50.0, kind="box", length=0.298, width=1.154, height=0.2,
    )  # fmt: skip
    check_actor(
        scenario("CPLA", ego_speed=10.0, walking_speed=0.0, child=True).actors[0],
        gap=50.0, kind="pedestrian", length=0.711, width=0.298, height=1.154,
    )  # fmt: skip
    invalid("CPLA", r"lying requires walking_speed=0, got 1.38\d+ m/s", lying=True)


def test_road_users_towards_the_ego():
    check_actor(
        scenario("CPLA", ego_speed=10.0, walking_speed=2.0, towards=True, impact_location=0.75).actors[0],
        gap=50.0 + 4.75 * 2.0, lateral_offset=0.45, heading=pi, speed=2.0, kind="pedestrian", length=0.6,
        width=0.5, height=1.8, profile=(Segment(start=4.0, acceleration=-1.0),),
    )  # fmt: skip
    faster = scenario("CBLA", ego_speed=3.0, bicycle_speed=4.0, towards=True)
    check_actor(
        faster.actors[0],
        gap=15.0 + 4.75 * 4.0, heading=pi, speed=4.0, kind="bicycle", length=1.89, width=0.5, height=1.86,
        profile=(Segment(start=4.0, acceleration=-2.0),),
    )  # fmt: skip
    invalid("CBLA", "bicycle_speed must be below ego_speed", ego_speed=3.0, bicycle_speed=4.0)


def test_boxes_in_the_lane_and_next_to_it():
    for name, low, high in (("LowBox", 0.2, 1.2), ("BoxPass", 0.2, 2.5)):
        heights = [made.actors[0].height for made in drawn(name, 400)]
        assert low <= min(heights) < low + 0.05
        assert high - 0.05 < max(heights) <= high
    beside = scenario("StandingBox", ego_speed=10.0, width=1.0, clearance=0.6)
    assert beside.actors[0].lateral_offset == pytest.approx(-(0.9 + 0.5 + 0.6))
    left = scenario("StandingBox", ego_speed=10.0, width=1.0, clearance=0.6, left=True)
    assert left.actors[0].lateral_offset == pytest.approx(2.0)
    invalid("StandingBox", "both set the lateral position", lateral_offset=0.1, clearance=0.6)
    invalid("StandingBox", "left=True requires clearance", left=True)
    cover = scenario("SteelPlate", ego_speed=10.0, length=0.6, width=0.7).actors[0]
    assert (cover.kind, cover.length, cover.width, cover.height) == ("road_marking", 0.6, 0.7, 0.025)
    plate = scenario("SteelPlate").actors[0]
    assert (plate.length, plate.width) == (3.7, 2.4)


def test_passed_persons_and_cars():
    child = scenario("PedestrianPass", ego_speed=10.0, walking_speed=0.0, child=True, clearance=0.5).actors[0]
    assert (child.gap, child.lateral_offset) == (50.0, pytest.approx(-(0.9 + 0.5 + 0.149)))
    made = scenario("AdjacentPass", ego_speed=20.0, target_speed=15.0)
    check_actor(made.actors[0], gap=25.0, lateral_offset=3.5, speed=15.0)
    assert made.duration == pytest.approx((25.0 + 6.023 + 4.3) / 5.0 + 2.0)
    invalid("AdjacentPass", "target_speed must be below ego_speed 10 m/s", ego_speed=10.0, target_speed=10.0)


@compiled_only
@pytest.mark.parametrize(
    ("animal", "length", "width", "height"),
    [("dog", 0.9, 0.3, 0.6), ("boar", 1.5, 0.5, 0.8), ("deer", 1.2, 0.4, 1.1), ("moose", 2.6, 0.8, 2.0)],
)
def test_animals_cross_at_the_impact_location(animal, length, width, height):
    arguments = {"ego_speed": 20.0, "animal": animal, "animal_speed": 4.0, "side": "left"}
    made = scenario("AnimalCrossing", **arguments, impact_location=0.25)
    (runner,) = made.actors
    assert (runner.kind, runner.length, runner.width, runner.height) == ("box", length, width, height)
    assert runner.gap == pytest.approx(100.0 + width / 2 - length / 2)
    assert runner.lateral_offset == pytest.approx(20.0 - 0.45)
    contact, info = coast(made)
    assert contact == pytest.approx(5.0, abs=1 / 30)
    assert (info["impact_speed"], info["relative_impact_speed"]) == pytest.approx((20.0, 20.0))
    # It clears 1 s before the ego arrives: its centre is 0.9 m, half its length and 4 m further on.
    clears = scenario("AnimalCrossing", **arguments, clear_by=1.0).actors[0]
    assert clears.lateral_offset == pytest.approx(20.0 - (0.9 + length / 2 + 4.0))
    invalid("AnimalCrossing", "both set the position of the animal", impact_location=0.25, clear_by=1.0)


@compiled_only
def test_the_second_threat_of_a_car():
    """At 20 m/s and 6 m/s² the car loses 12 m/s in 2 s and 12 m; 8 m are left, at 12 m/s."""
    made = scenario("SecondThreat", ego_speed=20.0, headway=1.0, deceleration=6.0, pause=4.0)
    first, second = made.actors
    contact = 3.5 + 2.0 + 8.0 / 12.0
    assert first.profile[0] == Segment(start=3.5, acceleration=-6.0, final_speed=8.0)
    assert first.profile[1] == Segment(start=contact + 0.5 + 3.0, acceleration=2.0, final_speed=20.0)
    # 70 m, 28 m while braking, and 8 m/s for 2/3 + 0.5 s.
    assert first.path[0].length == pytest.approx(70.0 + 28.0 + 8.0 * (8.0 / 12.0 + 0.5))
    assert sum(bend.length for bend in first.path[1:]) == pytest.approx(24.0)
    assert second.gap == pytest.approx(20.0 * (contact + 4.0))
    time, info = coast(made)
    assert time == pytest.approx(contact, abs=1 / 30)
    assert info["relative_impact_speed"] == pytest.approx(12.0)
    # With a headway of 10 m and 8 m/s², the contact is while the car brakes: 8 / 2 · t² = 10.
    early = scenario("SecondThreat", ego_speed=20.0, headway=0.5, deceleration=8.0)
    assert coast(early)[0] == pytest.approx(3.5 + (20.0 / 8.0) ** 0.5, abs=1 / 30)


@compiled_only
def test_the_second_threat_needs_a_second_brake():
    """An ego that releases the brake after the first threat has contact with the standing car."""
    for first in ("car", "pedestrian"):
        made = scenario("SecondThreat", ego_speed=12.0, first=first)
        env = BrakingEnv(made)
        env.reset(seed=0)
        ended = False
        while not ended:  # brakes for the first threat until 1.5 s after its contact, but not to rest
            time = env.simulation.times[0]
            slow = env.ego.speed < 4.0
            braking = 3.9 < time < 7.5 and not slow
            *_, terminated, truncated, info = env.step(np.array([-1.0 if braking else 0.0], np.float32))
            ended = terminated or truncated
        assert info["collision"]
        assert env.simulation.times[0] > 8.0
        assert env.ego.position[0] > env.road.vehicles[-1].position[0] - 10.0
