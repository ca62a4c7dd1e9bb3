"""Random distribution over the scenario families, divided into numbered levels for training and tuning."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from lgmd_gym.camera import CONDITIONS
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.scenarios.registry import make_scenario
from lgmd_gym.envs.scenarios.scenario import Scenario
from lgmd_gym.errors import check_items, check_known, check_whole

SPLITS = ("train", "validation", "test")
LEVELS = 1_000_000  # per split
THREAT_SHARE = 0.5
SPEED_KMH = (10.0, 80.0)
HEADWAY = (0.5, 3.0)  # [s]; in FMVSS 127 a lead car brakes 12 m ahead at 80 km/h, a headway of 0.54 s


def check_levels(split: str, start_level: int, num_levels: int, conditions: Sequence[str]) -> tuple[int, int]:
    """Check the arguments of `RandomLevels`, and return the first level and the number of levels.

    Raises:
        ValueError: If the split or a condition is unknown, or levels are outside the split.
    """
    check_known("split", split, SPLITS)
    check_conditions(conditions)
    first = check_whole("start_level", start_level, 0, LEVELS - 1)
    return first, check_whole("num_levels", num_levels, 0, LEVELS - first)  # 0 for all


def check_conditions(conditions: Sequence[str]) -> None:
    """Raise ValueError for an unknown camera condition or an empty sequence."""
    if not check_items("conditions", conditions, str):
        raise ValueError("conditions needs at least one name, got none")
    for condition in conditions:
        check_known("condition", condition, CONDITIONS)


def level_generator(split: str, level: int, part: int = 0) -> np.random.Generator:
    """Return the random generator of a level; `part` selects one of its independent streams."""
    return np.random.default_rng([SPLITS.index(split), level, *([part] if part else [])])


def draw_camera_fields(split: str, level: int, conditions: Sequence[str]) -> dict[str, Any]:
    """Return the camera fields of a level: a condition, and the contrast of the ground texture in [0.5, 1.5].

    They are drawn from a separate random stream, so that the scenario does not depend on `conditions`.
    """
    rng = level_generator(split, level, part=1)
    texture = float(rng.uniform(0.5, 1.5))
    return {"condition": conditions[int(rng.integers(len(conditions)))], "texture": texture}


def draw_scenario(rng: np.random.Generator) -> Scenario:
    """Return a random scenario: a threat with probability `THREAT_SHARE`, otherwise a non-threat."""
    families = THREATS if rng.random() < THREAT_SHARE else NON_THREATS
    names = list(families)
    name = names[int(rng.integers(len(names)))]
    return make_scenario(name, **families[name](rng))


def _speed(rng: np.random.Generator, low: float = SPEED_KMH[0], high: float = SPEED_KMH[1]) -> float:
    return float(rng.uniform(low, high)) * KMH


def _flag(rng: np.random.Generator) -> bool:
    return bool(rng.random() < 0.5)


def _side(rng: np.random.Generator) -> str:
    return "left" if _flag(rng) else "right"


def _overlap(rng: np.random.Generator) -> float:
    """Return 1 (aligned) with probability 0.5, otherwise an overlap of 0.4 to 1 on either side."""
    if _flag(rng):
        return 1.0
    return float(rng.uniform(0.4, 1.0)) * (1.0 if _flag(rng) else -1.0)


def _moving(rng: np.random.Generator) -> dict[str, Any]:
    speed = _speed(rng, 30.0)
    return {
        "ego_speed": speed,
        "target_speed": speed * float(rng.uniform(0.2, 0.7)),
        "overlap": _overlap(rng),
    }


def _braking(rng: np.random.Generator) -> dict[str, Any]:
    return {
        "ego_speed": _speed(rng, 30.0),
        "headway": float(rng.uniform(*HEADWAY)),
        "deceleration": float(rng.uniform(2.0, 6.0)),
        "build_up": float(rng.uniform(0.3, 1.0)),
        "overlap": _overlap(rng),
    }


def _adjacent(rng: np.random.Generator) -> dict[str, Any]:
    offset = float(rng.uniform(3.0, 3.7)) * (1.0 if _flag(rng) else -1.0)
    return {"ego_speed": _speed(rng), "lateral_offset": offset, "cars": int(rng.integers(1, 7))}


def _rail(rng: np.random.Generator) -> dict[str, Any]:
    radius = float(rng.uniform(40.0, 200.0))
    top = min(SPEED_KMH[1], (3.5 * radius) ** 0.5 / KMH)
    return {"ego_speed": _speed(rng, 20.0, top), "radius": radius, "left": _flag(rng)}


# Functions that draw the arguments of each family.
THREATS: dict[str, Any] = {
    "CCRs": lambda rng: {"ego_speed": _speed(rng), "overlap": _overlap(rng)},
    "CCRm": _moving,
    "CCRb": _braking,
    "CCCscp": lambda rng: {
        "ego_speed": _speed(rng, 20.0, 60.0),
        "target_speed": _speed(rng, 20.0, 60.0),
        "side": _side(rng),
    },
}
NON_THREATS: dict[str, Any] = {
    "Following": lambda rng: {"ego_speed": _speed(rng), "headway": float(rng.uniform(*HEADWAY))},
    "BrakeRelease": lambda rng: {
        "ego_speed": _speed(rng, 40.0),
        "headway": float(rng.uniform(1.5, 2.5)),
        "speed_drop": float(rng.uniform(2.0, 5.0)),
    },
    "AdjacentPass": _adjacent,
    "PassBetween": lambda rng: {"ego_speed": _speed(rng, 30.0), "inner_gap": float(rng.uniform(4.0, 5.0))},
    "Overtaken": lambda rng: {"ego_speed": _speed(rng, 30.0), "excess": _speed(rng, 10.0, 40.0)},
    "Oncoming": lambda rng: {"ego_speed": _speed(rng, 30.0), "oncoming_speed": _speed(rng, 30.0)},
    "CutIn": lambda rng: {"ego_speed": _speed(rng, 30.0), "gap": float(rng.uniform(10.0, 25.0))},
    "CutOut": lambda rng: {"ego_speed": _speed(rng, 30.0), "headway": float(rng.uniform(1.2, 2.5))},
    "EmptyRoad": lambda rng: {"ego_speed": _speed(rng)},
    "SteelPlate": lambda rng: {"ego_speed": _speed(rng, 30.0), "shade": int(rng.integers(110, 200))},
    "BridgeShadow": lambda rng: {"ego_speed": _speed(rng, 30.0), "length": float(rng.uniform(5.0, 20.0))},
    "PedestrianPass": lambda rng: {
        "ego_speed": _speed(rng, 20.0, 50.0),
        "clearance": float(rng.uniform(1.0, 1.5)),
    },
    "CurveGuardRail": _rail,
    "CrossingClears": lambda rng: {
        "ego_speed": _speed(rng, 20.0, 60.0),
        "target_speed": _speed(rng, 20.0, 60.0),
        "side": _side(rng),
        "clear_by": float(rng.uniform(1.2, 2.5)),
    },
    "TurnBeforeOncoming": lambda rng: {"left": _flag(rng)},
    "LeadTurnsOff": lambda rng: {"left": _flag(rng)},
    "CurveObjectOutside": lambda rng: {"left": _flag(rng)},
    "LaneClosure": lambda rng: {"ego_speed": _speed(rng, 25.0, 55.0), "left": _flag(rng)},
}
