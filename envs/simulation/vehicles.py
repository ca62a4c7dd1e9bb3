"""The cars of a braking scenario: highway-env vehicles that move exactly and never reverse."""

from math import asin, atan, tan

from highway_env.road.road import Road
from highway_env.vehicle.kinematics import Vehicle
from highway_env.vehicle.objects import Landmark, Obstacle

from lgmd_gym.envs.dynamics.brake import BrakeParams, DelayLine
from lgmd_gym.envs.dynamics.contact import Rectangle
from lgmd_gym.envs.dynamics.longitudinal import advance
from lgmd_gym.envs.dynamics.path import Path
from lgmd_gym.envs.dynamics.speed_profile import SpeedProfile
from lgmd_gym.envs.dynamics.units import MAX_SPEED
from lgmd_gym.envs.scenarios.scenario import EGO_LENGTH, EGO_WIDTH, Actor


class Follower:
    """What keeps to a path: its place is the distance it has covered.

    Attributes:
        path: Where it goes.
        along: Distance covered on it [m].
        acceleration: At the present time [m/s²].
    """

    path: Path
    along: float
    acceleration: float = 0.0

    @property
    def rectangle(self) -> Rectangle:
        """The outline seen from above."""
        x, y = self.position  # type: ignore[attr-defined]
        return Rectangle(float(x), float(y), self.heading, self.LENGTH, self.WIDTH)  # type: ignore[attr-defined]

    def move(self, distance: float) -> None:
        """Go on along the path [m]."""
        self.along += distance
        pose = self.path.pose(self.along)
        self.position[0], self.position[1], self.heading = pose  # type: ignore[attr-defined]


class PathCar(Follower, Vehicle):
    """A car on a path. The road's sweep finds its contacts, so highway-env's check is off (`collidable`).

    Attributes:
        HEIGHT: Of the body [m], read by the camera.
    """

    HEIGHT = 1.5

    def __init__(self, road: Road, path: Path, speed: float, length: float, width: float) -> None:
        self.LENGTH, self.WIDTH = length, width
        self.path, self.along = path, 0.0
        start = path.pose(0.0)
        super().__init__(road, (start.x, start.y), start.heading, speed)
        self.collidable = False

    def move(self, distance: float) -> None:
        """Go on along the path [m]."""
        before = self.heading
        super().move(distance)
        steering = 0.0
        if not self.path.straight and distance > 0.0:
            # The angle at which highway-env's bicycle would turn as much on the way.
            slip = asin(max(-0.7, min(0.7, (self.heading - before) / distance * self.LENGTH / 2)))
            steering = atan(2.0 * tan(slip))
        # What highway-env's drawing, the camera's brake light and its gaze along the path read.
        self.action = {"steering": steering, "acceleration": self.acceleration}


class EgoCar(PathCar):
    """The car under test: keeps to its scripted path and speed unless a demand says otherwise.

    Attributes:
        script: The speed it would have without the agent.
        yaw_rate: Over the last step, + to the right [rad/s].
    """

    color = (50, 200, 0)  # in highway-env's view from above

    def __init__(
        self, road: Road, path: Path, script: SpeedProfile, brake: BrakeParams, throttle: bool
    ) -> None:
        super().__init__(road, path, script.speed, EGO_LENGTH, EGO_WIDTH)
        self.script = script
        self.brake = brake
        self.throttle = throttle
        self.yaw_rate = 0.0
        self._delayed = DelayLine(brake.delay)
        self._on_script = True

    def demand(self, value: float) -> None:
        """Take a longitudinal demand: −1 full brake, 0 hold the scripted speed, +1 full throttle."""
        self._delayed.put(value if value < 0.0 or self.throttle else 0.0)

    @property
    def braking(self) -> float:
        """Deceleration beyond the script, >= 0 [m/s²]."""
        return 0.0 if self._on_script else max(0.0, self.script.acceleration - self.acceleration)

    def step(self, dt: float) -> None:
        """Advance by `dt` [s] under the demands that have become due."""
        before = self.heading
        self.move(sum(self._advance(duration, demand) for duration, demand in self._delayed.pieces(dt)))
        self.yaw_rate = (self.heading - before) / dt

    def _advance(self, duration: float, demand: float) -> float:
        """Advance the speed under one demand and return the distance [m]."""
        scripted = self.script.step(duration)
        self._on_script = self._on_script and demand == 0.0
        if self._on_script:
            self.speed, self.acceleration = self.script.speed, self.script.acceleration
            return scripted
        distance, self.speed, self.acceleration = advance(
            self.speed, self.acceleration, self._target(demand), self.brake.jerk, duration
        )
        return distance

    def _target(self, demand: float) -> float:
        """Return the acceleration [m/s²] that a demand in force leads to."""
        if demand < 0.0:
            # The script may itself be slowing down; a weaker demand does not release its brake.
            return min(demand * self.brake.max_deceleration, self.script.acceleration)
        if demand > 0.0:
            return demand * self.brake.max_acceleration if self.speed < MAX_SPEED else 0.0
        # The driver closes what is missing to the scripted speed within half a second, at most this hard.
        missing = self.script.speed - self.speed
        limit = self.brake.regain_acceleration
        return self.script.acceleration + min(max(missing / 0.5, -limit), limit)


class ScriptedCar(PathCar):
    """Another car, on the path and with the speeds of its `Actor`."""

    color = (100, 200, 255)  # in highway-env's view from above

    def __init__(self, road: Road, path: Path, actor: Actor, shade: int) -> None:
        super().__init__(road, path, actor.speed, actor.length, actor.width)
        self.HEIGHT = actor.height
        self.shade = shade
        self.script = SpeedProfile(actor.speed, actor.profile)

    @property
    def settled(self) -> bool:
        """Whether the script has nothing left to change."""
        return self.script.settled

    def step(self, dt: float) -> None:
        """Advance by `dt` [s] along the script."""
        travelled = self.script.step(dt)
        self.speed, self.acceleration = self.script.speed, self.script.acceleration
        self.move(travelled)


class _Prop(Follower):
    """Something on the road that is no car: a box, or a mark on the ground."""

    def _place(self, path: Path, actor: Actor, shade: int) -> None:
        self.LENGTH, self.WIDTH, self.HEIGHT = actor.length, actor.width, actor.height
        self.path, self.along = path, 0.0
        self.shade = shade
        self.script = SpeedProfile(actor.speed, actor.profile)

    @property
    def settled(self) -> bool:
        """Whether the script has nothing left to change."""
        return self.script.settled

    def step(self, dt: float) -> None:
        """Advance by `dt` [s] along the script."""
        travelled = self.script.step(dt)
        self.speed, self.acceleration = self.script.speed, self.script.acceleration
        if travelled:
            self.move(travelled)


class Box(_Prop, Obstacle):
    """A solid box: a pedestrian, a sign, a rail, a post."""

    def __init__(self, road: Road, path: Path, actor: Actor, shade: int) -> None:
        self._place(path, actor, shade)
        start = path.pose(0.0)
        super().__init__(road, (start.x, start.y), start.heading, actor.speed)
        self.collidable = False


class RoadMarking(_Prop, Landmark):
    """Something flat that one drives over: a steel plate, a shadow."""

    def __init__(self, road: Road, path: Path, actor: Actor, shade: int) -> None:
        self._place(path, actor, shade)
        start = path.pose(0.0)
        super().__init__(road, (start.x, start.y), start.heading, actor.speed)
        self.collidable = False


KINDS = {"car": ScriptedCar, "box": Box, "road_marking": RoadMarking}
