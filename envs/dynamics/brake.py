"""The ego's brake: a demand waits out the latency and dead time, then the deceleration builds up."""

from collections import deque
from dataclasses import dataclass
from math import inf

from lgmd_gym.envs.dynamics.units import check_within


@dataclass(frozen=True, slots=True, kw_only=True)
class BrakeParams:
    """How the ego answers a demand; defaults as in the project's scenario contract.

    Attributes:
        max_deceleration: Full braking [m/s²]; 9.0 is what a dry road with PBC 0.9 gives.
        max_acceleration: Full throttle [m/s²].
        latency: From the end of a camera frame to the demand at the brake [s]; one frame at 30 Hz.
        dead_time: From the demand to the first deceleration [s].
        build_up: From the first to the full deceleration, a linear ramp [s].
        regain_acceleration: The scripted driver regains the scripted speed at most this hard [m/s²].
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
        """From a demand to the first change of acceleration [s]."""
        return self.latency + self.dead_time


class DelayLine:
    """Holds demands until their time has come, to the exact moment inside a simulation step."""

    def __init__(self, delay: float) -> None:
        self.delay = delay
        self.time = 0.0
        self.demand = 0.0
        self._last_put = 0.0
        self._waiting: deque[tuple[float, float]] = deque()

    def put(self, demand: float) -> None:
        """Take a demand in [-1, 1] at the present time."""
        if demand != self._last_put:
            self._last_put = demand
            self._waiting.append((self.time + self.delay, demand))

    def pieces(self, dt: float) -> list[tuple[float, float]]:
        """Advance by `dt` and return the (duration, demand) pieces in force meanwhile."""
        end = self.time + dt
        pieces = []
        # A demand due within a nanosecond of the step's end belongs to the next step.
        while self._waiting and self._waiting[0][0] < end - 1e-9:
            due, demand = self._waiting.popleft()
            if due > self.time:
                pieces.append((due - self.time, self.demand))
                self.time = due
            self.demand = demand
        pieces.append((end - self.time, self.demand))
        self.time = end
        return pieces
