"""Sources of episodes: a fixed scenario, or random levels."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np
from highway_env.road.road import RoadNetwork

from lgmd_gym.aliases import Arguments, Info
from lgmd_gym.camera.scene import WEATHERS, Scene
from lgmd_gym.camera.worlds import LABORATORY, draw_world
from lgmd_gym.envs.appearance import Appearance, brake_of
from lgmd_gym.envs.dynamics.brake import BrakeParams
from lgmd_gym.envs.families.distribution import (
    LEVELS,
    check_families,
    check_levels,
    check_range,
    draw_scenario,
    draw_weather,
    level_generator,
)
from lgmd_gym.envs.families.scenario import Scenario, free_lane
from lgmd_gym.envs.highway.network import road_network
from lgmd_gym.envs.physics_state import Placement, place
from lgmd_gym.errors import check_within

MAX_PITCH_ERROR_DEG = 1.0
MAX_HEIGHT_ERROR_M = 0.15


class Draw(NamedTuple):
    """The next episode of an environment."""

    placement: Placement  # the scenario, placed on the road
    scene: Scene  # the scene, for cameras and brake
    info: Info  # additional keys of the episode's info
    # brake of the ego in this episode; None for that of the environment's configuration. Keys given in the
    # configuration take precedence
    brake: BrakeParams | None = None

    def make_network(self) -> RoadNetwork:
        """Return the highway-env road network of the episode, with the lane width of its world."""
        width = draw_world(self.scene.world).lane_width
        return road_network(self.placement.scenario.road, self.placement.start, width)


class EpisodeSource(Protocol):
    """Draws the episodes of an environment."""

    @property
    def first(self) -> Scenario:
        """A scenario of this source, without a draw."""
        ...

    def draw(self, rng: np.random.Generator) -> Draw:
        """Return the next episode; `rng` is the environment's random generator."""
        ...


class FixedScenario:
    """The same scenario in every episode, with a random start and random grey levels.

    `info` adds `world`, the number of the world, or -1 in the laboratory.

    Args:
        scenario: The scenario.
        appearance: World, weather and road; None for the laboratory.
    """

    def __init__(self, scenario: Scenario, appearance: Appearance | None = None) -> None:
        self.first = scenario
        self.appearance = appearance or Appearance(world=LABORATORY)
        self._free_lane = free_lane(scenario)

    def draw(self, rng: np.random.Generator) -> Draw:
        """Return the next episode."""
        placement = place(self.first, rng)
        scene = replace(self.appearance.draw(rng), queue_lane=self._free_lane)
        return Draw(placement, scene, {"world": scene.number}, brake_of(scene))


class RandomLevels:
    """A random level per episode.

    A level is a random scenario with a number. Half of the levels are threats: the car-to-car, motorcycle,
    pedestrian and bicycle families of the protocols, see `lgmd_gym.envs.families.distribution`. Half are
    non-threats: all other families. With `families`, a level has a scenario of one of them, in the same world
    as without. A level fixes the family and its arguments, the grey levels, the world, the weather
    (night, fog, …) and the contrast of the road texture, in every process.
    The splits are disjoint, and so are their worlds: training never uses a level or a world of validation or
    test. The environment's seed selects the levels; `info` adds `level` (the number), `world` (its number, or
    -1 in the laboratory) and `condition` (the name of the weather).

    Args:
        split: Set of levels: "train", "validation" or "test", with 1,000,000 levels each.
        start_level: First level in use.
        num_levels: Number of levels in use; 0 for all from `start_level` on.
        weathers: Weathers, drawn with equal probability: "clear", "night", "night_upper_beam", "fog", "rain",
            "low_sun".
        world: Number of the world of all levels, or "laboratory"; None for the world of each level.
        road: See `Appearance`.
        families: Names of the scenario families in use, None for all. Half of the levels are threats if both
            threats and non-threats are among them.
        mount_heights: Lowest and highest height of the camera above the ground, drawn evenly for each level
            [m]; None for the height of each camera.
        decelerations: Lowest and highest full braking, drawn evenly for each level in place of that of its
            world, on dry and wet roads alike [m/s²]; None for that of the world.
        sensor_errors: Share of the levels with errors that no calibration finds, in [0, 1]: every lens is
            tilted by up to 1° and up to 0.15 m higher or lower, and half of these cars have no gyroscope.

    Raises:
        ValueError: If the split, a weather, the world or a family is unknown, levels are outside the
            split, the heights or decelerations are not two numbers above 0 in ascending order, a
            deceleration is above 12 m/s², or the share is outside [0, 1].
    """

    def __init__(
        self,
        split: str = "train",
        start_level: int = 0,
        num_levels: int = 0,
        weathers: Sequence[str] = tuple(WEATHERS),
        world: int | str | None = None,
        road: str | None = None,
        families: Sequence[str] | None = None,
        mount_heights: Sequence[float] | None = None,
        decelerations: Sequence[float] | None = None,
        sensor_errors: float = 0.0,
    ) -> None:
        start_level, num_levels = check_levels(split, start_level, num_levels, weathers)
        self.split, self.start_level, self.weathers = split, start_level, tuple(weathers)
        self.num_levels = num_levels or LEVELS - start_level
        self.families = check_families(families)
        self.mount_heights = self.decelerations = None
        if mount_heights is not None:
            self.mount_heights = check_range("mount_heights", mount_heights, "m")
        if decelerations is not None:
            self.decelerations = check_range("decelerations", decelerations, "m/s²")
            for limit in self.decelerations:
                BrakeParams(max_deceleration=limit)  # raises an error if it is out of range
        self.sensor_errors = check_within("sensor_errors", sensor_errors, 0.0, 1.0)
        self.appearance = Appearance(world=world, road=road, split=split)
        self.first = draw_scenario(level_generator(split, start_level), self.families)

    def draw(self, rng: np.random.Generator) -> Draw:
        """Return the next episode."""
        level = self.start_level + int(rng.integers(self.num_levels))
        generator = level_generator(self.split, level)
        scenario = draw_scenario(generator, self.families)
        placement = place(scenario, generator)
        weather, texture = draw_weather(self.split, level, self.weathers)
        height = None
        if self.mount_heights is not None:
            height = float(level_generator(self.split, level, part=3).uniform(*self.mount_heights))
        scene = replace(
            self.appearance.draw(level_generator(self.split, level, part=2)),
            weather=weather,
            texture=texture,
            queue_lane=free_lane(scenario),
            mount_height_m=height,
            **self._sensor_errors(level),
        )
        info = {"level": level, "condition": weather, "world": scene.number}
        return Draw(placement, scene, info, self._brake(level, scene))

    def _sensor_errors(self, level: int) -> Arguments:
        """Return the fields of the scene with errors that no calibration finds."""
        rng = level_generator(self.split, level, part=5)
        share, pitch, height, gyroscope = rng.random(4)
        if share >= self.sensor_errors:
            return {}
        return {
            "pitch_error_deg": MAX_PITCH_ERROR_DEG * (2.0 * pitch - 1.0),
            "height_error_m": MAX_HEIGHT_ERROR_M * (2.0 * height - 1.0),
            "gyroscope": bool(gyroscope < 0.5),
        }

    def _brake(self, level: int, scene: Scene) -> BrakeParams | None:
        """Return the brake of the level's world, with the deceleration of the level."""
        brake = brake_of(scene)
        if self.decelerations is None:
            return brake
        drawn = float(level_generator(self.split, level, part=4).uniform(*self.decelerations))
        return replace(brake or BrakeParams(), max_deceleration=drawn)
