"""A scripted speed: phases of acceleration, followed exactly."""

from dataclasses import dataclass
from math import copysign, inf

from lgmd_gym.envs.dynamics.longitudinal import advance
from lgmd_gym.envs.dynamics.units import check_speed, check_within


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """From `start` on, accelerate until `final_speed` is reached.

    Attributes:
        start: Time of the onset [s].
        acceleration: Acceleration once built up, negative for braking [m/s²].
        build_up: Time from the onset to the full acceleration, a linear ramp [s].
        final_speed: Speed at which the phase ends [m/s].
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
    """A speed that changes by phases.

    Args:
        speed: At the start [m/s].
        phases: In order of their start; one that starts before the last has ended waits for it.

    Attributes:
        speed: At the present time [m/s].
        acceleration: At the present time [m/s²].
        time: Since the start [s].
    """

    def __init__(self, speed: float, phases: tuple[Segment, ...] = ()) -> None:
        self.speed = speed
        self.acceleration = 0.0
        self.time = 0.0
        self._phases = list(phases)

    @property
    def settled(self) -> bool:
        """Whether nothing is left to change."""
        return not self._phases

    def step(self, dt: float) -> float:
        """Advance by `dt` [s] and return the distance covered [m]."""
        end = self.time + dt
        travelled = 0.0
        while self._phases and self._phases[0].start < end:
            phase = self._phases[0]
            travelled += self._advance(0.0, inf, phase.start - self.time)
            jerk = abs(phase.acceleration) / phase.build_up if phase.build_up > 0.0 else inf
            travelled += self._advance(phase.acceleration, jerk, end - self.time)
            left = (phase.final_speed - self.speed) * copysign(1.0, phase.acceleration)
            if left > 0.0:
                break
            self._phases.pop(0)
            self.speed, self.acceleration = phase.final_speed, 0.0
        return travelled + self._advance(0.0, inf, end - self.time)

    def _advance(self, target: float, jerk: float, duration: float) -> float:
        """Advance speed and clock, and return the distance [m]."""
        if duration <= 0.0:
            return 0.0
        distance, self.speed, self.acceleration = advance(
            self.speed, self.acceleration, target, jerk, duration
        )
        self.time += duration
        return distance
