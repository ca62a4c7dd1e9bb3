"""Scripts of road users as plain data: bends of their paths, and segments of their speeds."""

from collections.abc import Sequence
from dataclasses import MISSING, dataclass
from functools import partial
from typing import NamedTuple

from lgmd_gym.envs.dynamics.units import check_speed
from lgmd_gym.errors import check_finite, check_within, shown
from lgmd_gym.fields import Record, number, record, value

MAX_CURVATURE = 2.0
"""Largest curvature of a `Bend` [1/m]: a pedestrian turns at a corner with a radius of 0.5 m."""


@dataclass(frozen=True, slots=True)
class Bend:
    """A section of a path with linearly changing curvature: a straight, an arc or a clothoid.

    Attributes:
        length: Length along the path, > 0 [m].
        curvature: Curvature at the start, + to the left, in [-2, 2] [1/m].
        end_curvature: Curvature at the end [1/m]; None for constant curvature.
    """

    length: float
    curvature: float = 0.0
    end_curvature: float | None = None

    def __post_init__(self) -> None:
        if check_finite("length", self.length) <= 0.0:
            raise ValueError(f"length of a Bend must be > 0 m, got {shown(self.length)}")
        check_within("length", self.length, 0.0, 1e6, "m")
        check_within("curvature", self.curvature, -MAX_CURVATURE, MAX_CURVATURE, "1/m")
        check_within("end_curvature", self.last_curvature, -MAX_CURVATURE, MAX_CURVATURE, "1/m")

    @property
    def last_curvature(self) -> float:
        """Curvature at the end, + to the left [1/m]."""
        return self.curvature if self.end_curvature is None else self.end_curvature

    @property
    def turn(self) -> float:
        """Change of heading from start to end, + to the left [rad]."""
        return self.length * (self.curvature + self.last_curvature) / 2


class Pose(NamedTuple):
    """Position and heading in highway-env's axes: for a car along x, + is to the right for y and heading."""

    x: float  # [m]
    y: float  # [m]
    heading: float  # [rad]


def lane_change(length: float, offset: float) -> tuple[Bend, ...]:
    """Return four clothoids that shift a path sideways and restore its heading.

    Args:
        length: Length along the path, > 0 [m].
        offset: Lateral shift, + to the left [m].
    """
    # A module that loads numba; the registration of the scenario families must not.
    from lgmd_gym.envs.dynamics.path import Path

    quarter = length / 4
    curvature = 8.0 * offset / length**2  # exact for shallow shifts; the loop corrects it
    for _ in range(8):
        reached = -Path(Pose(0.0, 0.0, 0.0), _shift(quarter, curvature)).pose(length).y
        if abs(reached - offset) < 1e-10:
            break
        curvature *= offset / reached
    return _shift(quarter, curvature)


def _shift(quarter: float, curvature: float) -> tuple[Bend, ...]:
    return (
        Bend(quarter, 0.0, curvature),
        Bend(quarter, curvature, 0.0),
        Bend(quarter, 0.0, -curvature),
        Bend(quarter, -curvature, 0.0),
    )


def arc(radius: float, angle: float) -> Bend:
    """Return an arc of `radius` [m] through `angle` [rad], + to the left."""
    return Bend(radius * abs(angle), 1.0 / radius if angle > 0 else -1.0 / radius)


def turn(angle: float, radius: float, easing: float) -> tuple[Bend, ...]:
    """Return a clothoid, an arc and a clothoid that together turn by `angle`.

    Args:
        angle: Change of heading, + to the left, |angle| <= π [rad].
        radius: Radius of the arc [m].
        easing: Length of each clothoid [m]; shortened where the clothoids alone exceed the angle.
    """
    sign = 1.0 if angle > 0 else -1.0
    easing = min(easing, abs(angle) * radius)
    curvature = sign / radius
    rest = abs(angle) * radius - easing
    middle = (Bend(rest, curvature),) if rest > 1e-9 else ()
    return (Bend(easing, 0.0, curvature), *middle, Bend(easing, curvature, 0.0))


@record
class Segment(Record):
    """A scripted change of speed: acceleration from `start` until `final_speed` is reached."""

    start: float = number(MISSING, "[0, 10000]", "s", "Time at which the acceleration begins.")
    acceleration: float = number(
        MISSING,
        "[-12, 12]",
        "m/s²",
        "Full acceleration, negative for braking; it must lead to `final_speed`.",
    )
    build_up: float = number(0.0, "[0, 10]", "s", "Time from `start` to full acceleration, a linear ramp.")
    final_speed: float = value(
        0.0, partial(check_speed, zero=True), "Speed at the end of the segment, in [0, 40].", unit="m/s"
    )


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
