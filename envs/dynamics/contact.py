"""Contact of rectangles: a swept separating-axis test, exact for straight relative motion.

highway-env tests polygons after each step and looks one step ahead. It reports contact speeds up to one step
late and flags cars that stop a millimetre short. These functions find the first touch inside the step. For
predictions on curved paths, the motion is cut into short straight steps.
"""

from math import cos, hypot, inf, sin
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lgmd_gym.envs.dynamics.path import centre_at
from lgmd_gym.kernels import kernel

if TYPE_CHECKING:
    from highway_env.vehicle.objects import RoadObject


END = 0.25  # [m] from an end of the ego within which a touch belongs to that end
TOLERANCE = 0.02  # [m] by which a corner may be farther away than the nearest one and still touch


class Rectangle(NamedTuple):
    """The outline of a road object from above, in highway-env's axes (y to the right of a car along x)."""

    x: float  # centre [m]
    y: float  # centre [m]
    heading: float  # [rad]
    length: float  # [m]
    width: float  # [m]


class Contact(NamedTuple):
    """The ego's first contact."""

    other: "RoadObject"  # vehicle or obstacle in contact with the ego
    side: str  # part of the ego in contact: "front" (bumper with its corners), "rear" or "side"
    impact_speed: float  # ego speed at the contact [m/s]
    relative_impact_speed: float  # ego speed minus the other's speed along the ego's heading [m/s]

    @classmethod
    def between(cls, ego: "RoadObject", other: "RoadObject") -> "Contact":
        """Return the contact of two road objects that currently touch."""
        side = touched_side(outline(ego), outline(other))
        return cls(other, side, float(ego.speed), float(ego.speed) - speed_along(ego, other))


def outline(item: "RoadObject") -> Rectangle:
    """Return the outline of a highway-env vehicle or road object."""
    x, y = item.position
    return Rectangle(float(x), float(y), float(item.heading), float(item.LENGTH), float(item.WIDTH))


def speed_along(ego: "RoadObject", other: "RoadObject") -> float:
    """Return the other's speed along the ego's heading [m/s]."""
    return float(other.speed * cos(float(other.heading) - float(ego.heading)))


@kernel(exact=True)
def first_touch(moving: Rectangle, standing: Rectangle, dx: float, dy: float) -> float:
    """Return the fraction of a displacement at which `moving` first touches `standing`.

    Args:
        moving: The displaced rectangle; its heading does not change.
        standing: The other rectangle.
        dx: Displacement along x relative to `standing` [m].
        dy: Displacement along y relative to `standing` [m].

    Returns:
        A fraction in [0, 1], 0 for rectangles that overlap from the start, `inf` if they do not touch.
    """
    apart_x, apart_y = standing.x - moving.x, standing.y - moving.y
    reach = hypot(moving.length, moving.width) / 2 + hypot(standing.length, standing.width) / 2
    if hypot(apart_x, apart_y) > reach + hypot(dx, dy):
        return inf
    cos_a, sin_a = cos(moving.heading), sin(moving.heading)
    cos_b, sin_b = cos(standing.heading), sin(standing.heading)
    enter, leave = 0.0, 1.0
    for ax, ay in ((cos_a, sin_a), (-sin_a, cos_a), (cos_b, sin_b), (-sin_b, cos_b)):
        reach = 0.5 * (
            moving.length * abs(ax * cos_a + ay * sin_a)
            + moving.width * abs(ay * cos_a - ax * sin_a)
            + standing.length * abs(ax * cos_b + ay * sin_b)
            + standing.width * abs(ay * cos_b - ax * sin_b)
        )
        apart, travel = ax * apart_x + ay * apart_y, ax * dx + ay * dy
        if travel == 0.0:
            if abs(apart) >= reach:
                return inf
            continue
        first, last = (apart - reach) / travel, (apart + reach) / travel
        if first > last:
            first, last = last, first
        enter, leave = max(enter, first), min(leave, last)
        if enter > leave:
            return inf
    return enter


def touched_side(ego: Rectangle, other: Rectangle) -> str:
    """Return the part of the ego at which two touching rectangles meet: "front", "rear" or "side".

    The contact point is the mean of the corners of either rectangle that are nearest to the other one. A
    corner of the ego belongs to its front or rear.
    """
    corners = [(_distance(other, x, y), _local(ego, x, y)[0]) for x, y in _corners(ego)]
    corners += [(_distance(ego, x, y), _local(ego, x, y)[0]) for x, y in _corners(other)]
    nearest = min(distance for distance, _ in corners)
    touching = [along for distance, along in corners if distance <= nearest + TOLERANCE]
    along = sum(touching) / len(touching)
    if abs(along) < ego.length / 2 - END:
        return "side"
    return "front" if along > 0.0 else "rear"


def _corners(box: Rectangle) -> list[tuple[float, float]]:
    c, s = cos(box.heading), sin(box.heading)
    ends = [(x * box.length / 2, y * box.width / 2) for x in (1, -1) for y in (1, -1)]
    return [(box.x + x * c - y * s, box.y + x * s + y * c) for x, y in ends]


def _local(box: Rectangle, x: float, y: float) -> tuple[float, float]:
    """Return a point in the axes of a rectangle, relative to its centre [m]."""
    dx, dy = x - box.x, y - box.y
    c, s = cos(box.heading), sin(box.heading)
    return dx * c + dy * s, dy * c - dx * s


def _distance(box: Rectangle, x: float, y: float) -> float:
    """Return the distance of a point from a rectangle [m]; 0 inside."""
    along, across = _local(box, x, y)
    return hypot(max(abs(along) - box.length / 2, 0.0), max(abs(across) - box.width / 2, 0.0))


class PathMotion(NamedTuple):
    """A rectangle that moves along a path at constant speed."""

    table: np.ndarray  # `Path.table`
    travelled: float  # distance from the start of the path [m]
    speed: float  # [m/s]
    length: float  # [m]
    width: float  # [m]
    reference: float = 0.0  # distance of the centre ahead of the point on the path [m]


@kernel(exact=True)
def time_on_paths(
    one: "PathMotion", other: "PathMotion", horizon: float, step: float
) -> float:  # pragma: no cover
    """Return the time at which two moving rectangles first touch [s]; `inf` beyond the horizon.

    Args:
        one: First `PathMotion`.
        other: Second `PathMotion`.
        horizon: Prediction horizon [s].
        step: Duration of the straight steps [s].
    """
    fastest = one.speed + other.speed
    reach = hypot(one.length, one.width) / 2 + hypot(other.length, other.width) / 2
    time = 0.0
    while time < horizon and fastest > 0.0:
        a, b = _outline(one, one.speed * time), _outline(other, other.speed * time)
        free = (hypot(b.x - a.x, b.y - a.y) - reach) / fastest
        if free > step:  # no contact before that time, even head-on
            time += free
            continue
        later = time + step
        c, d = _outline(one, one.speed * later), _outline(other, other.speed * later)
        touch = first_touch(a, b, (c.x - a.x) - (d.x - b.x), (c.y - a.y) - (d.y - b.y))
        if touch <= 1.0:
            return time + touch * step
        time = later
    return inf


@kernel(exact=True)
def gap_on_path(
    one: "PathMotion", standing: Rectangle, horizon: float, step: float
) -> float:  # pragma: no cover
    """Return the distance along a path up to a standing rectangle [m]; `inf` beyond the horizon.

    Args:
        one: `PathMotion` of the moving rectangle; its speed is not used.
        standing: The standing rectangle.
        horizon: Prediction horizon [m].
        step: Length of the straight steps [m].
    """
    reach = hypot(one.length, one.width) / 2 + hypot(standing.length, standing.width) / 2
    gap = 0.0
    while gap < horizon:
        here = _outline(one, gap)
        free = hypot(standing.x - here.x, standing.y - here.y) - reach
        if free > step:  # no contact before that distance
            gap += free
            continue
        there = _outline(one, gap + step)
        touch = first_touch(here, standing, there.x - here.x, there.y - here.y)
        if touch <= 1.0:
            return gap + touch * step
        gap += step
    return inf


@kernel(exact=True)
def _outline(motion: "PathMotion", distance: float) -> Rectangle:  # pragma: no cover
    """Return the outline `distance` metres further along the path."""
    pose = centre_at(motion.table, motion.travelled + distance, motion.reference)
    return Rectangle(pose.x, pose.y, pose.heading, motion.length, motion.width)
