"""Bounds of scenarios: every distance, time and offset is computed by hand.

The ego is 4.3 m by 1.8 m, the target car 4.023 m by 1.712 m, a lane is 3.5 m wide, and the first possible
contact is 5 s after the start.
"""

import numpy as np
import pytest

from lgmd_gym.envs.dynamics.bodies import BICYCLE, CAR, EGO, PEDESTRIAN
from lgmd_gym.envs.dynamics.longitudinal import SpeedProfile
from lgmd_gym.envs.dynamics.script import Segment
from lgmd_gym.envs.families.family import make_scenario
from lgmd_gym.envs.families.road_users import run_up
from lgmd_gym.envs.families.scenario import Actor, RoadPlan, Scenario
from lgmd_gym.envs.physics_state import place


def test_highest_scripted_speed():
    profile = (Segment(start=1.0, acceleration=1.0, final_speed=12.0),)
    assert Scenario(family="x", ego_speed=10.0, duration=1.0, ego_profile=profile).top_speed == 12.0
    braking = (Segment(start=1.0, acceleration=-1.0, final_speed=12.0),)
    assert Scenario(family="x", ego_speed=14.0, duration=1.0, ego_profile=braking).top_speed == 14.0
    assert Scenario(family="x", ego_speed=0.0, duration=1.0, ego_profile=profile).top_speed == 12.0
    with pytest.raises(ValueError, match="ego_speed"):
        Scenario(family="x", ego_speed=0.0, duration=1.0)
    with pytest.raises(ValueError, match="duration must be > 0"):
        Scenario(family="x", ego_speed=1.0, duration=0.0)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("gap", -1000, 1000), ("lateral_offset", -500, 500), ("speed", 0, 40), ("shade", 0, 255),
        ("length", 0, 1000), ("width", 0, 1000), ("height", 0, 1000),
    ],
)  # fmt: skip
def test_bounds_of_an_actor(name, low, high):
    for value in (low, high):
        Actor(**{"gap": 1.0, name: value})
    for value in (low - 0.001, high + 0.001):
        with pytest.raises(ValueError, match=name):
            Actor(**{"gap": 1.0, name: value})


def test_segments_are_in_order():
    late, early = (Segment(start=start, acceleration=1.0) for start in (2.0, 1.0))
    assert Actor(gap=1.0, profile=(early, late)).profile == (early, late)
    with pytest.raises(ValueError, match="order of their start"):
        Actor(gap=1.0, profile=(late, early))
    with pytest.raises(ValueError, match="unknown actor kind 'cr'; did you mean 'car'"):
        Actor(gap=1.0, kind="cr")


def test_lanes_of_a_road():
    assert not RoadPlan().relative_to_ego
    assert RoadPlan(kind="curve").relative_to_ego
    assert (RoadPlan().lanes, RoadPlan().ego_lane) == (3, 1)
    for lane in (0, 2):
        RoadPlan(ego_lane=lane)
    for lane in (-1, 3):
        with pytest.raises(ValueError, match="ego_lane must be"):
            RoadPlan(ego_lane=lane)
    with pytest.raises(ValueError, match="unknown road kind"):
        RoadPlan(kind="curved")


# Default speeds of ego and target [km/h].
DEFAULTS = [
    ("CMRs", 50, 0), ("CMRb", 50, 50), ("CMCscp", 30, 30), ("CMFtap", 15, 45), ("CCFtap", 15, 45),
    ("CCFhos", 50, 50), ("CCFhol", 50, 50), ("CPNA", 40, 0), ("CPFA", 40, 0), ("CPNCO", 40, 0),
    ("CPLA", 40, 5), ("CPTA", 10, 0), ("CPRA", 4, 0), ("CBLA", 50, 15),
    # Of 3.36 s of acceleration to 15 km/h, 2.44 s are before the start: 15 · 2.44 / 3.36.
    ("CBNA", 40, 10.893), ("CBNAO", 40, 3.294), ("CBFA", 40, 11.746),
    ("BicyclePass", 30, 0), ("BottsDots", 72.4, 0), ("AdjacentBraking", 72.4, 72.4),
    ("AnimalCrossing", 80, 14.4), ("SecondThreat", 80, 80),
    ("CurveStandingCar", 72.4, 0), ("CCRsCurve", 50, 0), ("CurvePass", 50, 0), ("StandingBox", 50, 0),
        ("CCRs", 50, 0), ("CCRm", 50, 20), ("CCRb", 50, 50), ("Following", 50, 50), ("BrakeRelease", 50, 50),
        ("CCCscp", 30, 30), ("CrossingClears", 40, 40), ("AdjacentPass", 50, 0), ("PassBetween", 80, 0),
        ("Overtaken", 80, 110), ("Oncoming", 80, 80), ("CutIn", 50, 55), ("CutOut", 50, 50),
        ("EmptyRoad", 50, 0), ("SteelPlate", 80, 0), ("BridgeShadow", 80, 0), ("PedestrianPass", 30, 5),
        ("CurveGuardRail", 50, 0), ("TurnBeforeOncoming", 30, 0), ("LeadTurnsOff", 40, 40),
        ("CurveObjectOutside", 30, 0), ("LaneClosure", 40, 0),
]  # fmt: skip


@pytest.mark.parametrize(("name", "ego_kmh", "target_kmh"), DEFAULTS)
def test_default_speeds(name, ego_kmh, target_kmh):
    """A bicycle of CBNA and CBFA accelerates at the start; a pedestrian waits."""
    made = make_scenario(name)
    speeds = {"ego": made.ego_speed, "target": made.actors[0].speed if made.actors else 0.0}
    assert speeds == pytest.approx({"ego": ego_kmh / 3.6, "target": target_kmh / 3.6}, rel=1e-3)


def test_default_distances():
    assert make_scenario("Following").actors[0].gap == pytest.approx(2 * 50 / 3.6)
    assert make_scenario("CutOut").actors[0].gap == pytest.approx(1.5 * 50 / 3.6)
    assert make_scenario("PassBetween").actors[0].gap == pytest.approx(5 * 80 / 3.6)
    assert make_scenario("PedestrianPass").actors[0].gap == pytest.approx(5 * 25 / 3.6)


def test_default_sides():
    right = {"LeadTurnsOff"}
    for name in ("TurnBeforeOncoming", "LeadTurnsOff", "CurveObjectOutside", "LaneClosure", "CurveGuardRail"):
        assert make_scenario(name) == make_scenario(name, left=name not in right)
    for name in ("CCCscp", "CrossingClears"):
        assert make_scenario(name) == make_scenario(name, side="right")
    assert make_scenario("CCRs") == make_scenario("CCRs", beside=False)
    assert make_scenario("CCCscp") == make_scenario("CCCscp", from_stop=False)


def test_the_target_is_the_first_solid_actor():
    """Cars come first among the bodies, as in highway-env's lists; the target may be another one."""
    rng = np.random.default_rng(0)
    for family, kind, index in (
        ("CPNCO", PEDESTRIAN, 3),
        ("CBNA", BICYCLE, 3),
        ("CCCscp", CAR, 1),
        ("CCFhol", CAR, 1),
        ("BrakeRelease", CAR, 1),
        ("SteelPlate", EGO, 0),
        ("EmptyRoad", EGO, 0),
    ):
        placement = place(make_scenario(family), rng)
        assert (placement.target, placement.bodies[placement.target]["kind"]) == (index, kind)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("ego_length", 0.5, r"ego_length must be in \[1, 20\] m, got 0.5"),
        ("ego_width", 4.5, r"ego_width must be in \[0.5, 4\] m, got 4.5"),
        ("ego_reference", 25.0, r"ego_reference must be in \[-20, 20\] m, got 25"),
    ],
)
def test_size_of_the_ego(name, value, message):
    with pytest.raises(ValueError, match=message):
        Scenario(family="CCRs", ego_speed=10.0, duration=5.0, **{name: value})


@pytest.mark.parametrize("wait", [1.0, 0.0, -1e-4, -5e-4, -0.5, -2.0, -3.5])
def test_run_up_ends_at_the_contact(wait):
    """A road user accelerates to 4 m/s in 6 m and 3 s, and covers 8 m in the next 2 s."""
    run = run_up(5.0 + wait, 4.0, 8.0, 6.0)
    script, covered = SpeedProfile(run.speed, run.profile), 0.0
    for _ in range(1000):
        covered += script.step((5.0 + wait) / 1000)
    assert covered == pytest.approx(run.distance, abs=0.02)
    assert script.speed == pytest.approx(4.0)
    assert run.speed == 0.0 or run.speed >= 0.001
