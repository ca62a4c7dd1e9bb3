"""Choice of the scene of episodes: world, weather, and road that moves the car's body."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Self

import numpy as np

from lgmd_gym.aliases import Arguments
from lgmd_gym.camera.scene import CLEAR, ROADS, WEATHERS, Scene, Weather
from lgmd_gym.camera.worlds import LABORATORY, SPLIT_WORLDS, check_world
from lgmd_gym.envs.dynamics.brake import BrakeParams, draw_brake
from lgmd_gym.errors import check_known
from lgmd_gym.fields import Record, choice, optional, record, value

MIXED = "mixed"
"""The weather that each world has by itself."""
_MIX = (CLEAR, "night", "fog", "rain")


def _check_world(_: str, world: Any) -> int | str | None:
    return world if world is None or check_world(world) is None else check_world(world)


def _check_weather(_: str, weather: Any) -> str | Weather:
    if isinstance(weather, str):
        return check_known("weather", weather, (*WEATHERS, MIXED))
    return Weather.make(weather)


@record
class Appearance(Record):
    """World, weather and road of the episodes of an environment."""

    world: int | str | None = value(
        None,
        _check_world,
        f"Number of the world, or {LABORATORY!r}; None to draw a world of the split at each reset.",
    )
    weather: str | Weather = value(
        CLEAR, _check_weather, f"Named weather, `Weather` or its fields, or {MIXED!r} for that of the world."
    )
    road: str | None = optional(
        choice(
            None,
            tuple(ROADS),
            "Road that moves the car's body, see `Scene.road`; None for `normal` in a numbered world and "
            "`still` in the laboratory",
        )
    )
    split: str = value(
        "train",
        lambda _, split: check_known("split of worlds", split, SPLIT_WORLDS),
        "Split of the drawn worlds, see `lgmd_gym.camera.worlds.SPLIT_WORLDS`.",
    )
    scene: Scene = value(Scene(), lambda _, scene: Scene.make(scene), "The other fields of the scene.")

    @classmethod
    def of(cls, scene: Scene | Mapping[str, object] | None = None, **arguments: Any) -> Self:
        """Return the appearance for a scene, whose world, weather and road are defaults of the arguments.

        Args:
            scene: A `Scene` or a mapping of its fields; None for the default scene.
            **arguments: Fields of `Appearance`; None for those of the scene.
        """
        chosen = Scene.make(scene)
        if isinstance(scene, Scene):
            given: Arguments = {"world": chosen.world, "weather": chosen.weather, "road": chosen.road}
        else:
            fields = scene or {}
            given = {key: fields[key] for key in ("world", "weather", "road") if key in fields}
        if "world" in given and given["world"] is None:
            given["world"] = LABORATORY
        return cls(**given | {key: item for key, item in arguments.items() if item is not None}, scene=chosen)

    def draw(self, rng: np.random.Generator) -> Scene:
        """Return the scene of an episode; a fixed world takes no draw."""
        if self.world is None:
            worlds = SPLIT_WORLDS[self.split]
            world = int(rng.integers(worlds.start, worlds.stop))
        else:
            world = check_world(self.world)
        weather, road = self.weather, self.road
        if weather == MIXED:
            weather = CLEAR if world is None else world_weather(world)
        if road is None:
            road = "still" if world is None else "normal"
        return replace(self.scene, world=world, weather=Weather.make(weather), road=road)


def brake_of(scene: Scene) -> BrakeParams | None:
    """Return the brake of the world of a scene, weaker on a wet road; None in the laboratory."""
    return None if scene.world is None else draw_brake(scene.world, scene.weather.wet)


def world_weather(world: int) -> str:
    """Return the weather that a world has by itself: clear, night, fog or rain."""
    return _MIX[int(np.random.default_rng([world, 12]).integers(len(_MIX)))]
