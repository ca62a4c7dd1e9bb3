"""The ego's brake: latency and dead time, then a linear build-up of the deceleration."""

from collections import deque
from dataclasses import dataclass
from math import inf

from lgmd_gym.envs.dynamics.units import check_within


@dataclass(frozen=True, slots=True, kw_only=True)
class BrakeParams:
    """Response of the ego to a longitudinal demand.

    Attributes:
        max_deceleration: Full braking [m/s²]; 9.0 is typical of a dry road with a peak braking coefficient
            of 0.9.
        max_acceleration: Full throttle [m/s²].
        latency: Time from the end of a camera frame to the demand at the brake [s]; one frame at 30 Hz.
        dead_time: Time from the demand to the first deceleration [s].
        build_up: Time from the first to the full deceleration, a linear ramp [s].
        regain_acceleration: Limit of the acceleration with which the driver regains the scripted speed
            [m/s²].
    """

    max_deceleration: float = 9.0
    max_acceleration: float = 3.0
    latency: float = 1.0 / 30.0
    dead_time: float = 0.1
    build_up: float = 0.2
    regain_acceleration: float = 2.0

    def __post_init__(self) -> None:
        check_within("max_deceleration", self.max_deceleration, 0.1, 12.0, "m/s²")
        check_within("max_acceleration", self.max_acceleration, 0.0, 12.0, "m/s²")
        check_within("latency", self.latency, 0.0, 2.0, "s")
        check_within("dead_time", self.dead_time, 0.0, 2.0, "s")
        check_within("build_up", self.build_up, 0.0, 5.0, "s")
        check_within("regain_acceleration", self.regain_acceleration, 0.0, 12.0, "m/s²")

    @property
    def jerk(self) -> float:
        """Slope of every change of the ego's acceleration [m/s³]."""
        return self.max_deceleration / self.build_up if self.build_up > 0.0 else inf

    @property
    def delay(self) -> float:
        """Time from a demand to the first change of acceleration [s]."""
        return self.latency + self.dead_time


class DelayLine:
    """A queue that delays demands by a constant time, which need not be a multiple of the simulation step.

    Args:
        delay: Delay of every demand [s].
    """

    def __init__(self, delay: float) -> None:
        self.delay = delay
        self.time = 0.0
        self.demand = 0.0
        self._last_put = 0.0
        self._pending: deque[tuple[float, float]] = deque()

    def put(self, demand: float) -> None:
        """Add a demand in [-1, 1] at the current time."""
        if demand != self._last_put:
            self._last_put = demand
            self._pending.append((self.time + self.delay, demand))

    def advance(self, dt: float) -> list[tuple[float, float]]:
        """Advance by `dt` [s] and return (duration [s], active demand) for each part of that time."""
        end = self.time + dt
        parts = []
        # A demand due within a nanosecond of the step's end belongs to the next step.
        while self._pending and self._pending[0][0] < end - 1e-9:
            due, demand = self._pending.popleft()
            if due > self.time:
                parts.append((due - self.time, self.demand))
                self.time = due
            self.demand = demand
        parts.append((end - self.time, self.demand))
        self.time = end
        return parts
