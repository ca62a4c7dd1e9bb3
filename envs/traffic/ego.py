"""The car under test in traffic: an IDM driver at the wheel, and an agent that may add braking."""

from math import atan, cos, sin, tan
from typing import Any, cast

import numpy as np

from lgmd_gym.envs.dynamics.brake import BrakeParams, DelayLine
from lgmd_gym.envs.dynamics.longitudinal import advance
from lgmd_gym.envs.scenarios.scenario import EGO_LENGTH, EGO_WIDTH
from lgmd_gym.envs.traffic.drivers import TrafficCar

EASY = 3.0  # [m/s²] the driver slows no harder than this for a speed limit or to give way


class TrafficEgo(TrafficCar):
    """The car under test: IDM drives and keeps its lane, an agent may add braking.

    The lane is kept because the branches with and without braking shall differ by the braking alone, and
    because MOBIL would overtake on a two-way road without a look at who is coming. The steering is
    highway-env's; the speed follows the same brake as in `BrakingEnv`, exactly within each step.

    Args:
        road: The road.
        position: Centre [m].
        heading: [rad].
        speed: [m/s].
        brake: The brake.

    Attributes:
        driver: Acceleration that IDM asks for [m/s²], >= −6.
        now: Acceleration of the car [m/s²].
        yaw_rate: Over the last step, + to the right [rad/s].
        travelled: Distance since the reset [m].
    """

    color = (50, 200, 0)  # in highway-env's view from above

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
        self.driver = self.now = self.yaw_rate = self.travelled = 0.0
        self._delayed = DelayLine(self.brake.delay)
        self._by_driver = True

    def demand(self, value: float) -> None:
        """Take a longitudinal demand: −1 full brake, 0 and above leave it to the driver."""
        self._delayed.put(min(value, 0.0))

    @property
    def braking(self) -> float:
        """Deceleration beyond the driver's, >= 0 [m/s²]; standing where the driver would go on is none."""
        return 0.0 if self._by_driver else max(0.0, min(self.driver, 0.0) - self.now)

    def acceleration(self, ego_vehicle: Any, front_vehicle: Any = None, rear_vehicle: Any = None) -> float:
        """Return IDM's acceleration [m/s²], the term for the wanted speed bounded by comfort.

        IDM's own term falls with the fourth power of speed over wanted speed, so that a car told to give way
        (a wanted speed of 0) would always do so by emergency braking.
        """
        free = super().acceleration(ego_vehicle)
        whole = super().acceleration(ego_vehicle, front_vehicle, rear_vehicle)
        return max(free, -EASY) + (whole - free)

    def act(self, action: Any = None) -> None:
        """Have the driver decide."""
        super().act()
        self.driver = float(cast(dict[str, float], self.action)["acceleration"])

    def step(self, dt: float) -> None:
        """Advance by `dt` [s] under the demands that have become due."""
        self.timer += dt
        action = cast(dict[str, float], self.action)
        slip = atan(tan(action["steering"]) / 2)
        distance = sum(self._advance(duration, demand) for duration, demand in self._delayed.pieces(dt))
        course = self.heading + slip
        self.position = self.position + distance * np.array([cos(course), sin(course)])
        turned = distance * sin(slip) / (self.LENGTH / 2)
        self.heading += turned
        self.yaw_rate = turned / dt
        self.travelled += distance
        action["acceleration"] = self.now
        self.on_state_update()

    def _advance(self, duration: float, demand: float) -> float:
        """Advance the speed under one demand and return the distance [m]."""
        target = min(demand * self.brake.max_deceleration, self.driver) if demand < 0.0 else self.driver
        self._by_driver = demand == 0.0 and (self._by_driver or self.now >= self.driver)
        distance, self.speed, self.now = advance(self.speed, self.now, target, self.brake.jerk, duration)
        return distance
