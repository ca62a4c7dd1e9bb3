"""The ego's brake: latency and dead time, then a linear build-up of the deceleration."""

from math import ceil, inf

import numpy as np

from lgmd_gym.errors import check_flag, check_whole
from lgmd_gym.fields import Record, number, record
from lgmd_gym.kernels import kernel

EMERGENCY = 5.0
"""Deceleration of emergency braking [m/s²], UN R152 Rev.2, 5.2.1.2."""
DELAY_LINE = np.dtype(
    [("time", np.float64), ("demand", np.float64), ("last_put", np.float64), ("count", np.int64)]
)
"""State of a queue of demands: time since the start [s], active demand, last demand put in, number of
demands in the queue."""
BRAKE = np.dtype(
    [
        (name, np.float64)
        for name in (
            "max_deceleration",
            "max_acceleration",
            "jerk",
            "delay",
            "regain_acceleration",
            "throttle",
        )
    ]
)
"""`BrakeParams` for the compiled functions; `throttle` is 1 if demands above 0 have an effect, else 0."""


@record
class BrakeParams(Record):
    """Response of the ego to a longitudinal demand."""

    max_deceleration: float = number(
        9.0,
        "[0.1, 12]",
        "m/s²",
        "Full braking; 9.0 is typical of a dry road with a peak braking coefficient of 0.9.",
    )
    max_acceleration: float = number(3.0, "[0, 12]", "m/s²", "Full throttle.")
    latency: float = number(
        1.0 / 30.0,
        "[0, 2]",
        "s",
        "Time from the end of a camera frame to the demand at the brake; one frame at 30 Hz.",
    )
    dead_time: float = number(0.1, "[0, 2]", "s", "Time from the demand to the first deceleration.")
    build_up: float = number(
        0.2, "[0, 5]", "s", "Time from the first to the full deceleration, a linear ramp."
    )
    regain_acceleration: float = number(
        2.0,
        "[0, 12]",
        "m/s²",
        "Limit of the acceleration with which the driver regains the scripted speed.",
    )

    @property
    def jerk(self) -> float:
        """Slope of every change of the ego's acceleration [m/s³]."""
        return self.max_deceleration / self.build_up if self.build_up > 0.0 else inf

    @property
    def delay(self) -> float:
        """Time from a demand to the first change of acceleration [s]."""
        return self.latency + self.dead_time

    def max_demands(self, policy_frequency: float) -> int:
        """Return the maximum number of demands in the delay line at a rate of decisions [Hz]."""
        return ceil(self.delay * policy_frequency) + 2

    def record(self, throttle: bool) -> np.ndarray:
        """Return the parameters as a `BRAKE` record of shape ()."""
        record = np.zeros((), BRAKE)
        for name in ("max_deceleration", "max_acceleration", "jerk", "delay", "regain_acceleration"):
            record[name] = getattr(self, name)
        record["throttle"] = throttle
        return record


# Ranges of `draw_brake`.
DRY_DECELERATION, WET_DECELERATION = (7.5, 9.5), (5.0, 7.0)  # [m/s²]
DEAD_TIMES, BUILD_UPS = (0.05, 0.25), (0.15, 0.45)  # [s]
_STREAM = 7  # second part of the seed, which separates the brake from other draws of the same world


def draw_brake(world: int, wet: bool) -> BrakeParams:
    """Return the brake of a world: a pure function of its number and of the state of the road.

    Drawn uniformly: `max_deceleration` in 7.5-9.5 m/s² on a dry and 5-7 m/s² on a wet road, `dead_time` in
    0.05-0.25 s, `build_up` in 0.15-0.45 s; the other fields keep their defaults. A world has the same dead
    time and build-up on both roads, and the same place in the range of decelerations.

    The decelerations are those of friction coefficients of 0.76-0.97 and 0.51-0.71. UN R152 Rev.2, Annex 3,
    tests on a dry road with a peak braking coefficient of at least 0.9; ABS reaches most of it. Wet asphalt
    has 0.5-0.7. The load of the car is a part of the range: mass does not change the friction limit, but a
    laden car loses about 5 % of its deceleration. UN R152 5.2.1.4 requires a car to avoid contact up to
    42 km/h in running order and up to 40 km/h laden; braking from the same time to collision needs a
    deceleration in proportion to the speed, and 40/42 is 5 % less. The ranges of dead time and build-up
    surround the 0.1 s and 0.2 s of `BrakeParams`; they are assumptions.

    Args:
        world: Number of the world, >= 0.
        wet: Whether the road is wet.

    Raises:
        ValueError: If the number is negative or not whole, or `wet` is no bool.

    Example:
        >>> draw_brake(3, wet=False) == draw_brake(3, wet=False)
        True
    """
    rng = np.random.default_rng([check_whole("world", world, 0), _STREAM])
    deceleration = WET_DECELERATION if check_flag("wet", wet) else DRY_DECELERATION
    values = [float(rng.uniform(*limits)) for limits in (deceleration, DEAD_TIMES, BUILD_UPS)]
    return BrakeParams(max_deceleration=values[0], dead_time=values[1], build_up=values[2])


@kernel(exact=True)
def put_demand(line: np.record, pending: np.ndarray, delay: float, demand: float) -> None:
    """Add a demand in [-1, 1] to a `DELAY_LINE` at its current time; a repeated demand is not stored.

    Args:
        line: `DELAY_LINE` record.
        pending: Demands in the line, each with the time at which it becomes active, shape (capacity, 2).
        delay: Delay of every demand [s].
        demand: The demand.
    """
    if demand != line.last_put:
        line.last_put = demand
        pending[line.count, 0], pending[line.count, 1] = line.time + delay, demand
        line.count += 1


@kernel(exact=True)
def next_part(line: np.record, pending: np.ndarray, end: float) -> tuple[float, float]:
    """Advance a `DELAY_LINE` to its next change of demand, at most to the time `end` [s].

    Returns:
        Duration of this part [s], and the demand that is active in it.
    """
    # A demand due within a nanosecond of the end belongs to the next step.
    while line.count > 0 and pending[0, 0] < end - 1e-9:
        due, demand, before, start = pending[0, 0], pending[0, 1], line.demand, line.time
        line.count -= 1
        for i in range(line.count):
            pending[i, 0], pending[i, 1] = pending[i + 1, 0], pending[i + 1, 1]
        line.demand = demand
        if due > start:
            line.time = due
            return due - start, before
    duration = end - line.time
    line.time = end
    return duration, line.demand


class DelayLine:
    """A queue that delays demands by a constant time, which need not be a multiple of the simulation step.

    Args:
        delay: Delay of every demand [s].
    """

    def __init__(self, delay: float) -> None:
        self.delay = delay
        self._line = np.zeros((), DELAY_LINE)
        self._pending = np.zeros((8, 2))

    def put(self, demand: float) -> None:
        """Add a demand in [-1, 1] at the current time."""
        if self._line["count"] == len(self._pending):
            self._pending = np.concatenate((self._pending, np.zeros_like(self._pending)))
        put_demand(self._line[()], self._pending, self.delay, float(demand))

    def advance(self, dt: float) -> list[tuple[float, float]]:
        """Advance by `dt` [s] and return (duration [s], active demand) for each part of that time."""
        line, parts = self._line[()], list[tuple[float, float]]()
        end = float(line["time"]) + dt
        while not parts or line["time"] < end:
            parts.append(next_part(line, self._pending, end))
        return parts
