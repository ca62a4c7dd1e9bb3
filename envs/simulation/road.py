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
    """A road whose vehicles and objects show one episode of a `World`.

    The state is that of the world: a change to a vehicle lasts until the next step only.

    Args:
        network: The road network.
        np_random: Random generator.
        world: Episodes of one or more environments.
        brake: `BRAKE` record of the ego.
        index: Index of the environment.

    Attributes:
        world: The episodes.
        ego: The car under test.
        obstacles: Vehicles and solid objects that the ego can touch.
        items: The ego, then all vehicles and objects in the order of their bodies.
    """

    def __init__(
        self,
        network: RoadNetwork,
        np_random: np.random.Generator,
        world: World,
        brake: np.ndarray,
        index: int = 0,
    ) -> None:
        super().__init__(network=network, np_random=np_random)  # type: ignore[arg-type]
        self.world, self._brake, self._index = world, brake, index
        bodies = world.bodies[index, : world.episodes[index]["bodies"]]
        self.ego = EgoCar(self, bodies[0], self.put_demand)
        self.items: list[Any] = [self.ego, *(CLASSES[body["kind"]](self, body) for body in bodies[1:])]
        items = list(zip(self.items, bodies["kind"].tolist(), strict=True))
        self.vehicles = [item for item, kind in items if kind <= CAR]
        self.objects = [item for item, kind in items if kind > CAR]
        self.obstacles: list[Any] = [item for item, kind in items[1:] if kind != ROAD_MARKING]

    def put_demand(self, demand: float) -> None:
        """Put a longitudinal demand in [-1, 1] into the ego's delay line."""
        value = demand if demand < 0.0 or self._brake["throttle"] > 0.0 else 0.0
        world, k = self.world, self._index
        put_demand(world.lines[k], world.pending[k], float(self._brake["delay"]), value)

    def act(self) -> None:
        """Do nothing: all vehicles follow scripts."""

    def step(self, dt: float) -> None:
        """Advance all vehicles and objects by `dt` [s], or up to the ego's first contact."""
        world, k = self.world, self._index
        if world.episodes[k]["touched"] > 0:
            return
        step_bodies(
            world.bodies[k], world.episodes[k], world.egos[k], world.lines[k], world.pending[k],
            self._brake[()], world.segments[k], world.paths[k], world.before[k], dt,
        )  # fmt: skip
        self.show()

    def show(self) -> None:
        """Copy the state of the world to the vehicles and objects."""
        world, k = self.world, self._index
        bodies = world.bodies[k]
        for item, body in zip(self.items, bodies[_SHOWN].tolist(), strict=False):
            item.show(*body)
        for item, steering in zip(self.vehicles, bodies["steering"].tolist(), strict=False):
            item.steer(steering)
        ego, touched = world.egos[k], int(world.episodes[k]["touched"])
        self.ego.yaw_rate = float(ego["yaw_rate"])
        self.ego.braking = ego_braking(bodies[0], ego)
        if touched:
            self.ego.crashed = self.items[touched].crashed = True
