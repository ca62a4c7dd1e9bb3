"""Choice of the world and of the camera condition of episodes."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from lgmd_gym.camera import CLEAR, CONDITIONS
from lgmd_gym.camera.params import ROADS
from lgmd_gym.camera.worlds import SPLIT_WORLDS, check_world
from lgmd_gym.envs.dynamics.brake import BrakeParams, draw_brake
from lgmd_gym.errors import check_known

MIXED = "mixed"
"""The condition that each world has by itself."""
_MIX = (CLEAR, "night", "fog", "rain")


@dataclass(frozen=True, slots=True, kw_only=True)
class Appearance:
    """World, camera condition and motion of the car's body in the episodes of an environment.

    Attributes:
        world: Number of the world, or "laboratory"; None to draw a world of the split at each reset.
        condition: Camera condition, or "mixed" for that of the world.
        road: Road that moves the car's body, see `CameraParams.road`; None for "normal" in a numbered world
            and "still" in the laboratory.
        split: Split of the drawn worlds, see `lgmd_gym.camera.worlds.SPLIT_WORLDS`.

    Raises:
        ValueError: If a world, condition, road or split is unknown.
    """

    world: int | str | None = None
    condition: str = CLEAR
    road: str | None = None
    split: str = "train"

    def __post_init__(self) -> None:
        if self.world is not None and check_world(self.world) is not None:
            object.__setattr__(self, "world", check_world(self.world))
        check_known("condition", self.condition, (*CONDITIONS, MIXED))
        if self.road is not None:
            check_known("road", self.road, ROADS)
        check_known("split of worlds", self.split, SPLIT_WORLDS)

    def draw(self, rng: np.random.Generator) -> dict[str, Any]:
        """Return the camera fields `world`, `condition` and `road` of an episode.

        A fixed world takes no draw.
        """
        if self.world is None:
            worlds = SPLIT_WORLDS[self.split]
            world = int(rng.integers(worlds.start, worlds.stop))
        else:
            world = check_world(self.world)
        return camera_fields(world, self.condition, self.road)


def camera_fields(world: int | None, condition: str, road: str | None) -> dict[str, Any]:
    """Return the camera fields of a world, None for the laboratory; see `Appearance`."""
    if condition == MIXED:
        condition = CLEAR if world is None else world_condition(world)
    if road is None:
        road = "still" if world is None else "normal"
    return {"world": world, "condition": condition, "road": road}


def world_number(fields: dict[str, Any]) -> int:
    """Return the number of the world among camera fields, -1 in the laboratory."""
    return -1 if fields["world"] is None else fields["world"]


def brake_of(fields: dict[str, Any]) -> BrakeParams | None:
    """Return the brake of the world among camera fields; None in the laboratory.

    The road is wet under the condition "rain".
    """
    world = fields["world"]
    wet = bool(CONDITIONS[fields["condition"]].get("wet", False))
    return None if world is None else draw_brake(world, wet)


def world_condition(world: int) -> str:
    """Return the camera condition that a world has by itself: clear, night, fog or rain."""
    return _MIX[int(np.random.default_rng([world, 12]).integers(len(_MIX)))]
