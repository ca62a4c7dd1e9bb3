"""Random distribution over the scenario families, divided into numbered levels for training and tuning."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from lgmd_gym.camera import CONDITIONS
from lgmd_gym.envs.scenarios.random_arguments import NON_THREATS, THREATS
from lgmd_gym.envs.scenarios.registry import make_scenario
from lgmd_gym.envs.scenarios.scenario import Scenario
from lgmd_gym.errors import check_items, check_known, check_whole

SPLITS = ("train", "validation", "test")
LEVELS = 1_000_000  # per split
THREAT_SHARE = 0.5


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
    weights = np.cumsum([family.weight for family in families.values()])
    name = list(families)[int(np.searchsorted(weights, rng.random() * weights[-1], side="right"))]
    return make_scenario(name, **families[name].draw(rng))
