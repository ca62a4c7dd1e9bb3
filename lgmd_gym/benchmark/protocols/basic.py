"""Suites without a protocol: first runs, all speeds, false reactions, near misses and levels."""

from lgmd_gym.benchmark.case import Suite, level_case, make_case, speed_cases
from lgmd_gym.benchmark.protocols.car_to_car_2023 import braking_lead
from lgmd_gym.camera.worlds import LABORATORY

RANDOM_LEVELS = 60
SIDES = ("left", "right")
_QUICK = (
    *speed_cases("quick", "CCRs", [10, 20, 30, 40, 50]),
    *speed_cases("quick", "CCRm", [30, 50, 70]),
    *braking_lead("quick"),
    *speed_cases("quick", "AdjacentPass", [50]),
    *speed_cases("quick", "Following", [30, 50, 80]),
    *speed_cases("quick", "EmptyRoad", [30, 50, 80]),
)
_PLACES = ({"tail": "/laboratory", "world": LABORATORY}, {"tail": "/worlds"})
_OVERVIEW = tuple(
    case
    for place in _PLACES
    for case in (
        *speed_cases("overview", "CCRs", [20, 30, 40, 50], **place),
        *speed_cases("overview", "CCRm", [30, 50, 70], **place),
        *speed_cases("overview", "AdjacentPass", [50], **place),
        *speed_cases("overview", "Following", [50], **place),
        *speed_cases("overview", "EmptyRoad", [50, 80], **place),
    )
)
_SPEEDS = (
    *speed_cases("speeds", "CCRs", list(range(10, 85, 5))),
    *speed_cases("speeds", "CCRm", list(range(30, 85, 10))),
    *braking_lead("speeds"),
    *speed_cases("speeds", "AdjacentPass", list(range(30, 90, 10))),
    *speed_cases("speeds", "Following", list(range(30, 120, 20))),
    *speed_cases("speeds", "EmptyRoad", list(range(30, 120, 20))),
)
_FALSE_REACTION = (
    *(
        make_case("false-reaction", family, side, left=side == "left")
        for family in ("TurnBeforeOncoming", "LeadTurnsOff", "CurveObjectOutside")
        for side in SIDES
    ),
    *(make_case("false-reaction", "LaneClosure", f"v40/{side}", left=side == "left") for side in SIDES),
    *speed_cases("false-reaction", "PassBetween", [60], inner_gap=4.5),  # GB 39901-2025
    *speed_cases("false-reaction", "PassBetween", [80], wheel_gap=4.5),  # 49 CFR 571.127 S9.3
    *speed_cases("false-reaction", "SteelPlate", [60, 80]),
    *speed_cases("false-reaction", "Overtaken", [50, 80, 110]),
    *speed_cases("false-reaction", "Oncoming", [50, 80]),
    *speed_cases("false-reaction", "AdjacentPass", [40, 60, 80], tail="/queue6", cars=6),
    *speed_cases("false-reaction", "AdjacentPass", [40, 60, 80], tail="/right", lateral_offset=-3.5),
    *speed_cases("false-reaction", "Following", [30, 50, 80, 100]),
    *speed_cases("false-reaction", "CutOut", [50, 80]),
    *speed_cases("false-reaction", "BridgeShadow", [50, 80]),
    *speed_cases("false-reaction", "EmptyRoad", [30, 50, 80, 110]),
    *(make_case("false-reaction", "CurveGuardRail", f"v50/{side}", left=side == "left") for side in SIDES),
)
_NEAR_MISS = (
    *speed_cases("near-miss", "BrakeRelease", [50, 80]),
    *speed_cases("near-miss", "BrakeRelease", [50, 80], tail="/shadow", shadow_length=12.0),
    *speed_cases("near-miss", "CutIn", [50, 80]),
    *speed_cases("near-miss", "CrossingClears", [30, 40, 50], tail="/right", side="right"),
    *speed_cases("near-miss", "CrossingClears", [30, 40, 50], tail="/left", side="left"),
    *speed_cases("near-miss", "PedestrianPass", [30, 50]),
    *speed_cases("near-miss", "BicyclePass", [30, 50]),
)
SUITES = (
    Suite(
        name="overview",
        cases=_OVERVIEW,
        about="the same approaches and drives in the laboratory and in worlds; the default of bench",
    ),
    Suite(name="quick", cases=_QUICK, about="a few cases of the simplest families, for a first run"),
    Suite(
        name="speeds", cases=_SPEEDS, about="aligned approaches and driving without a threat at all speeds"
    ),
    Suite(
        name="false-reaction",
        cases=_FALSE_REACTION,
        about="driving in which braking is a false activation",
    ),
    Suite(name="near-miss", cases=_NEAR_MISS, about="near misses that resolve without braking"),
    Suite(
        name="random",
        cases=tuple(level_case("random", "test", number) for number in range(RANDOM_LEVELS)),
        about="test levels of RandomBraking, light and weather included; levels are fixed, so use --seeds 1",
    ),
)
