"""Contact within a step of bodies that turn or change their speed: the step is cut into short parts.

The speeds and distances at their ends are exact: the motion of the step is repeated up to that time.
"""

from math import hypot, inf, isnan
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.envs.dynamics.bodies import copy_motion
from lgmd_gym.envs.dynamics.contact import Rectangle, first_touch
from lgmd_gym.envs.dynamics.longitudinal import advance
from lgmd_gym.envs.dynamics.path import centre_at
from lgmd_gym.envs.dynamics.speed_profile import step_script
from lgmd_gym.kernels import kernel

PARTS = 16  # of a step


class StepMotion(NamedTuple):
    """What the motion of the bodies within a step depends on.

    Attributes:
        before: `STEP_START` records of the bodies, and one more as scratch memory.
        parts: See `step_ego`.
        jerk: Slope of every change of the ego's acceleration [m/s³].
        segments: Table of the scripts' segments.
        paths: Table of the paths' cells.
        dt: Duration of the step [s].
    """

    before: np.ndarray
    parts: np.ndarray
    jerk: float
    segments: np.ndarray
    paths: np.ndarray
    dt: float


@kernel(exact=True)
def progress(bodies: np.ndarray, i: int, step: Any, part: float) -> tuple[float, float]:
    """Return the distance [m] that a body has covered after a part of a step, and its speed there [m/s].

    Args:
        bodies: `BODY` records after the step, the ego first.
        i: Index of the body.
        step: `StepMotion`.
        part: Time as a part of the step, in [0, 1].
    """
    body, before = bodies[i], step.before[i]
    if before.speed == body.speed:
        return part * (body.travelled - before.travelled), body.speed
    moving = step.before[len(step.before) - 1]
    copy_motion(before, moving)
    if i > 0:
        distance = step_script(moving, step.segments, part * step.dt)
        return distance, moving.script_speed
    return _ego_progress(moving, step, part * step.dt)


@kernel(exact=True)
def _ego_progress(moving: Any, step: Any, time: float) -> tuple[float, float]:
    """Advance the motion of the ego by a time [s] as `step_ego` did; return distance [m] and speed [m/s]."""
    distance, row = 0.0, 0
    while time > 0.0:
        duration, target = min(step.parts[row, 0], time), step.parts[row, 1]
        if isnan(target):
            distance += step_script(moving, step.segments, duration)
            moving.speed, moving.acceleration = moving.script_speed, moving.script_acceleration
        else:
            moved = advance(moving.speed, moving.acceleration, target, step.jerk, duration)
            distance += moved[0]
            moving.speed, moving.acceleration = moved[1], moved[2]
        time -= duration
        row += 1
    return distance, moving.speed


@kernel(exact=True)
def uniform_touch(ego: Any, body: Any, ego_before: Any, before: Any) -> float:
    """Return the first touch of two bodies in straight, uniform motion in a step as a part of it; else `inf`.

    Args:
        ego: Record of the ego after the step: position, heading and size.
        body: The same of the other body.
        ego_before: Record of the ego before the step: position and heading.
        before: The same of the other body.
    """
    start = Rectangle(ego_before.x, ego_before.y, ego_before.heading, ego.length, ego.width)
    old = Rectangle(before.x, before.y, before.heading, body.length, body.width)
    return first_touch(start, old, ego.x - start.x - (body.x - old.x), ego.y - start.y - (body.y - old.y))


@kernel(exact=True)
def touch_time(bodies: np.ndarray, i: int, step: Any) -> float:
    """Return the time of the first touch of the ego and body i as a part of a step; `inf` without a touch.

    Args:
        bodies: `BODY` records after the step, the ego first.
        i: Index of the other body.
        step: `StepMotion`.
    """
    ego, body, ego_before, before = bodies[0], bodies[i], step.before[0], step.before[i]
    moved = abs(ego.travelled - ego_before.travelled) + abs(body.travelled - before.travelled)
    reach = hypot(ego.length, ego.width) / 2 + hypot(body.length, body.width) / 2
    if hypot(ego_before.x - before.x, ego_before.y - before.y) > reach + moved:
        return inf
    a, c = _outline_at(bodies, 0, step, 0.0), _outline_at(bodies, i, step, 0.0)
    for number in range(PARTS):
        later = (number + 1.0) / PARTS
        b, d = _outline_at(bodies, 0, step, later), _outline_at(bodies, i, step, later)
        touch = touch_between(a, b, c, d)
        if touch <= 1.0:
            return (number + touch) / PARTS
        a, c = b, d
    return inf


@kernel(exact=True)
def _outline_at(bodies: np.ndarray, i: int, step: Any, part: float) -> Rectangle:
    """Return the outline of a body at a part of a step."""
    body, start = bodies[i], step.before[i].travelled
    if body.travelled == start:
        return Rectangle(body.x, body.y, body.heading, body.length, body.width)
    distance, _ = progress(bodies, i, step, part)
    pose = centre_at(step.paths[body.path : body.path_end], start + distance, body.reference)
    return Rectangle(pose.x, pose.y, pose.heading, body.length, body.width)


@kernel(exact=True)
def touch_between(a: Rectangle, b: Rectangle, c: Rectangle, d: Rectangle) -> float:
    """Return the first touch of bodies that move from outline a to b and from c to d; see `first_touch`."""
    dx, dy = (b.x - a.x) - (d.x - c.x), (b.y - a.y) - (d.y - c.y)
    return first_touch(_turned_half(a, b), _turned_half(c, d), dx, dy)


@kernel(exact=True)
def _turned_half(start: Rectangle, end: Rectangle) -> Rectangle:
    """Return the first outline with the mean heading of both."""
    return Rectangle(start.x, start.y, (start.heading + end.heading) / 2, start.length, start.width)
