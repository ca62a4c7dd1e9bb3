"""Exact longitudinal motion: acceleration with bounded jerk, scripted speeds, and cars that stop at zero.

highway-env integrates with explicit Euler, an error of 0.9 m at 50 km/h and 15 Hz, and brakes through zero
into reverse. Here the acceleration is piecewise linear in time within one step. Speed and distance have a
closed form, and stopping distances do not depend on the step size.
"""

from math import copysign, inf, sqrt

import numpy as np

from lgmd_gym.envs.dynamics.script import Segment, check_profile
from lgmd_gym.kernels import kernel


@kernel(exact=True)
def advance(
    speed: float, acceleration: float, target: float, jerk: float, dt: float
) -> tuple[float, float, float]:
    """Move for `dt` while the acceleration ramps towards `target`; never reverse.

    Args:
        speed: Speed at the start, >= 0 [m/s].
        acceleration: Acceleration at the start [m/s²].
        target: Acceleration at the end of the ramp [m/s²].
        jerk: Slope of the ramp, > 0; `math.inf` for a jump [m/s³].
        dt: Duration, >= 0 [s].

    Returns:
        Distance travelled [m], speed [m/s] and acceleration [m/s²] at the end. A car that reaches zero speed
        while not accelerating stays there with acceleration 0.
    """
    if jerk == inf:
        acceleration = target
    change = target - acceleration
    ramp = min(abs(change) / jerk, dt)
    distance = 0.0
    for duration, slope in ((ramp, copysign(jerk, change)), (dt - ramp, 0.0)):
        if duration <= 0.0:
            continue
        stop = time_to_stop(speed, acceleration, slope)
        if stop <= duration:
            distance += stop * (speed + stop * (acceleration / 2 + stop * slope / 6))
            return distance, 0.0, 0.0
        distance += duration * (speed + duration * (acceleration / 2 + duration * slope / 6))
        speed += duration * (acceleration + duration * slope / 2)
        acceleration = target if slope and ramp < dt else acceleration + duration * slope
    return distance, max(speed, 0.0), acceleration


@kernel(exact=True)
def time_to_stop(speed: float, acceleration: float, jerk: float) -> float:
    """Return the first time at which v + a·t + j·t²/2 falls to zero [s]; `math.inf` if it never does."""
    if speed <= 0.0 and (acceleration < 0.0 or (acceleration == 0.0 and jerk <= 0.0)):
        return 0.0
    if jerk == 0.0:
        return -speed / acceleration if acceleration < 0.0 else inf
    under_root = acceleration * acceleration - 2.0 * jerk * speed
    if under_root < 0.0 or (acceleration >= 0.0 and jerk > 0.0):
        return inf
    root = sqrt(under_root)
    # The form of the first root without cancellation.
    if acceleration >= 0.0:
        return (acceleration + root) / -jerk
    return 2.0 * speed / (root - acceleration)


SCRIPT_FIELDS = [
    ("script_speed", np.float64),
    ("script_acceleration", np.float64),
    ("script_time", np.float64),
    ("segment", np.int64),
    ("segment_end", np.int64),
]
"""State of a script: speed [m/s], acceleration [m/s²], time since its start [s]; the rows of its remaining
segments in a table, first and last + 1."""


def segment_table(segments: tuple[Segment, ...]) -> np.ndarray:
    """Return segments as rows of start, acceleration, build-up and final speed; float64, shape (n, 4)."""
    rows = [(item.start, item.acceleration, item.build_up, item.final_speed) for item in segments]
    return np.array(rows, dtype=np.float64).reshape(len(rows), 4)


@kernel(exact=True)
def step_script(script: np.record, segments: np.ndarray, dt: float) -> float:
    """Advance a script, a record with `SCRIPT_FIELDS`, by `dt` [s]; returns the distance travelled [m].

    Speed is constant between the segments. A segment that starts before the previous one has ended is delayed
    until then.
    """
    end = script.script_time + dt
    distance = 0.0
    while script.segment < script.segment_end and segments[script.segment, 0] < end:
        start, acceleration, build_up, final_speed = segments[script.segment]
        distance += _advance_script(script, 0.0, inf, start - script.script_time)
        jerk = abs(acceleration) / build_up if build_up > 0.0 else inf
        distance += _advance_script(script, acceleration, jerk, end - script.script_time)
        if (final_speed - script.script_speed) * copysign(1.0, acceleration) > 0.0:
            break
        script.segment += 1
        script.script_speed, script.script_acceleration = final_speed, 0.0
    return distance + _advance_script(script, 0.0, inf, end - script.script_time)


@kernel(exact=True)
def _advance_script(script: np.record, target: float, jerk: float, duration: float) -> float:
    """Advance speed and time, and return the distance travelled [m]."""
    if duration <= 0.0:
        return 0.0
    moved = advance(script.script_speed, script.script_acceleration, target, jerk, duration)
    script.script_speed, script.script_acceleration = moved[1], moved[2]
    script.script_time += duration
    return moved[0]


class SpeedProfile:
    """A speed that follows scripted segments; see `step_script`.

    Args:
        speed: Initial speed [m/s].
        segments: Segments in order of their start.

    Raises:
        ValueError: If the acceleration of a segment does not lead to its final speed.
    """

    def __init__(self, speed: float, segments: tuple[Segment, ...] = ()) -> None:
        check_profile(speed, segments)
        # Fields of its record are attributes, also without compilation.
        self._script = np.zeros((), SCRIPT_FIELDS).view(np.recarray)
        self._script["script_speed"], self._script["segment_end"] = speed, len(segments)
        self._segments = segment_table(segments)

    @property
    def speed(self) -> float:
        """Current speed [m/s]."""
        return float(self._script["script_speed"])

    @property
    def acceleration(self) -> float:
        """Current acceleration [m/s²]."""
        return float(self._script["script_acceleration"])

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return float(self._script["script_time"])

    @property
    def finished(self) -> bool:
        """Whether all segments have ended."""
        return bool(self._script["segment"] == self._script["segment_end"])

    def step(self, dt: float) -> float:
        """Advance by `dt` [s] and return the distance travelled [m]."""
        return step_script(self._script[()], self._segments, dt)
