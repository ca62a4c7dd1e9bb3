"""Segments: scripted changes of speed."""

from collections.abc import Sequence
from dataclasses import dataclass

from lgmd_gym.envs.dynamics.units import check_speed
from lgmd_gym.errors import check_within


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """A scripted change of speed: acceleration from `start` until `final_speed` is reached.

    Attributes:
        start: Time at which the acceleration begins, in [0, 10000] [s].
        acceleration: Full acceleration, negative for braking, in [-12, 12] [m/s²].
        build_up: Time from `start` to the full acceleration, a linear ramp, in [0, 10] [s].
        final_speed: Speed at the end of the segment, in [0, 40] [m/s]; the acceleration must lead to it.
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


def check_profile(speed: float, profile: Sequence[Segment]) -> None:
    """Check the segments of a scripted speed.

    Args:
        speed: Speed before the first segment [m/s].
        profile: Segments; each begins at the final speed of the previous one.

    Raises:
        ValueError: If the segments are not in order of their start, or if the acceleration of one does not
            lead to its final speed.
    """
    starts = [segment.start for segment in profile]
    if starts != sorted(starts):
        raise ValueError(f"profile segments must be in order of their start, got starts {starts}")
    for segment in profile:
        change = segment.final_speed - speed
        if change != 0.0 and change * segment.acceleration <= 0.0:
            raise ValueError(
                f"a profile segment with acceleration {segment.acceleration:g} m/s² does not lead from "
                f"{speed:g} to final_speed {segment.final_speed:g} m/s; use an acceleration "
                f"{'> 0' if change > 0.0 else '< 0'}"
            )
        speed = segment.final_speed
