"""Random distribution over the scenario families, divided into numbered levels for training and tuning."""

from bisect import bisect_right
from collections.abc import Collection, Sequence
from itertools import accumulate
from numbers import Real

import numpy as np

from lgmd_gym.camera.scene import WEATHERS
from lgmd_gym.envs.families import LEVELS as DECLARED
from lgmd_gym.envs.families.family import Level, make_scenario
from lgmd_gym.envs.families.scenario import Scenario, without_target
from lgmd_gym.errors import check_items, check_known, check_positive, check_whole

SPLITS = ("train", "validation", "test")
LEVELS = 1_000_000  # per split
THREAT_SHARE = 0.5
ALL_FAMILIES = (
    *("CCRs", "CCRm", "CCRb", "CCCscp", "CCFtap", "CCFhos", "CCFhol", "CMRs", "CMRb", "CMCscp", "CMFtap"),
    *("CPNA", "CPFA", "CPNCO", "CPLA", "CPTA", "CPRA", "CBNA", "CBNAO", "CBFA", "CBLA"),
    *("Following", "BrakeRelease", "AdjacentPass", "PassBetween", "Overtaken", "Oncoming", "CutIn", "CutOut"),
    *("EmptyRoad", "SteelPlate", "BridgeShadow", "PedestrianPass", "CurveGuardRail", "CrossingClears"),
    *("TurnBeforeOncoming", "LeadTurnsOff", "CurveObjectOutside", "LaneClosure", "BicyclePass", "BottsDots"),
    *("AdjacentBraking", "CurveStandingCar"),
)
"""Families of the levels of the ids v0, in the order that determines which one a level contains.

A level keeps its number, family and arguments: names are neither added, removed nor moved. 41 % of the
threats are rear ends of cars.
"""
FIRST_EXTRAS = (
    *("CCRsCurve", "StandingBox", "NarrowBox", "FastCCRs", "FastCCRm", "FastCCRb"),
    *("CurvePass", "CloseBrakeRelease", "FastOvertaken", "FastEmptyRoad", "FastFollowing"),
    *("FastBrakeRelease", "FastAdjacentPass", "FastBridgeShadow"),
    *(f"{name}WithoutTarget" for name in (*ALL_FAMILIES, "CCRsCurve")),
)
"""Names of the first extra levels, in the order of their draws; those that are added later follow by name."""
_EXTRAS = DECLARED.keys() - {*ALL_FAMILIES}
EXTRA_FAMILIES = (
    *(name for name in FIRST_EXTRAS if name in _EXTRAS),
    *sorted(_EXTRAS - {*FIRST_EXTRAS}),
)
"""Families and variants that levels contain only where they are named: those that were added later, those at
the speeds of a motorway ("Fast…"), and threats without their target ("…WithoutTarget").

The usual non-threats are rarely on a road with two lanes or at a crossing: a policy that is trained on them
alone learns to brake for the road. With some threats alone, and with the same threats without their targets
alone, levels of the same number differ by the target only.
"""


def check_levels(split: str, start_level: int, num_levels: int, weathers: Sequence[str]) -> tuple[int, int]:
    """Check the arguments of `RandomLevels`, and return the first level and the number of levels.

    Raises:
        ValueError: If the split or a weather is unknown, or levels are outside the split.
    """
    check_known("split", split, SPLITS)
    check_weathers(weathers)
    first = check_whole("start_level", start_level, 0, LEVELS - 1)
    return first, check_whole("num_levels", num_levels, 0, LEVELS - first)  # 0 for all


def check_weathers(weathers: Sequence[str]) -> None:
    """Raise ValueError for an unknown weather or an empty sequence."""
    if not check_items("weathers", weathers, str):
        raise ValueError("weathers needs at least one name, got none")
    for weather in weathers:
        check_known("weather", weather, WEATHERS)


def check_families(families: Sequence[str] | None) -> tuple[str, ...]:
    """Return the names of scenario families, or `ALL_FAMILIES` for None.

    Raises:
        ValueError: For an unknown family or an empty sequence.
    """
    if families is None:
        return ALL_FAMILIES
    if not check_items("families", families, str):
        raise ValueError("families needs at least one name, got none")
    for name in families:
        check_known("family of random levels", name, (*ALL_FAMILIES, *EXTRA_FAMILIES))
    return tuple(families)


def check_range(name: str, limits: Sequence[float], unit: str) -> tuple[float, float]:
    """Return the lowest and the highest value of a quantity.

    Raises:
        ValueError: Unless they are two numbers above 0 in ascending order.
    """
    values = [check_positive(name, value) for value in check_items(name, limits, Real)]
    if len(values) != 2 or values[0] > values[1]:
        raise ValueError(f"{name} must be the lowest and the highest value [{unit}], got {values}")
    return values[0], values[1]


def level_generator(split: str, level: int, part: int = 0) -> np.random.Generator:
    """Return the random generator of a level; `part` selects one of its independent streams."""
    return np.random.default_rng([SPLITS.index(split), level, *([part] if part else [])])


def draw_weather(split: str, level: int, weathers: Sequence[str]) -> tuple[str, float]:
    """Return the weather of a level, and the contrast of the ground texture in [0.5, 1.5].

    They are drawn from a separate random stream, so that the scenario does not depend on `weathers`.
    """
    rng = level_generator(split, level, part=1)
    texture = float(rng.uniform(0.5, 1.5))
    return weathers[int(rng.integers(len(weathers)))], texture


def draw_scenario(rng: np.random.Generator, families: Collection[str] = ALL_FAMILIES) -> Scenario:
    """Return a random scenario: a threat with probability `THREAT_SHARE`, otherwise a non-threat.

    Args:
        rng: Random generator of the level.
        families: Families to draw from, with the frequencies that they have among all. Without a threat, or
            without a non-threat, all scenarios are of the other kind.
    """
    threat = bool(rng.random() < THREAT_SHARE)
    levels = [DECLARED[name] for name in (*ALL_FAMILIES, *EXTRA_FAMILIES) if name in families]
    drawn: list[Level] = [level for level in levels if level.threat is threat] or levels
    weights = list(accumulate(level.weight for level in drawn))
    level = drawn[bisect_right(weights, rng.random() * weights[-1])]
    scenario = make_scenario(level.family, **level.draw(rng))
    return scenario if level.has_target else without_target(scenario)
