"""Suites: named, frozen lists of cases. Case names carry km/h, arguments are SI."""

from dataclasses import dataclass

from lgmd_gym.benchmark import protocols
from lgmd_gym.benchmark.case import Case, cases, level, one
from lgmd_gym.errors import unknown_name

RANDOM_LEVELS = 60


@dataclass(frozen=True, slots=True)
class Suite:
    """A named list of cases.

    Attributes:
        name: The first part of every case's name.
        cases: What is played.
        about: One line on where it comes from and what it is not.
    """

    name: str
    cases: tuple[Case, ...]
    about: str


def _quick() -> tuple[Case, ...]:
    """A few cases of the plainest families: what a newcomer runs first."""
    return (
        *cases("quick", "CCRs", [10, 20, 30, 40, 50]),
        *cases("quick", "CCRm", [30, 50, 70]),
        *protocols.braking_lead("quick"),
        *cases("quick", "AdjacentPass", [50]),
        *cases("quick", "Following", [30, 50, 80]),
        *cases("quick", "EmptyRoad", [30, 50, 80]),
    )


def _speeds() -> tuple[Case, ...]:
    """Aligned approaches and quiet driving over the whole range: where a rule stops holding."""
    return (
        *cases("speeds", "CCRs", list(range(10, 85, 5))),
        *cases("speeds", "CCRm", list(range(30, 85, 10))),
        *protocols.braking_lead("speeds"),
        *cases("speeds", "AdjacentPass", list(range(30, 90, 10))),
        *cases("speeds", "Following", list(range(30, 120, 20))),
        *cases("speeds", "EmptyRoad", list(range(30, 120, 20))),
    )


def _false_reaction() -> tuple[Case, ...]:
    """Driving in which braking is the fault."""
    suite = "false-reaction"
    turns: list[Case] = []
    for family in ("TurnBeforeOncoming", "LeadTurnsOff", "CurveObjectOutside"):
        for side in ("left", "right"):
            turns.append(one(suite, family, side, left=side == "left"))
    return (
        *turns,
        *(one(suite, "LaneClosure", f"v40/{side}", left=side == "left") for side in ("left", "right")),
        *cases(suite, "PassBetween", [60, 80]),
        *cases(suite, "SteelPlate", [60, 80]),
        *cases(suite, "Overtaken", [50, 80, 110]),
        *cases(suite, "Oncoming", [50, 80]),
        *cases(suite, "AdjacentPass", [40, 60, 80], tail="/queue6", cars=6),
        *cases(suite, "AdjacentPass", [40, 60, 80], tail="/right", lateral_offset=-3.5),
        *cases(suite, "Following", [30, 50, 80, 100]),
        *cases(suite, "CutOut", [50, 80]),
        *cases(suite, "BridgeShadow", [50, 80]),
        *cases(suite, "EmptyRoad", [30, 50, 80, 110]),
        *(one(suite, "CurveGuardRail", f"v50/{side}", left=side == "left") for side in ("left", "right")),
    )


def _near_miss() -> tuple[Case, ...]:
    """Close calls that resolve themselves."""
    suite = "near-miss"
    return (
        *cases(suite, "BrakeRelease", [50, 80]),
        *cases(suite, "CutIn", [50, 80]),
        *cases(suite, "CrossingClears", [30, 40, 50], tail="/right", side="right"),
        *cases(suite, "CrossingClears", [30, 40, 50], tail="/left", side="left"),
        *cases(suite, "PedestrianPass", [30, 50]),
    )


_ALL = (
    Suite("quick", _quick(), "a few cases of the plainest families, for a first look"),
    Suite("speeds", _speeds(), "aligned approaches and quiet driving over the whole range of speeds"),
    Suite(
        "ncap2023",
        protocols.ncap2023(),
        "Euro NCAP AEB Car-to-Car 2023: CCRs, CCRm, CCRb, CCCscp; CCFtap, CCFhos and CCFhol are not built",
    ),
    Suite(
        "ncap2026",
        protocols.ncap2026(),
        "Euro NCAP Frontal Collisions 2026: rear scenarios, standard range, and part of the robustness layer",
    ),
    Suite(
        "r152",
        protocols.r152(),
        "UN R152 car-to-car tests; for the impact-speed limits of 5.2.1.4 in simulation, nothing else of it",
    ),
    Suite(
        "fmvss127",
        protocols.fmvss127(),
        "49 CFR 571.127 lead-vehicle tests without manual braking, without its warning requirement",
    ),
    Suite("false-reaction", _false_reaction(), "driving in which braking is the fault"),
    Suite("near-miss", _near_miss(), "close calls that resolve themselves"),
    Suite(
        "random",
        tuple(level("random", "test", number) for number in range(RANDOM_LEVELS)),
        "levels of RandomBraking's test split, light and weather included; a level is fixed, take --seeds 1",
    ),
)
SUITES: dict[str, Suite] = {suite.name: suite for suite in _ALL}


def find_suite(name: str) -> Suite:
    """Return a suite, or raise ValueError that names the nearest one."""
    if name not in SUITES:
        raise unknown_name("suite", name, SUITES)
    return SUITES[name]


def find_case(name: str) -> Case:
    """Return a case by its full name, or raise ValueError that names the nearest case."""
    known = {case.name: case for suite in SUITES.values() for case in suite.cases}
    if name not in known:
        raise unknown_name("case", name, known)
    return known[name]
