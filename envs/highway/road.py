"""The road of a braking scenario with its vehicles and objects: highway-env's view of one environment."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.kinematics import Vehicle
from highway_env.vehicle.objects import Landmark, Obstacle

from lgmd_gym.envs.dynamics.bodies import (
    BICYCLE,
    BOX,
    CAR,
    MOTORCYCLE,
    PEDESTRIAN,
    ROAD_MARKING,
)
from lgmd_gym.envs.dynamics.episode import step_environment
from lgmd_gym.envs.simulation import Simulation


class _BodyItem:
    """Mixin for road objects that show a `BODY` record; `BrakingRoad` updates them after each step.

    highway-env's collision check is off (`collidable`), because the road finds the contacts.

    Attributes:
        HEIGHT: Height [m], read by the camera.
        shade: Grey level, read by the camera.
        acceleration: Current acceleration [m/s²].
        travelled: Distance travelled along the path [m].
    """

    def __init__(self, road: Road, body: np.void) -> None:
        self.LENGTH, self.WIDTH = float(body["length"]), float(body["width"])
        self.HEIGHT = float(body["height"])
        position, heading = (float(body["x"]), float(body["y"])), float(body["heading"])
        super().__init__(road, position, heading, float(body["speed"]))  # type: ignore[call-arg]
        self.collidable = False
        self.acceleration = self.travelled = 0.0

    def show(
        self, x: float, y: float, heading: float, speed: float, acceleration: float, travelled: float
    ) -> None:
        """Set position [m], heading [rad], speed [m/s], acceleration [m/s²] and distance travelled [m]."""
        self.position[0], self.position[1] = x, y  # type: ignore[attr-defined]
        self.heading, self.speed = heading, speed
        self.acceleration, self.travelled = acceleration, travelled


class PathCar(_BodyItem, Vehicle):
    """A car on a path."""

    def steer(self, steering: float) -> None:
        """Set the action that the motion corresponds to in highway-env's bicycle model.

        It is read by highway-env's renderer, the camera's brake lights and its gaze along the path.
        """
        self.action = {"steering": steering, "acceleration": self.acceleration}


class EgoCar(PathCar):
    """The car under test.

    Args:
        road: The road.
        body: The ego's `BODY` record.
        demand: Function that sets the demand of the next decision.

    Attributes:
        demand: Sets the longitudinal demand: −1 full brake, 0 hold the scripted speed, +1 full throttle.
        yaw_rate: Mean yaw rate over the last step, + to the right [rad/s].
    """

    color = (50, 200, 0)  # in highway-env's top view

    def __init__(self, road: Road, body: np.void, demand: Callable[[float], None]) -> None:
        super().__init__(road, body)
        self.demand = demand
        self.yaw_rate = 0.0


class ScriptedCar(PathCar):
    """A car that follows the path and speed profile of its `Actor`."""

    color = (100, 200, 255)  # in highway-env's top view

    def __init__(self, road: Road, body: np.void) -> None:
        super().__init__(road, body)
        self.shade = int(body["shade"])


class SolidObject(_BodyItem, Obstacle):
    """A solid box: a sign, a rail, a post."""

    def __init__(self, road: Road, body: np.void) -> None:
        super().__init__(road, body)
        self.shade = int(body["shade"])


class Pedestrian(SolidObject):
    """A pedestrian who follows the path and speed profile of its `Actor`."""


class Bicycle(SolidObject):
    """A bicycle with its rider."""


class Motorcycle(SolidObject):
    """A motorcycle with its rider."""


class RoadMarking(_BodyItem, Landmark):
    """A flat object that the ego drives over: a steel plate, a shadow."""

    def __init__(self, road: Road, body: np.void) -> None:
        super().__init__(road, body)
        self.shade = int(body["shade"])


RoadItem: TypeAlias = PathCar | SolidObject | RoadMarking
"""What a `BODY` record can be."""
CLASSES: dict[int, type[ScriptedCar | SolidObject | RoadMarking]] = {
    CAR: ScriptedCar,
    BOX: SolidObject,
    ROAD_MARKING: RoadMarking,
    PEDESTRIAN: Pedestrian,
    BICYCLE: Bicycle,
    MOTORCYCLE: Motorcycle,
}


_SHOWN = 7  # x, y, heading, speed, acceleration, travelled and steering come first in `BODY`


class BrakingRoad(Road):
    """A road whose vehicles and objects show one environment of a simulation.

    The state is that of the simulation: a change to a vehicle lasts until the next step only. `BrakingEnv`
    brings the vehicles up to date after each decision, and the road does when they are read from it.

    Args:
        network: The road network.
        np_random: Random generator.
        simulation: The simulation.
        index: Index of the environment.
    """

    _shown_steps = -1  # steps of the episode that the vehicles show; −1 for none

    def __init__(
        self, network: RoadNetwork, np_random: np.random.Generator, simulation: Simulation, index: int = 0
    ) -> None:
        super().__init__(network=network, np_random=np_random)  # type: ignore[arg-type]
        self._simulation, self._index = simulation, index
        state = simulation.state
        bodies = state.bodies[index, : state.episodes[index]["bodies"]]
        self._ego = EgoCar(self, bodies[0], self.set_demand)
        self._items: list[RoadItem] = [self._ego, *(CLASSES[body["kind"]](self, body) for body in bodies[1:])]
        items = list(zip(self._items, bodies["kind"].tolist(), strict=True))
        self.vehicles = [item for item, kind in items if kind <= CAR]
        self.objects = [item for item, kind in items if kind > CAR]
        self._obstacles: list[RoadItem] = [item for item, kind in items[1:] if kind != ROAD_MARKING]
        self._shown_steps = -1

    @property
    def ego(self) -> EgoCar:
        """The car under test."""
        self.refresh()
        return self._ego

    @property
    def vehicles(self) -> list[RoadItem]:  # type: ignore[override]
        """The ego and all scripted cars."""
        self.refresh()
        return self._vehicles

    @vehicles.setter
    def vehicles(self, value: list[RoadItem]) -> None:
        self._vehicles = value

    @property
    def objects(self) -> list[RoadItem]:  # type: ignore[override]
        """All other objects."""
        self.refresh()
        return self._objects

    @objects.setter
    def objects(self, value: list[RoadItem]) -> None:
        self._objects = value

    @property
    def obstacles(self) -> list[RoadItem]:
        """Vehicles and solid objects that the ego can touch."""
        self.refresh()
        return self._obstacles

    @property
    def items(self) -> list[RoadItem]:
        """The ego, then all vehicles and objects in the order of their bodies."""
        self.refresh()
        return self._items

    def set_demand(self, demand: float) -> None:
        """Set the longitudinal demand in [-1, 1] of the next decision."""
        self._simulation.clock.demands[self._index] = demand

    def act(self) -> None:
        """Do nothing: all vehicles follow scripts."""

    def step(self, dt: float) -> None:
        """Advance all vehicles and objects by `dt` [s], or up to the ego's first contact."""
        step_environment(self._index, dt, self._simulation.physics)
        self._shown_steps = -1

    def refresh(self) -> None:
        """Copy the present state to the vehicles and objects, unless they show it already."""
        steps = self._simulation.state.episodes["steps"].item(self._index)
        if steps != self._shown_steps:
            self._shown_steps = steps
            self._show()

    def _show(self) -> None:
        state, index = self._simulation.state, self._index
        bodies, episode = state.bodies[index], state.episodes[index]
        rows = bodies.view(np.float64).reshape(len(bodies), -1)[:, :_SHOWN].tolist()
        for item, (*motion, steering) in zip(self._items, rows, strict=False):
            item.show(*motion)
            if isinstance(item, PathCar):
                item.steer(steering)
        self._ego.yaw_rate = float(state.egos["yaw_rate"][index])
        touched = int(episode["touched"])
        if touched:
            self._ego.crashed = self._items[touched].crashed = True
