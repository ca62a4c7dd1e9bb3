"""Contact within a step of bodies that turn or change their speed: the step is cut into short parts."""

from math import hypot, inf
from typing import Any

import numpy as np

from lgmd_gym.envs.dynamics.contact import Rectangle, first_touch
from lgmd_gym.envs.dynamics.jit import compiled
from lgmd_gym.envs.dynamics.path import pose_at

PARTS = 16  # of a step


@compiled
def progress(speed: float, last: float, distance: float, dt: float, part: float) -> tuple[float, float]:
    """Return the share of a step's distance covered at a part of its time, and the speed there [m/s].

    The acceleration is constant, up to the standstill if the body stops within the step.

    Args:
        speed: Speed at the start of the step [m/s].
        last: Speed at its end [m/s].
        distance: Distance travelled in it [m].
        dt: Its duration [s].
        part: Time as a part of the step, in [0, 1].
    """
    if speed == last:
        return part, last
    if last == 0.0:
        stop = min(2.0 * distance / (speed * dt), 1.0)
        rest = max(1.0 - part / stop, 0.0) if stop > 0.0 else 0.0
        return 1.0 - rest * rest, rest * speed
    now = (1.0 - part) * speed + part * last
    return part * (speed + now) / (speed + last), now


@compiled
def touch_time(ego: Any, body: Any, ego_before: Any, before: Any, paths: np.ndarray, dt: float) -> float:
    """Return the time of the first touch of two bodies as a part of a step; `inf` if they do not touch.

    Args:
        ego: `BODY` record after the step.
        body: The other one.
        ego_before: x, y, heading, distance travelled and speed of the ego before the step.
        before: The same of the other body.
        paths: Table of the paths' cells.
        dt: Duration of the step [s].
    """
    moved = abs(ego.travelled - ego_before[3]) + abs(body.travelled - before[3])
    reach = hypot(ego.length, ego.width) / 2 + hypot(body.length, body.width) / 2
    if hypot(ego_before[0] - before[0], ego_before[1] - before[1]) > reach + moved:
        return inf
    a, c = _outline_at(ego, ego_before, paths, dt, 0.0), _outline_at(body, before, paths, dt, 0.0)
    for number in range(PARTS):
        later = (number + 1.0) / PARTS
        b, d = _outline_at(ego, ego_before, paths, dt, later), _outline_at(body, before, paths, dt, later)
        dx, dy = (b.x - a.x) - (d.x - c.x), (b.y - a.y) - (d.y - c.y)
        touch = first_touch(_turned_half(a, b), _turned_half(c, d), dx, dy)
        if touch <= 1.0:
            return (number + touch) / PARTS
        a, c = b, d
    return inf


@compiled
def _outline_at(body: Any, before: Any, paths: np.ndarray, dt: float, part: float) -> Rectangle:
    """Return the outline of a body at a part of a step."""
    distance = body.travelled - before[3]
    if distance == 0.0:
        return Rectangle(body.x, body.y, body.heading, body.length, body.width)
    share, _ = progress(before[4], body.speed, distance, dt, part)
    pose = pose_at(paths[body.path : body.path_end], before[3] + share * distance)
    return Rectangle(pose.x, pose.y, pose.heading, body.length, body.width)


@compiled
def _turned_half(start: Rectangle, end: Rectangle) -> Rectangle:
    """Return the first outline with the mean heading of both."""
    return Rectangle(start.x, start.y, (start.heading + end.heading) / 2, start.length, start.width)
