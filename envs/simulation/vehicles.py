"""Vehicles and objects of a braking scenario, which follow paths and speed profiles exactly."""

from math import asin, atan, tan

from highway_env.road.road import Road
from highway_env.vehicle.kinematics import Vehicle
from highway_env.vehicle.objects import Landmark, Obstacle

from lgmd_gym.envs.dynamics.brake import BrakeParams, DelayLine
from lgmd_gym.envs.dynamics.longitudinal import advance
from lgmd_gym.envs.dynamics.path import Path
from lgmd_gym.envs.dynamics.speed_profile import SpeedProfile
from lgmd_gym.envs.dynamics.units import MAX_SPEED
from lgmd_gym.envs.scenarios.scenario import EGO_LENGTH, EGO_WIDTH, Actor

REGAIN_TIME = 0.5  # [s] within which the driver regains the scripted speed after braking


class PathFollower:
    """Mixin for road objects whose position is given by the distance travelled along a path.

    Attributes:
        path: The path.
        travelled: Distance travelled along the path [m].
        acceleration: Current acceleration [m/s²].
    """

    path: Path
    travelled: float
    acceleration: float = 0.0

    def move(self, distance: float) -> None:
        """Move along the path by a distance [m]."""
        self.travelled += distance
        pose = self.path.pose(self.travelled)
        self.position[0], self.position[1], self.heading = pose  # type: ignore[attr-defined]


class PathCar(PathFollower, Vehicle):
    """A car on a path. highway-env's collision check is off (`collidable`); `BrakingRoad` finds contacts.

    Attributes:
        HEIGHT: Body height [m], read by the camera.
    """

    HEIGHT = 1.5

    def __init__(self, road: Road, path: Path, speed: float, length: float, width: float) -> None:
        self.LENGTH, self.WIDTH = length, width
        self.path, self.travelled = path, 0.0
        start = path.pose(0.0)
        super().__init__(road, (start.x, start.y), start.heading, speed)
        self.collidable = False

    def move(self, distance: float) -> None:
        """Move along the path by a distance [m] and set the action that this motion corresponds to."""
        before = self.heading
        super().move(distance)
        steering = 0.0
        if not self.path.straight and distance > 0.0:
            # The steering angle at which highway-env's bicycle model has the same yaw rate.
            slip = asin(max(-0.7, min(0.7, (self.heading - before) / distance * self.LENGTH / 2)))
            steering = atan(2.0 * tan(slip))
        # Read by highway-env's renderer, the camera's brake lights and its gaze along the path.
        self.action = {"steering": steering, "acceleration": self.acceleration}


class EgoCar(PathCar):
    """The car under test. It follows its scripted path and speed unless a demand overrides the speed.

    Args:
        road: The road.
        path: Scripted path.
        script: Scripted speed.
        brake: Response to demands.
        throttle: Whether demands above 0 have an effect.

    Attributes:
        script: Scripted speed, which the ego has without demands.
        yaw_rate: Mean yaw rate over the last step, + to the right [rad/s].
    """

    color = (50, 200, 0)  # in highway-env's top view

    def __init__(
        self, road: Road, path: Path, script: SpeedProfile, brake: BrakeParams, throttle: bool
    ) -> None:
        super().__init__(road, path, script.speed, EGO_LENGTH, EGO_WIDTH)
        self.script = script
        self.brake = brake
        self.throttle = throttle
        self.yaw_rate = 0.0
        self._delay_line = DelayLine(brake.delay)
        self._on_script = True

    def demand(self, value: float) -> None:
        """Set the longitudinal demand: −1 full brake, 0 hold the scripted speed, +1 full throttle."""
        self._delay_line.put(value if value < 0.0 or self.throttle else 0.0)

    @property
    def braking(self) -> float:
        """Deceleration beyond the script, >= 0 [m/s²]."""
        return 0.0 if self._on_script else max(0.0, self.script.acceleration - self.acceleration)

    def step(self, dt: float) -> None:
        """Advance by `dt` [s] under the delayed demands."""
        before = self.heading
        self.move(sum(self._advance(duration, demand) for duration, demand in self._delay_line.advance(dt)))
        self.yaw_rate = (self.heading - before) / dt

    def _advance(self, duration: float, demand: float) -> float:
        """Advance the speed under one demand and return the distance travelled [m]."""
        scripted = self.script.step(duration)
        self._on_script = self._on_script and demand == 0.0
        if self._on_script:
            self.speed, self.acceleration = self.script.speed, self.script.acceleration
            return scripted
        distance, self.speed, self.acceleration = advance(
            self.speed, self.acceleration, self._target_acceleration(demand), self.brake.jerk, duration
        )
        return distance

    def _target_acceleration(self, demand: float) -> float:
        """Return the acceleration under a constant demand after the build-up [m/s²]."""
        if demand < 0.0:
            # A demand weaker than the scripted deceleration does not release the scripted brake.
            return min(demand * self.brake.max_deceleration, self.script.acceleration)
        if demand > 0.0:
            return demand * self.brake.max_acceleration if self.speed < MAX_SPEED else 0.0
        deficit = self.script.speed - self.speed
        limit = self.brake.regain_acceleration
        return self.script.acceleration + min(max(deficit / REGAIN_TIME, -limit), limit)


class ScriptedCar(PathCar):
    """A car that follows the path and speed profile of its `Actor`."""

    color = (100, 200, 255)  # in highway-env's top view

    def __init__(self, road: Road, path: Path, actor: Actor, shade: int) -> None:
        super().__init__(road, path, actor.speed, float(actor.length), float(actor.width))
        self.HEIGHT = actor.height
        self.shade = shade
        self.script = SpeedProfile(actor.speed, actor.profile)

    def step(self, dt: float) -> None:
        """Advance by `dt` [s] along the script."""
        distance = self.script.step(dt)
        self.speed, self.acceleration = self.script.speed, self.script.acceleration
        self.move(distance)


class _ScriptedObject(PathFollower):
    """Mixin for objects that follow the path and speed profile of their `Actor`."""

    def __init__(self, road: Road, path: Path, actor: Actor, shade: int) -> None:
        self.LENGTH, self.WIDTH, self.HEIGHT = float(actor.length), float(actor.width), actor.height
        self.path, self.travelled = path, 0.0
        self.shade = shade
        self.script = SpeedProfile(actor.speed, actor.profile)
        start = path.pose(0.0)
        super().__init__(road, (start.x, start.y), start.heading, actor.speed)  # type: ignore[call-arg]
        self.collidable = False

    def step(self, dt: float) -> None:
        """Advance by `dt` [s] along the script."""
        distance = self.script.step(dt)
        self.speed, self.acceleration = self.script.speed, self.script.acceleration
        if distance:
            self.move(distance)


class Box(_ScriptedObject, Obstacle):
    """A solid box: a pedestrian, a sign, a rail, a post."""


class RoadMarking(_ScriptedObject, Landmark):
    """A flat object that the ego drives over: a steel plate, a shadow."""


ACTOR_CLASSES = {"car": ScriptedCar, "box": Box, "road_marking": RoadMarking}
