"""The cars of a braking scenario: highway-env vehicles that move exactly and never reverse."""

from math import copysign, cos, inf, sin

from highway_env.road.road import Road
from highway_env.vehicle.kinematics import Vehicle

from lgmd_gym.envs.brake import BrakeParams, DelayLine
from lgmd_gym.envs.contact import Rectangle
from lgmd_gym.envs.dynamics import advance
from lgmd_gym.envs.scenario import EGO_LENGTH, EGO_WIDTH, Actor
from lgmd_gym.envs.units import MAX_SPEED


class StraightCar(Vehicle):
    """A car that keeps its heading and moves exactly under piecewise linear acceleration.

    Contact is found by the road's sweep, so highway-env's own collision check is off (`collidable`).

    Attributes:
        acceleration: Acceleration at the present time [m/s²].
        HEIGHT: Of the body [m], read by the camera.
    """

    HEIGHT = 1.5

    def __init__(
        self, road: Road, position: tuple[float, float], speed: float, length: float, width: float
    ) -> None:
        self.LENGTH, self.WIDTH = length, width
        super().__init__(road, position, 0.0, speed)
        self.collidable = False
        self.acceleration = 0.0

    @property
    def rectangle(self) -> Rectangle:
        """The outline seen from above."""
        x, y = self.position
        return Rectangle(float(x), float(y), self.heading, self.LENGTH, self.WIDTH)

    def move(self, distance: float) -> None:
        """Shift the car along its heading [m]."""
        self.position[0] += distance * cos(self.heading)
        self.position[1] += distance * sin(self.heading)
        # What highway-env's drawing and the camera's brake light read.
        self.action = {"steering": 0.0, "acceleration": self.acceleration}


class EgoCar(StraightCar):
    """The car under test: holds its scripted speed unless a demand says otherwise."""

    color = (50, 200, 0)  # in highway-env's view from above

    def __init__(
        self, road: Road, position: tuple[float, float], speed: float, brake: BrakeParams, throttle: bool
    ) -> None:
        super().__init__(road, position, speed, EGO_LENGTH, EGO_WIDTH)
        self.script_speed = speed
        self.brake = brake
        self.throttle = throttle
        self._delayed = DelayLine(brake.delay)

    def demand(self, value: float) -> None:
        """Take a longitudinal demand: −1 full brake, 0 hold the scripted speed, +1 full throttle."""
        self._delayed.put(value if value < 0.0 or self.throttle else 0.0)

    @property
    def braking(self) -> float:
        """Deceleration beyond the script, >= 0 [m/s²]."""
        return max(0.0, -self.acceleration)

    def step(self, dt: float) -> None:
        """Advance by `dt` [s] under the demands that have become due."""
        travelled = 0.0
        for duration, demand in self._delayed.pieces(dt):
            distance, self.speed, self.acceleration = advance(
                self.speed, self.acceleration, self._target(demand), self.brake.jerk, duration
            )
            travelled += distance
        self.move(travelled)

    def _target(self, demand: float) -> float:
        """Return the acceleration [m/s²] that a demand in force leads to."""
        if demand < 0.0:
            return demand * self.brake.max_deceleration
        if demand > 0.0:
            return demand * self.brake.max_acceleration if self.speed < MAX_SPEED else 0.0
        # The driver closes what is missing to the scripted speed within half a second, at most this hard.
        missing = self.script_speed - self.speed
        return min(max(missing / 0.5, -self.brake.regain_acceleration), self.brake.regain_acceleration)


class ScriptedCar(StraightCar):
    """Another road user that follows the speed profile of its `Actor`."""

    color = (100, 200, 255)  # in highway-env's view from above

    def __init__(self, road: Road, position: tuple[float, float], actor: Actor, shade: int) -> None:
        super().__init__(road, position, actor.speed, actor.length, actor.width)
        self.HEIGHT = actor.height
        self.shade = shade
        self._phases = list(actor.profile)
        self._time = 0.0

    @property
    def settled(self) -> bool:
        """Whether the script has nothing left to change."""
        return not self._phases

    def step(self, dt: float) -> None:
        """Advance by `dt` [s] along the script."""
        end = self._time + dt
        travelled = 0.0
        while self._phases and self._phases[0].start < end:
            phase = self._phases[0]
            before = max(phase.start - self._time, 0.0)
            travelled += self._advance(0.0, inf, before)
            jerk = abs(phase.acceleration) / phase.build_up if phase.build_up > 0.0 else inf
            travelled += self._advance(phase.acceleration, jerk, end - self._time)
            left = (phase.final_speed - self.speed) * copysign(1.0, phase.acceleration)
            if left > 0.0:
                break
            self._phases.pop(0)
            self.speed, self.acceleration = phase.final_speed, 0.0
        travelled += self._advance(0.0, inf, end - self._time)
        self.move(travelled)

    def _advance(self, target: float, jerk: float, duration: float) -> float:
        """Advance the speed and the script's clock, and return the distance [m]."""
        if duration <= 0.0:
            return 0.0
        distance, self.speed, self.acceleration = advance(
            self.speed, self.acceleration, target, jerk, duration
        )
        self._time += duration
        return distance
