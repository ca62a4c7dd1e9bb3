"""When two touch that drive along bent paths: the kernels behind `measures`, which asks at every step.

They look ahead as `lgmd_gym.envs.dynamics.contact.first_touch` does within a step, piece of way after piece of way.
"""

from math import cos, hypot, inf, nan, sin
from typing import Any

import numpy as np
from numba import njit

from lgmd_gym.envs.dynamics.path import GAUSS

NODES = np.array(GAUSS)


@njit(cache=True, nogil=True)
def time_on_paths(
    one: Any, other: Any, speeds: tuple[float, float], sizes: Any, horizon: float, step: float
) -> float:  # pragma: no cover
    """Return when two first touch that keep their paths and speeds [s]; NaN for not within the horizon.

    Args:
        one: `Path.table` and how far along it the one is [m].
        other: The same of the other.
        speeds: Of the two [m/s].
        sizes: Length and width of the one and of the other [m].
        horizon: How far to look ahead [s].
        step: Time within which they are taken to move straight [s].
    """
    fastest = speeds[0] + speeds[1]
    reach = _reach(sizes[0], sizes[1]) + _reach(sizes[2], sizes[3])
    time = 0.0
    while time < horizon and fastest > 0.0:
        a = _pose(one[0], one[1] + speeds[0] * time)
        b = _pose(other[0], other[1] + speeds[1] * time)
        free = (hypot(b[0] - a[0], b[1] - a[1]) - reach) / fastest
        if free > step:  # even head-on they cannot touch before that time is over
            time += free
            continue
        later = time + step
        c = _pose(one[0], one[1] + speeds[0] * later)
        d = _pose(other[0], other[1] + speeds[1] * later)
        touch = _first_touch(a, b, sizes, (c[0] - a[0]) - (d[0] - b[0]), (c[1] - a[1]) - (d[1] - b[1]))
        if touch >= 0.0:
            return time + touch * step
        time = later
    return nan


@njit(cache=True, nogil=True)
def gap_on_path(
    one: Any, outline: tuple[float, float, float], sizes: Any, horizon: float, step: float
) -> float:  # pragma: no cover
    """Return how far one can go along its path before it touches what stands [m]; NaN for beyond the horizon.

    Args:
        one: `Path.table` and how far along it the one is [m].
        outline: Centre and heading of what stands.
        sizes: Length and width of the one and of what stands [m].
        horizon: How far to look ahead [m].
        step: Way that is taken to be straight [m].
    """
    reach = _reach(sizes[0], sizes[1]) + _reach(sizes[2], sizes[3])
    gone = 0.0
    while gone < horizon:
        here = _pose(one[0], one[1] + gone)
        free = hypot(outline[0] - here[0], outline[1] - here[1]) - reach
        if free > step:  # nothing can be touched before that way is gone
            gone += free
            continue
        there = _pose(one[0], one[1] + gone + step)
        touch = _first_touch(here, outline, sizes, there[0] - here[0], there[1] - here[1])
        if touch >= 0.0:
            return gone + touch * step
        gone += step
    return nan


@njit(cache=True, nogil=True)
def _pose(path: Any, distance: float) -> tuple[float, float, float]:  # pragma: no cover
    """Return x, y and heading at a distance along a path, as `Path.pose` does."""
    low, high = 0, len(path)
    while low < high:
        middle = (low + high) // 2
        if distance < path[middle, 0]:
            high = middle
        else:
            low = middle + 1
    index = low - 1
    if index < 0:
        x, y, heading = path[0, 1], path[0, 2], path[0, 3]
        return x + distance * cos(heading), y + distance * sin(heading), heading
    x, y, heading = path[index, 1], path[index, 2], path[index, 3]
    curvature, slope, way = path[index, 4], path[index, 5], distance - path[index, 0]
    if curvature == 0.0 and slope == 0.0:
        return x + way * cos(heading), y + way * sin(heading), heading
    for number in range(len(NODES)):
        part = NODES[number, 0] * way
        angle = heading + part * (curvature + part * slope / 2)
        x += NODES[number, 1] * way * cos(angle)
        y += NODES[number, 1] * way * sin(angle)
    return x, y, heading + way * (curvature + way * slope / 2)


@njit(cache=True, nogil=True)
def _reach(length: float, width: float) -> float:  # pragma: no cover
    return hypot(length, width) / 2


@njit(cache=True, nogil=True)
def _first_touch(a: Any, b: Any, sizes: Any, dx: float, dy: float) -> float:  # pragma: no cover
    """Return the fraction of the way at which they touch, as `first_touch` does; -1 for not at all."""
    apart_x, apart_y = b[0] - a[0], b[1] - a[1]
    reach_a, reach_b = _reach(sizes[0], sizes[1]), _reach(sizes[2], sizes[3])
    if hypot(apart_x, apart_y) > reach_a + reach_b + hypot(dx, dy):
        return -1.0
    cos_a, sin_a, cos_b, sin_b = cos(a[2]), sin(a[2]), cos(b[2]), sin(b[2])
    enter, leave = 0.0, 1.0
    for ax, ay in ((cos_a, sin_a), (-sin_a, cos_a), (cos_b, sin_b), (-sin_b, cos_b)):
        reach = 0.5 * (
            sizes[0] * abs(ax * cos_a + ay * sin_a)
            + sizes[1] * abs(ay * cos_a - ax * sin_a)
            + sizes[2] * abs(ax * cos_b + ay * sin_b)
            + sizes[3] * abs(ay * cos_b - ax * sin_b)
        )
        apart, travel = ax * apart_x + ay * apart_y, ax * dx + ay * dy
        if travel == 0.0:
            first, last = (-inf, inf) if abs(apart) < reach else (inf, -inf)
        else:
            first, last = (apart - reach) / travel, (apart + reach) / travel
            if first >= last:
                first, last = last, first
        enter, leave = max(enter, first), min(leave, last)
        if enter > leave:
            return -1.0
    return enter
