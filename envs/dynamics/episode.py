"""One simulation step of all bodies with contact detection, and the end of an episode.

The contact of bodies that turn or change their speed is found by cutting the step into short parts. The
speeds and distances at their ends are exact: the motion of the step is repeated up to that time.
"""

from math import cos, hypot, inf, isnan, sin
from typing import NamedTuple, TypeAlias

import numpy as np

from lgmd_gym.envs.dynamics.bodies import ROAD_MARKING, copy_motion, move, step_actor, step_ego
from lgmd_gym.envs.dynamics.contact import Rectangle, first_touch
from lgmd_gym.envs.dynamics.longitudinal import advance, step_script
from lgmd_gym.envs.dynamics.path import centre_at
from lgmd_gym.kernels import kernel

Arrays: TypeAlias = tuple[np.ndarray, ...]
"""The fields of a NamedTuple of arrays, or the NamedTuple itself, which is slower to pass from Python."""


PASSED_DISTANCE = 2.0  # [m] behind the ego's rear beyond which an actor has been passed

EPISODE = np.dtype(
    [
        *((name, np.int64) for name in ("bodies", "target", "touched", "closed_in", "steps")),
        *((name, np.float64) for name in ("impact_speed", "relative_impact_speed")),
        *(
            (name, np.float64)
            for name in ("time", "duration", "top_speed", "last_speed", "last_acceleration", "resolved")
        ),
    ]
)
"""State of an episode: number of bodies; index of the target's body, 0 without one; index of the body in
contact with the ego, 0 without contact; whether the ego has closed in on an actor; simulation steps; ego
speed and speed relative to the other body at contact, inf without contact [m/s]; time after the last decision
and duration [s], highest scripted speed [m/s], ego speed [m/s] and acceleration [m/s²] before the last
decision; time for which the conflict has been resolved, see
`is_terminated` [s]."""


class Physics(NamedTuple):
    """Arrays of the physics, the environments along the first axis."""

    bodies: np.ndarray  # see `PhysicsState`
    episodes: np.ndarray  # see `PhysicsState`
    egos: np.ndarray  # see `PhysicsState`
    lines: np.ndarray  # see `PhysicsState`
    pending: np.ndarray  # see `PhysicsState`
    segments: np.ndarray  # see `PhysicsState`
    paths: np.ndarray  # see `PhysicsState`
    before: np.ndarray  # see `PhysicsState`
    parts: np.ndarray  # see `PhysicsState`
    brakes: np.ndarray  # `BRAKE` records, shape (N,)
    weights: np.ndarray  # `REWARD` records, shape (N,)


@kernel(exact=True)
def step_environment(i: int, dt: float, physics: Arrays) -> None:
    """Advance environment i by `dt` [s]; see `step_bodies`."""
    physics = Physics(*physics)
    step_bodies(
        physics.bodies[i],
        physics.episodes[i],
        physics.egos[i],
        physics.lines[i],
        physics.pending[i],
        physics.brakes[i],
        physics.segments[i],
        physics.paths[i],
        physics.before[i],
        physics.parts[i],
        dt,
    )


@kernel(exact=True)
def step_bodies(
    bodies: np.ndarray,
    episode: np.record,
    ego: np.record,
    line: np.record,
    pending: np.ndarray,
    brake: np.record,
    segments: np.ndarray,
    paths: np.ndarray,
    before: np.ndarray,
    parts: np.ndarray,
    dt: float,
) -> None:
    """Advance all bodies by `dt` [s], or up to the ego's first contact; after it they do not move.

    Args:
        bodies: `BODY` records, the ego first.
        episode: `EPISODE` record.
        ego: `EGO_STATE` record.
        line: `DELAY_LINE` record.
        pending: Demands in the line, see `put_demand`.
        brake: `BRAKE` record.
        segments: Table of the scripts' segments.
        paths: Table of the paths' cells.
        before: Scratch memory, `STEP_START` records, shape (bodies + 1,).
        parts: Scratch memory, see `step_ego`.
        dt: Duration [s].
    """
    if episode.touched > 0:
        return
    for i in range(episode.bodies):
        body, start = bodies[i], before[i]
        start.x, start.y, start.heading, start.travelled = body.x, body.y, body.heading, body.travelled
        copy_motion(body, start)
    step_ego(bodies[0], ego, line, pending, brake, segments, paths, parts, dt)
    for i in range(1, episode.bodies):
        step_actor(bodies[i], segments, paths, dt)
    step = StepMotion(before, parts, brake.jerk, segments, paths, dt)
    time, touched = first_contact_of(bodies, episode.bodies, step)
    if touched == 0:
        return
    for i in range(episode.bodies):
        if bodies[i].kind != ROAD_MARKING:
            _move_back(bodies, i, step, time)
    here, other = bodies[0], bodies[touched]
    episode.touched, episode.impact_speed = touched, here.speed
    episode.relative_impact_speed = here.speed - speed_along_ego(here, other)


@kernel(exact=True)
def _move_back(bodies: np.ndarray, i: int, step: "StepMotion", part: float) -> None:
    """Move a body from the end of a step to its place after a part of it."""
    body, before = bodies[i], step.before[i]
    covered, changed = body.travelled - before.travelled, body.speed != before.speed
    distance, body.speed = progress(bodies, i, step, part)
    move(body, step.paths, distance - covered if changed else (part - 1.0) * covered)


@kernel(exact=True)
def first_contact_of(bodies: np.ndarray, count: int, step: "StepMotion") -> tuple[float, int]:
    """Return the time at which the ego first touches a body, and its index; else `inf` and 0.

    Args:
        bodies: `BODY` records after the step.
        count: Number of bodies.
        step: `StepMotion`.

    Returns:
        The time as a part of the step, and the index.
    """
    found, touched, before = inf, 0, step.before
    for i in range(1, count):
        if bodies[i].kind == ROAD_MARKING:
            continue
        if _is_uniform(bodies[0], before[0]) and _is_uniform(bodies[i], before[i]):
            time = uniform_touch(bodies[0], bodies[i], before[0], before[i])
        else:
            time = touch_time(bodies, i, step)
        if time < found:
            found, touched = time, i
    return found, touched


@kernel(exact=True)
def _is_uniform(body: np.record, before: np.record) -> bool:
    """Return whether a body has kept its heading and speed in a step."""
    return body.heading == before.heading and body.speed == before.speed


@kernel(exact=True)
def is_terminated(
    bodies: np.ndarray, episode: np.record, approached: bool, dt: float, follow_up: float
) -> bool:
    """Return whether the episode is over, see `BrakingEnv`; updates the episode, once per decision.

    Args:
        bodies: `BODY` records, the ego first.
        episode: `EPISODE` record.
        approached: Whether a vehicle is about to touch a standing ego, see `is_approached`.
        dt: Duration of the decision [s].
        follow_up: Time for which a standstill, or a speed below those of all actors ahead, must last [s].
    """
    ego = bodies[0]
    if episode.touched > 0:
        return True
    if ego.speed == 0.0:
        resolved = ego.script_speed > 0.0 and not approached
    else:
        left, resolved = _conflicts_left(bodies, episode)
        if left == 0:
            return True
    if not resolved:
        episode.resolved = 0.0
        return False
    episode.resolved += dt
    return episode.resolved > follow_up - 1e-9


@kernel(exact=True)
def _conflicts_left(bodies: np.ndarray, episode: np.record) -> tuple[int, bool]:
    """Return how many actors a moving ego has not passed, and whether it falls behind all of them.

    The number is -1 without actors. Updates `closed_in`.
    """
    ego, solid, left, slower = bodies[0], 0, 0, True
    for i in range(1, episode.bodies):
        body = bodies[i]
        if body.kind == ROAD_MARKING:
            continue
        solid += 1
        if _is_passed(ego, body):
            continue
        left += 1
        along = speed_along_ego(ego, body)
        if ego.speed > along:
            episode.closed_in = 1
        ended, straight = body.segment == body.segment_end, body.path_end - body.path == 1
        slower = slower and ended and straight and ego.speed < along
    if solid == 0:
        return -1, False
    return left, episode.closed_in > 0 and slower


@kernel(exact=True)
def _is_passed(ego: np.record, body: np.record) -> bool:
    """Return whether a body is behind the ego's rear and not faster than the ego along its heading."""
    dx, dy = body.x - ego.x, body.y - ego.y
    behind = -(dx * cos(ego.heading) + dy * sin(ego.heading)) - (ego.length + body.length) / 2
    return behind > PASSED_DISTANCE and speed_along_ego(ego, body) <= ego.speed


@kernel(exact=True)
def speed_along_ego(ego: np.record, body: np.record) -> float:
    """Return a body's speed along the ego's heading [m/s]."""
    return body.speed * cos(body.heading - ego.heading)


@kernel(exact=True)
def is_truncated(episode: np.record) -> bool:
    """Return whether the scenario's duration has passed."""
    return episode.time >= episode.duration - 1e-9


PARTS = 16  # of a step


class StepMotion(NamedTuple):
    """What the motion of the bodies within a step depends on."""

    before: np.ndarray  # `STEP_START` records of the bodies, and one more as scratch memory
    parts: np.ndarray  # see `step_ego`
    jerk: float  # slope of every change of the ego's acceleration [m/s³]
    segments: np.ndarray  # table of the scripts' segments
    paths: np.ndarray  # table of the paths' cells
    dt: float  # duration of the step [s]


@kernel(exact=True)
def progress(bodies: np.ndarray, i: int, step: "StepMotion", part: float) -> tuple[float, float]:
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
def _ego_progress(moving: np.record, step: "StepMotion", time: float) -> tuple[float, float]:
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
def uniform_touch(ego: np.record, body: np.record, ego_before: np.record, before: np.record) -> float:
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
def touch_time(bodies: np.ndarray, i: int, step: "StepMotion") -> float:
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
def _outline_at(bodies: np.ndarray, i: int, step: "StepMotion", part: float) -> Rectangle:
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
