"""Vehicle paths: sequences of straights, arcs and clothoids."""

from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property
from math import cos, sin
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.envs.dynamics.units import check_finite, check_within

# Nodes and weights of three-point Gauss-Legendre quadrature on [0, 1]. Over cells of this length its error is
# about 1e-12 m.
GAUSS = ((0.5 - 0.15**0.5, 5 / 18), (0.5, 8 / 18), (0.5 + 0.15**0.5, 5 / 18))
_CELL = 0.5  # [m]


@dataclass(frozen=True, slots=True)
class Bend:
    """A section of a path with linearly changing curvature: a straight, an arc or a clothoid.

    Attributes:
        length: Length along the path, > 0 [m].
        curvature: Curvature at the start, + to the left, in [-1, 1] [1/m].
        end_curvature: Curvature at the end [1/m]; None for constant curvature.
    """

    length: float
    curvature: float = 0.0
    end_curvature: float | None = None

    def __post_init__(self) -> None:
        if check_finite("length", self.length) <= 0.0:
            raise ValueError(f"length of a Bend must be > 0 m, got {self.length!r}")
        check_within("curvature", self.curvature, -1.0, 1.0, "1/m")
        check_within("end_curvature", self.last_curvature, -1.0, 1.0, "1/m")

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


class Path:
    """A path along bends, straight before and after them.

    Args:
        start: Pose at distance 0.
        bends: Bends in driving order.

    Attributes:
        stations: Ascending distances at which cells begin [m].
        cells: x, y, heading, curvature and slope of the curvature at the start of each cell.
    """

    def __init__(self, start: Pose, bends: tuple[Bend, ...] = ()) -> None:
        self.start = start
        self.bends = bends
        self.stations, self.cells = _integrate(start, bends)

    def __deepcopy__(self, memo: dict[int, Any]) -> "Path":
        """Return the path itself: it is immutable, and copies of an environment share it."""
        return self

    @cached_property
    def table(self) -> np.ndarray:
        """Stations and cells for the kernels of `swept_contact`, shape (cells, 6)."""
        return np.column_stack([np.array(self.stations), np.array(self.cells)])

    @property
    def straight(self) -> bool:
        """Whether the path has no bends."""
        return not self.bends

    def pose(self, distance: float) -> Pose:
        """Return the pose at a distance along the path [m]; negative distances are before its start."""
        index = bisect_right(self.stations, distance) - 1
        if index < 0:
            x, y, heading, _, _ = self.cells[0]
            return Pose(x + distance * cos(heading), y + distance * sin(heading), heading)
        x, y, heading, curvature, slope = self.cells[index]
        return advance_pose(x, y, heading, curvature, slope, distance - self.stations[index])


def advance_pose(x: float, y: float, heading: float, curvature: float, slope: float, distance: float) -> Pose:
    """Return the pose after a distance on a clothoid; `swept_contact` compiles this function for its kernels.

    Args:
        x: Initial position [m].
        y: Initial position [m].
        heading: Initial heading [rad].
        curvature: Initial curvature, + to the right [1/m].
        slope: Change of the curvature per distance [1/m²].
        distance: Distance along the clothoid [m].
    """
    if curvature == 0.0 and slope == 0.0:
        return Pose(x + distance * cos(heading), y + distance * sin(heading), heading)
    for node, weight in GAUSS:
        part = node * distance
        angle = heading + part * (curvature + part * slope / 2)
        x += weight * distance * cos(angle)
        y += weight * distance * sin(angle)
    return Pose(x, y, heading + distance * (curvature + distance * slope / 2))


def _integrate(
    start: Pose, bends: tuple[Bend, ...]
) -> tuple[list[float], list[tuple[float, float, float, float, float]]]:
    """Return the stations and cells of a path."""
    stations, cells = [], []
    station, pose = 0.0, start
    for bend in bends:
        slope = -(bend.last_curvature - bend.curvature) / bend.length
        count = max(int(bend.length / _CELL), 1) if bend.curvature or slope else 1
        cell = bend.length / count
        for number in range(count):
            curvature = -bend.curvature + slope * cell * number
            stations.append(station)
            cells.append((pose.x, pose.y, pose.heading, curvature, slope))
            pose = advance_pose(pose.x, pose.y, pose.heading, curvature, slope, cell)
            station += cell
    stations.append(station)
    cells.append((pose.x, pose.y, pose.heading, 0.0, 0.0))
    return stations, cells


def lane_change(length: float, offset: float) -> tuple[Bend, ...]:
    """Return four clothoids that shift a path sideways and restore its heading.

    Args:
        length: Length along the path, > 0 [m].
        offset: Lateral shift, + to the left [m].
    """
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
