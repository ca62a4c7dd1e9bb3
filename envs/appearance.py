"""Choice of the world and of the camera condition of episodes."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from lgmd_gym.camera import CLEAR, CONDITIONS
from lgmd_gym.camera.worlds import SPLIT_WORLDS, check_world
from lgmd_gym.errors import check_known

MIXED = "mixed"
"""The condition that each world has by itself."""
_MIX = (CLEAR, "night", "fog", "rain")


@dataclass(frozen=True, slots=True, kw_only=True)
class Appearance:
    """World and camera condition of the episodes of an environment.

    Attributes:
        world: Number of the world, or "laboratory"; None to draw a world of the split at each reset.
        condition: Camera condition, or "mixed" for that of the world.
        split: Split of the drawn worlds, see `lgmd_gym.camera.worlds.SPLIT_WORLDS`.

    Raises:
        ValueError: If a world, condition or split is unknown.
    """

    world: int | str | None = None
    condition: str = CLEAR
    split: str = "train"

    def __post_init__(self) -> None:
        if self.world is not None and check_world(self.world) is not None:
            object.__setattr__(self, "world", check_world(self.world))
        check_known("condition", self.condition, (*CONDITIONS, MIXED))
        check_known("split of worlds", self.split, SPLIT_WORLDS)

    def draw(self, rng: np.random.Generator) -> dict[str, Any]:
        """Return the camera fields `world` and `condition` of an episode; a fixed world takes no draw."""
        if self.world is None:
            worlds = SPLIT_WORLDS[self.split]
            world = int(rng.integers(worlds.start, worlds.stop))
        else:
            world = check_world(self.world)
        return camera_fields(world, self.condition)


def camera_fields(world: int | None, condition: str) -> dict[str, Any]:
    """Return the camera fields of a world, None for the laboratory, under a condition or "mixed"."""
    if condition == MIXED:
        condition = CLEAR if world is None else world_condition(world)
    return {"world": world, "condition": condition}


def world_condition(world: int) -> str:
    """Return the camera condition that a world has by itself: clear, night, fog or rain."""
    return _MIX[int(np.random.default_rng([world, 12]).integers(len(_MIX)))]
