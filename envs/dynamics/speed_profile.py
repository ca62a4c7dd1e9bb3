"""Scripted speed: segments of acceleration, followed exactly."""

from dataclasses import dataclass
from math import copysign, inf

from lgmd_gym.envs.dynamics.longitudinal import advance
from lgmd_gym.envs.dynamics.units import check_speed, check_within


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """A scripted change of speed: acceleration from `start` until `final_speed` is reached.

    Attributes:
        start: Time at which the acceleration begins, in [0, 10000] [s].
        acceleration: Full acceleration, negative for braking, in [-12, 12] [m/s²].
        build_up: Time from `start` to the full acceleration, a linear ramp, in [0, 10] [s].
        final_speed: Speed at the end of the segment, in [0, 40] [m/s].
    """

    start: float
    acceleration: float
    build_up: float = 0.0
    final_speed: float = 0.0

    def __post_init__(self) -> None:
        check_within("start", self.start, 0.0, 1e4, "s")
        check_within("acceleration", self.acceleration, -12.0, 12.0, "m/s²")
        check_within("build_up", self.build_up, 0.0, 10.0, "s")
        check_speed("final_speed", self.final_speed, zero=True)


class SpeedProfile:
    """A speed that follows scripted segments and is constant between them.

    Args:
        speed: Initial speed [m/s].
        segments: Segments in order of their start. A segment that starts before the previous one has ended
            is delayed until then.

    Attributes:
        speed: Current speed [m/s].
        acceleration: Current acceleration [m/s²].
        time: Time since the start [s].
    """

    def __init__(self, speed: float, segments: tuple[Segment, ...] = ()) -> None:
        self.speed = speed
        self.acceleration = 0.0
        self.time = 0.0
        self._remaining = list(segments)

    @property
    def finished(self) -> bool:
        """Whether all segments have ended."""
        return not self._remaining

    def step(self, dt: float) -> float:
        """Advance by `dt` [s] and return the distance travelled [m]."""
        end = self.time + dt
        distance = 0.0
        while self._remaining and self._remaining[0].start < end:
            segment = self._remaining[0]
            distance += self._advance(0.0, inf, segment.start - self.time)
            jerk = abs(segment.acceleration) / segment.build_up if segment.build_up > 0.0 else inf
            distance += self._advance(segment.acceleration, jerk, end - self.time)
            remaining = (segment.final_speed - self.speed) * copysign(1.0, segment.acceleration)
            if remaining > 0.0:
                break
            self._remaining.pop(0)
            self.speed, self.acceleration = segment.final_speed, 0.0
        return distance + self._advance(0.0, inf, end - self.time)

    def _advance(self, target: float, jerk: float, duration: float) -> float:
        """Advance speed and time, and return the distance travelled [m]."""
        if duration <= 0.0:
            return 0.0
        distance, self.speed, self.acceleration = advance(
            self.speed, self.acceleration, target, jerk, duration
        )
        self.time += duration
        return distance
