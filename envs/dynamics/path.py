"""Paths along bends: the pose at a distance, and the path of a car's rear axle."""

from math import cos, sin, tan

import numpy as np

from lgmd_gym.envs.dynamics.script import Bend, Pose
from lgmd_gym.kernels import kernel

# Nodes and weights of three-point Gauss-Legendre quadrature on [0, 1]. Over cells of this length its error is
# about 1e-12 m.
GAUSS = ((0.5 - 0.15**0.5, 5 / 18), (0.5, 8 / 18), (0.5 + 0.15**0.5, 5 / 18))
_CELL = 0.5  # maximum length of a curved cell, roughly [m]


class Path:
    """A path along bends, straight before and after them.

    Args:
        start: Pose at distance 0.
        bends: Bends in driving order.

    Attributes:
        table: Cells of the path, float64, shape (cells, 6): distance at which the cell begins [m], then x, y,
            heading, curvature and slope of the curvature there. The last cell is straight and endless.
    """

    def __init__(self, start: Pose, bends: tuple[Bend, ...] = ()) -> None:
        self.start = start
        self.bends = bends
        self.table = path_table(start, bends)

    def __deepcopy__(self, memo: dict[int, object]) -> "Path":
        """Return the path itself: it is immutable, and copies of an environment share it."""
        return self

    @property
    def straight(self) -> bool:
        """Whether the path has no bends."""
        return not self.bends

    def pose(self, distance: float) -> Pose:
        """Return the pose at a distance along the path [m]; negative distances are before its start."""
        return pose_at(self.table, float(distance))


def path_table(start: Pose, bends: tuple[Bend, ...] = ()) -> np.ndarray:
    """Return the cells of a path; see `Path.table`."""
    if not bends:
        return np.array([(0.0, *start, 0.0, 0.0)])
    sections = np.array([(bend.length, bend.curvature, bend.last_curvature) for bend in bends])
    return _integrate(float(start.x), float(start.y), float(start.heading), sections)


@kernel(exact=True)
def pose_at(table: np.ndarray, distance: float) -> Pose:
    """Return the pose at a distance along a path [m], given its `Path.table`."""
    low, high = 0, table.shape[0]
    while low < high:  # the number of cells that begin at or before this distance
        middle = (low + high) // 2
        if distance < table[middle, 0]:
            high = middle
        else:
            low = middle + 1
    cell = table[max(low - 1, 0)]
    if low == 0:
        return Pose(cell[1] + distance * cos(cell[3]), cell[2] + distance * sin(cell[3]), cell[3])
    return advance_pose(cell[1], cell[2], cell[3], cell[4], cell[5], distance - cell[0])


@kernel(exact=True)
def centre_at(table: np.ndarray, distance: float, reference: float) -> Pose:
    """Return the pose of a body's centre, which is `reference` [m] ahead of the point on the path."""
    pose = pose_at(table, distance)
    if reference == 0.0:
        return pose
    return Pose(pose.x + reference * cos(pose.heading), pose.y + reference * sin(pose.heading), pose.heading)


@kernel(exact=True)
def advance_pose(x: float, y: float, heading: float, curvature: float, slope: float, distance: float) -> Pose:
    """Return the pose after a distance on a clothoid.

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


@kernel(exact=True, arrays=True)
def _integrate(x: float, y: float, heading: float, sections: np.ndarray) -> np.ndarray:
    """Return the cells along sections of (length, first curvature, last curvature), + to the left."""
    counts = np.ones(sections.shape[0], np.int64)
    for i in range(sections.shape[0]):
        if sections[i, 1] != 0.0 or sections[i, 2] != 0.0:
            counts[i] = max(int(sections[i, 0] / _CELL), 1)
    table = np.zeros((counts.sum() + 1, 6))
    row, station, pose = 0, 0.0, Pose(x, y, heading)
    for i in range(sections.shape[0]):
        slope = -(sections[i, 2] - sections[i, 1]) / sections[i, 0]
        length = sections[i, 0] / counts[i]
        for number in range(counts[i]):
            curvature = -sections[i, 1] + slope * length * number
            table[row, 0], table[row, 1], table[row, 2] = station, pose.x, pose.y
            table[row, 3], table[row, 4], table[row, 5] = pose.heading, curvature, slope
            pose = advance_pose(pose.x, pose.y, pose.heading, curvature, slope, length)
            station += length
            row += 1
    table[row, 0], table[row, 1], table[row, 2], table[row, 3] = station, pose.x, pose.y, pose.heading
    return table


_STEP = 0.1  # [m] along the path of the front axle
_STRAIGHT = 1e-5  # [rad], steering angle below which the car drives straight on


def rear_axle_path(bends: tuple[Bend, ...], wheelbase: float) -> tuple[Bend, ...]:
    """Return the path of the rear axle of a car whose front axle follows a path.

    The wheels do not slip: the rear axle follows the front axle like a trailer, and the car's heading is the
    direction of its path. The first bend should be a straight; after the last one the front axle drives
    straight on until the steering angle is below 10⁻⁵ rad.

    Args:
        bends: Bends of the path of the front axle.
        wheelbase: Distance between the axles, > 0 [m].
    """
    steering, result = 0.0, list[Bend]()
    for bend in bends:
        if steering == bend.curvature == bend.last_curvature == 0.0:
            result.append(bend)
            continue
        count = max(round(bend.length / _STEP), 1)
        slope, step = (bend.last_curvature - bend.curvature) / bend.length, bend.length / count
        for number in range(count):
            curvature = bend.curvature + slope * step * (number + 0.5)
            steering = _follow(steering, curvature, step, wheelbase, result)
    while abs(steering) > _STRAIGHT:
        steering = _follow(steering, 0.0, _STEP, wheelbase, result)
    return tuple(result)


def _follow(steering: float, curvature: float, step: float, wheelbase: float, result: list[Bend]) -> float:
    """Append the rear axle's path over one step of the front axle, and return the steering angle after it.

    Args:
        steering: Direction of the front axle's path relative to the car's heading, + to the left [rad].
        curvature: Mean curvature of the front axle's path in the step, + to the left [1/m].
        step: Length of the step [m].
        wheelbase: Distance between the axles [m].
        result: Bends of the rear axle's path.
    """

    def change(angle: float) -> float:
        return curvature - sin(angle) / wheelbase

    # Fourth-order Runge-Kutta; the heading turns by what the steering angle does not.
    first = change(steering)
    second = change(steering + step / 2 * first)
    third = change(steering + step / 2 * second)
    after = steering + step / 6 * (first + 2 * second + 2 * third + change(steering + step * third))
    turned = curvature * step - (after - steering)
    length = step * (cos(steering) + 4 * cos((steering + after) / 2) + cos(after)) / 6
    start, end = tan(steering) / wheelbase, tan(after) / wheelbase
    rest = turned / length - (start + end) / 2  # makes the bend turn exactly as far as the car
    result.append(Bend(length, start + rest, end + rest))
    return after
