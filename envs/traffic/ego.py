"""The car under test in traffic: an IDM driver, and an agent that can add braking."""

from math import atan, cos, sin, tan
from typing import Any, cast

import numpy as np

from lgmd_gym.envs.dynamics.brake import BrakeParams, DelayLine
from lgmd_gym.envs.dynamics.longitudinal import advance
from lgmd_gym.envs.families.scenario import EGO_LENGTH, EGO_WIDTH
from lgmd_gym.envs.traffic.drivers import TrafficCar


class TrafficEgo(TrafficCar):
    """The car under test: driven by IDM without lane changes; an agent can add braking.

    Without lane changes, episodes with and without braking differ by the braking alone. MOBIL would also
    overtake on a two-way road regardless of oncoming cars. The steering is highway-env's. The speed follows
    the brake model of `BrakingEnv`, exactly within each step.

    Args:
        road: The road.
        position: Centre [m].
        heading: Heading [rad].
        speed: Speed [m/s].
        brake: Response to demands; None for the default.

    Attributes:
        driver_acceleration: Acceleration demanded by the IDM driver, >= −6 and within the brake [m/s²].
        current_acceleration: Acceleration of the car [m/s²].
        yaw_rate: Mean yaw rate over the last step, + to the right [rad/s].
        travelled: Distance travelled since the reset [m].
    """

    IS_EGO = True
    color = (50, 200, 0)  # in highway-env's top view

    def __init__(
        self,
        road: Any,
        position: Any,
        heading: float = 0.0,
        speed: float = 0.0,
        brake: BrakeParams | None = None,
    ) -> None:
        self.LENGTH, self.WIDTH = EGO_LENGTH, EGO_WIDTH
        super().__init__(road, position, heading, speed, enable_lane_change=False)
        self.brake = brake or BrakeParams()
        self.driver_acceleration = self.current_acceleration = 0.0
        self.yaw_rate = self.travelled = 0.0
        self._delay_line = DelayLine(self.brake.delay)
        self._by_driver = True
        self._start = (0.0, 0.0)  # speed and acceleration before the last step
        self._parts: list[tuple[float, float]] = []  # of that step: duration [s], target acceleration [m/s²]

    def demand(self, value: float) -> None:
        """Set the longitudinal demand: −1 full brake, 0 and above no braking beyond the driver's."""
        self._delay_line.put(min(value, 0.0))

    @property
    def braking(self) -> float:
        """Deceleration beyond the driver's, >= 0 [m/s²]; 0 at standstill."""
        if self._by_driver:
            return 0.0
        return max(0.0, min(self.driver_acceleration, 0.0) - self.current_acceleration)

    def move(self, dt: float) -> None:
        """Advance by `dt` [s] with the driver's steering angle, under the delayed demands."""
        self.timer += dt
        action = cast(dict[str, float], self.action)
        slip = atan(tan(action["steering"]) / 2)
        self._start, self._parts = (self.speed, self.current_acceleration), []
        distance = sum(self._advance(duration, demand) for duration, demand in self._delay_line.advance(dt))
        course = self.heading + slip
        self.position = self.position + distance * np.array([cos(course), sin(course)])
        turned = distance * sin(slip) / (self.LENGTH / 2)
        self.heading += turned
        self.yaw_rate = turned / dt
        self.travelled += distance
        action["acceleration"] = self.current_acceleration

    def _advance(self, duration: float, demand: float) -> float:
        """Advance the speed under one demand and return the distance travelled [m]."""
        before, target = self.current_acceleration, self.driver_acceleration
        self._by_driver = demand == 0.0 and (self._by_driver or before >= target)
        if demand < 0.0:
            target = min(demand * self.brake.max_deceleration, target)
        self._parts.append((duration, target))
        distance, self.speed, self.current_acceleration = advance(
            self.speed, before, target, self.brake.jerk, duration
        )
        return distance

    def progress(self, time: float) -> tuple[float, float]:
        """Return the distance covered [m] and the speed [m/s] at a time of the last step [s]."""
        covered, (speed, acceleration) = 0.0, self._start
        for duration, target in self._parts:
            duration = min(duration, time)
            time -= duration
            moved, speed, acceleration = advance(speed, acceleration, target, self.brake.jerk, duration)
            covered += moved
        return covered, speed
