"""Suites: named, frozen lists of cases. Case names are in km/h, arguments in SI units."""

from dataclasses import dataclass

from lgmd_gym.benchmark.case import Case, level_case, make_case, speed_cases
from lgmd_gym.benchmark.protocols.car_to_car_2023 import braking_lead, ncap2023
from lgmd_gym.benchmark.protocols.frontal_2026 import ncap2026, ncap2026_extended, ncap2026_robustness
from lgmd_gym.benchmark.protocols.regulations import (
    fmvss127,
    fmvss127_pedestrian,
    nhtsa_manoeuvres,
    r152,
    r152_vru,
)
from lgmd_gym.benchmark.protocols.vulnerable_2023 import ncap2023_vru
from lgmd_gym.benchmark.protocols.without_target import SUFFIX, without_targets
from lgmd_gym.errors import check_known, check_text, unknown_name

TRAFFIC = "traffic"  # the suite without cases, see `lgmd_gym.benchmark.traffic`
RANDOM_LEVELS = 60
SIDES = ("left", "right")


@dataclass(frozen=True, slots=True)
class Suite:
    """A named list of cases.

    Attributes:
        name: Name of the suite, the first part of every case name.
        cases: Cases in the order in which they run.
        about: One line on its source and limits.
    """

    name: str
    cases: tuple[Case, ...]
    about: str


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


_ALL = (
    Suite("quick", _quick(), "a few cases of the simplest families, for a first run"),
    Suite("speeds", _speeds(), "aligned approaches and driving without a threat at all speeds"),
    Suite(
        "ncap2023",
        ncap2023(),
        "Euro NCAP AEB Car-to-Car 2023: CCRs, CCRm, CCRb, CCCscp, CCFtap, CCFhos, CCFhol",
    ),
    Suite("ncap2023-vru", ncap2023_vru(), "Euro NCAP AEB VRU 2023: pedestrians, bicycles, CMFtap, by day"),
    Suite(
        "ncap2026",
        ncap2026(),
        "Euro NCAP Frontal Collisions 2026: standard range",
    ),
    Suite("ncap2026-extended", ncap2026_extended(), "Euro NCAP Frontal Collisions 2026: extended range"),
    Suite(
        "ncap2026-robustness",
        ncap2026_robustness(),
        "Euro NCAP Frontal Collisions 2026: public part of the robustness layer",
    ),
    Suite(
        "r152",
        r152(),
        "UN R152 car-to-car tests, for the impact-speed limits of 5.2.1.4 only",
    ),
    Suite(
        "fmvss127",
        fmvss127(),
        "49 CFR 571.127 lead-vehicle tests without manual braking, without its warning requirement",
    ),
    Suite("r152-vru", r152_vru(), "UN R152 pedestrian and bicycle tests, for the impact-speed limits only"),
    Suite(
        "fmvss127-pedestrian",
        fmvss127_pedestrian(),
        "49 CFR 571.127 pedestrian tests by day and with the lower and the upper beam",
    ),
    Suite(
        "nhtsa-false-activation",
        nhtsa_manoeuvres(),
        "seven track manoeuvres of NHTSA in which braking is a false activation",
    ),
    Suite("false-reaction", _false_reaction(), "driving in which braking is a false activation"),
    Suite("near-miss", _near_miss(), "near misses that resolve without braking"),
    *(
        Suite(
            name + SUFFIX,
            without_targets(name, cases),
            f"the cases of {name} without their targets, in the same worlds; braking is a false activation",
        )
        for name, cases in (("ncap2023", ncap2023()), ("ncap2023-vru", ncap2023_vru()))
    ),
    Suite(
        "random",
        tuple(level_case("random", "test", number) for number in range(RANDOM_LEVELS)),
        "test levels of RandomBraking, light and weather included; levels are fixed, so use --seeds 1",
    ),
)
SUITES: dict[str, Suite] = {suite.name: suite for suite in _ALL}


def find_suite(name: str) -> Suite:
    """Return the suite of a name.

    Raises:
        ValueError: If the name is unknown.
    """
    if check_text("suite", name) not in SUITES:
        raise unknown_name("suite", name, (*SUITES, TRAFFIC))
    return SUITES[name]


def find_case(name: str) -> Case:
    """Return the case with a full name, such as "quick/CCRs/v30".

    Raises:
        ValueError: If the name is unknown.
    """
    known = {case.name: case for suite in SUITES.values() for case in suite.cases}
    check_known("case", name, known, "lgmd-gym list cases prints all names")
    return known[name]
