"""The road of a braking scenario: highway-env's view of one episode of a `World`."""

from typing import Any

import numpy as np
from highway_env.road.road import Road, RoadNetwork

from lgmd_gym.envs.dynamics.bodies import CAR, ROAD_MARKING, ego_braking
from lgmd_gym.envs.dynamics.brake import put_demand
from lgmd_gym.envs.dynamics.episode import step_bodies
from lgmd_gym.envs.simulation.vehicles import CLASSES, EgoCar
from lgmd_gym.envs.simulation.world import World

_SHOWN = ["x", "y", "heading", "speed", "acceleration", "travelled"]


class BrakingRoad(Road):
    """A road whose vehicles and objects show the first episode of a `World`.

    The state is that of the world: a change to a vehicle lasts until the next step only.

    Args:
        network: The road network.
        np_random: Random generator.
        world: Episode of one environment.
        brake: `BRAKE` record of the ego.

    Attributes:
        world: The episode.
        ego: The car under test.
        obstacles: Vehicles and solid objects that the ego can touch.
        items: The ego, then all vehicles and objects in the order of their bodies.
    """

    def __init__(
        self, network: RoadNetwork, np_random: np.random.Generator, world: World, brake: np.ndarray
    ) -> None:
        super().__init__(network=network, np_random=np_random)  # type: ignore[arg-type]
        self.world, self._brake = world, brake
        bodies = world.bodies[0, : world.episodes[0]["bodies"]]
        self.ego = EgoCar(self, bodies[0], self.put_demand)
        self.items: list[Any] = [self.ego, *(CLASSES[body["kind"]](self, body) for body in bodies[1:])]
        items = list(zip(self.items, bodies["kind"].tolist(), strict=True))
        self.vehicles = [item for item, kind in items if kind <= CAR]
        self.objects = [item for item, kind in items if kind > CAR]
        self.obstacles: list[Any] = [item for item, kind in items[1:] if kind != ROAD_MARKING]

    def put_demand(self, demand: float) -> None:
        """Put a longitudinal demand in [-1, 1] into the ego's delay line."""
        value = demand if demand < 0.0 or self._brake["throttle"] > 0.0 else 0.0
        world = self.world
        put_demand(world.lines[0], world.pending[0], float(self._brake["delay"]), value)

    def act(self) -> None:
        """Do nothing: all vehicles follow scripts."""

    def step(self, dt: float) -> None:
        """Advance all vehicles and objects by `dt` [s], or up to the ego's first contact."""
        world = self.world
        if world.episodes[0]["touched"] > 0:
            return
        step_bodies(
            world.bodies[0], world.episodes[0], world.egos[0], world.lines[0], world.pending[0],
            self._brake[()], world.segments[0], world.paths[0], world.before[0], dt,
        )  # fmt: skip
        self._show()
        touched = int(world.episodes[0]["touched"])
        if touched:
            self.ego.crashed = self.items[touched].crashed = True

    def _show(self) -> None:
        """Copy the state of the world to the vehicles and objects."""
        bodies = self.world.bodies[0]
        for item, body in zip(self.items, bodies[_SHOWN].tolist(), strict=False):
            item.show(*body)
        for item, steering in zip(self.vehicles, bodies["steering"].tolist(), strict=False):
            item.steer(steering)
        ego = self.world.egos[0]
        self.ego.yaw_rate = float(ego["yaw_rate"])
        self.ego.braking = ego_braking(bodies[0], ego)
