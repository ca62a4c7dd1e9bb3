"""Compiled contact prediction on curved paths: the motion is cut into short straight steps."""

from math import hypot, inf
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.envs.dynamics.contact import Rectangle, first_touch
from lgmd_gym.envs.dynamics.path import centre_at
from lgmd_gym.kernels import kernel


class PathMotion(NamedTuple):
    """A rectangle that moves along a path at constant speed."""

    table: np.ndarray  # `Path.table`
    travelled: float  # distance from the start of the path [m]
    speed: float  # [m/s]
    length: float  # [m]
    width: float  # [m]
    reference: float = 0.0  # distance of the centre ahead of the point on the path [m]


@kernel(exact=True)
def time_on_paths(one: Any, other: Any, horizon: float, step: float) -> float:  # pragma: no cover
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
def gap_on_path(one: Any, standing: Rectangle, horizon: float, step: float) -> float:  # pragma: no cover
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
def _outline(motion: Any, distance: float) -> Rectangle:  # pragma: no cover
    """Return the outline `distance` metres further along the path."""
    pose = centre_at(motion.table, motion.travelled + distance, motion.reference)
    return Rectangle(pose.x, pose.y, pose.heading, motion.length, motion.width)
