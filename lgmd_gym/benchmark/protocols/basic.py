"""Suites without a protocol: first runs, all speeds, false reactions, near misses and levels."""

from lgmd_gym.benchmark.case import Case, Suite, level_case, make_case, speed_cases
from lgmd_gym.benchmark.protocols.car_to_car_2023 import braking_lead

RANDOM_LEVELS = 60
SIDES = ("left", "right")


def _quick() -> tuple[Case, ...]:
    """Return a few cases of the simplest families, for a first run."""
    return (
        *speed_cases("quick", "CCRs", [10, 20, 30, 40, 50]),
        *speed_cases("quick", "CCRm", [30, 50, 70]),
        *braking_lead("quick"),
        *speed_cases("quick", "AdjacentPass", [50]),
        *speed_cases("quick", "Following", [30, 50, 80]),
        *speed_cases("quick", "EmptyRoad", [30, 50, 80]),
    )


def _speeds() -> tuple[Case, ...]:
    """Return aligned approaches and driving without a threat over the whole range of speeds."""
    return (
        *speed_cases("speeds", "CCRs", list(range(10, 85, 5))),
        *speed_cases("speeds", "CCRm", list(range(30, 85, 10))),
        *braking_lead("speeds"),
        *speed_cases("speeds", "AdjacentPass", list(range(30, 90, 10))),
        *speed_cases("speeds", "Following", list(range(30, 120, 20))),
        *speed_cases("speeds", "EmptyRoad", list(range(30, 120, 20))),
    )


def _false_reaction() -> tuple[Case, ...]:
    """Return cases in which braking is a false activation."""
    suite = "false-reaction"
    turns: list[Case] = []
    for family in ("TurnBeforeOncoming", "LeadTurnsOff", "CurveObjectOutside"):
        for side in SIDES:
            turns.append(make_case(suite, family, side, left=side == "left"))
    return (
        *turns,
        *(make_case(suite, "LaneClosure", f"v40/{side}", left=side == "left") for side in SIDES),
        *speed_cases(suite, "PassBetween", [60], inner_gap=4.5),  # GB 39901-2025
        *speed_cases(suite, "PassBetween", [80], wheel_gap=4.5),  # 49 CFR 571.127 S9.3
        *speed_cases(suite, "SteelPlate", [60, 80]),
        *speed_cases(suite, "Overtaken", [50, 80, 110]),
        *speed_cases(suite, "Oncoming", [50, 80]),
        *speed_cases(suite, "AdjacentPass", [40, 60, 80], tail="/queue6", cars=6),
        *speed_cases(suite, "AdjacentPass", [40, 60, 80], tail="/right", lateral_offset=-3.5),
        *speed_cases(suite, "Following", [30, 50, 80, 100]),
        *speed_cases(suite, "CutOut", [50, 80]),
        *speed_cases(suite, "BridgeShadow", [50, 80]),
        *speed_cases(suite, "EmptyRoad", [30, 50, 80, 110]),
        *(make_case(suite, "CurveGuardRail", f"v50/{side}", left=side == "left") for side in SIDES),
    )


def _near_miss() -> tuple[Case, ...]:
    """Return near misses that resolve without braking."""
    suite = "near-miss"
    return (
        *speed_cases(suite, "BrakeRelease", [50, 80]),
        *speed_cases(suite, "BrakeRelease", [50, 80], tail="/shadow", shadow_length=12.0),
        *speed_cases(suite, "CutIn", [50, 80]),
        *speed_cases(suite, "CrossingClears", [30, 40, 50], tail="/right", side="right"),
        *speed_cases(suite, "CrossingClears", [30, 40, 50], tail="/left", side="left"),
        *speed_cases(suite, "PedestrianPass", [30, 50]),
        *speed_cases(suite, "BicyclePass", [30, 50]),
    )


SUITES = (
    Suite(name="quick", cases=_quick(), about="a few cases of the simplest families, for a first run"),
    Suite(
        name="speeds", cases=_speeds(), about="aligned approaches and driving without a threat at all speeds"
    ),
    Suite(
        name="false-reaction",
        cases=_false_reaction(),
        about="driving in which braking is a false activation",
    ),
    Suite(name="near-miss", cases=_near_miss(), about="near misses that resolve without braking"),
    Suite(
        name="random",
        cases=tuple(level_case("random", "test", number) for number in range(RANDOM_LEVELS)),
        about="test levels of RandomBraking, light and weather included; levels are fixed, so use --seeds 1",
    ),
)
