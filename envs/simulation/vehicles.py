"""The vehicles and objects on the road of a braking scenario: what highway-env and the camera see."""

from collections.abc import Callable
from typing import Any

import numpy as np
from highway_env.road.road import Road
from highway_env.vehicle.kinematics import Vehicle
from highway_env.vehicle.objects import Landmark, Obstacle

from lgmd_gym.envs.dynamics.bodies import (
    BICYCLE,
    BOX,
    CAR,
    EGO,
    MOTORCYCLE,
    PEDESTRIAN,
    ROAD_MARKING,
)


class _Body:
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


class PathCar(_Body, Vehicle):
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


class Box(_Body, Obstacle):
    """A solid box: a sign, a rail, a post."""

    def __init__(self, road: Road, body: np.void) -> None:
        super().__init__(road, body)
        self.shade = int(body["shade"])


class Pedestrian(Box):
    """A pedestrian who follows the path and speed profile of its `Actor`."""


class Bicycle(Box):
    """A bicycle with its rider."""


class Motorcycle(Box):
    """A motorcycle with its rider."""


class RoadMarking(_Body, Landmark):
    """A flat object that the ego drives over: a steel plate, a shadow."""

    def __init__(self, road: Road, body: np.void) -> None:
        super().__init__(road, body)
        self.shade = int(body["shade"])


CLASSES: dict[int, Any] = {
    EGO: EgoCar,
    CAR: ScriptedCar,
    BOX: Box,
    ROAD_MARKING: RoadMarking,
    PEDESTRIAN: Pedestrian,
    BICYCLE: Bicycle,
    MOTORCYCLE: Motorcycle,
}
