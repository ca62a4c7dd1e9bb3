"""One simulation step of all bodies with contact detection, and the end of an episode."""

from math import cos, inf, sin
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.envs.dynamics.arrays import Arrays
from lgmd_gym.envs.dynamics.bodies import ROAD_MARKING, copy_motion, move, step_actor, step_ego
from lgmd_gym.envs.dynamics.refined_contact import StepMotion, progress, touch_time, uniform_touch
from lgmd_gym.kernels import kernel

PASSED_DISTANCE = 2.0  # [m] behind the ego's rear beyond which an actor has been passed

EPISODE = np.dtype(
    [
        *((name, np.int64) for name in ("bodies", "target", "touched", "closed_in", "steps")),
        *((name, np.float64) for name in ("impact_speed", "relative_impact_speed")),
        *(
            (name, np.float64)
            for name in ("time", "duration", "top_speed", "last_speed", "last_acceleration")
        ),
    ]
)
"""State of an episode: number of bodies; index of the target's body, 0 without one; index of the body in
contact with the ego, 0 without contact; whether the ego has closed in on an actor; simulation steps; ego
speed and speed relative to the other body at contact, inf without contact [m/s]; time after the last decision
and duration [s], highest scripted speed [m/s], ego speed [m/s] and acceleration [m/s²] before the last
decision."""


class Physics(NamedTuple):
    """Arrays of the physics, the environments along the first axis.

    Attributes:
        bodies: See `PhysicsState`.
        episodes: See `PhysicsState`.
        egos: See `PhysicsState`.
        lines: See `PhysicsState`.
        pending: See `PhysicsState`.
        segments: See `PhysicsState`.
        paths: See `PhysicsState`.
        before: See `PhysicsState`.
        parts: See `PhysicsState`.
        brakes: `BRAKE` records, shape (N,).
        weights: `REWARD` records, shape (N,).
    """

    bodies: np.ndarray
    episodes: np.ndarray
    egos: np.ndarray
    lines: np.ndarray
    pending: np.ndarray
    segments: np.ndarray
    paths: np.ndarray
    before: np.ndarray
    parts: np.ndarray
    brakes: np.ndarray
    weights: np.ndarray


@kernel(exact=True)
def step_environment(i: int, dt: float, physics: Arrays) -> None:
    """Advance environment i by `dt` [s]; see `step_bodies`."""
    physics = Physics(*physics)
    step_bodies(
        physics.bodies[i], physics.episodes[i], physics.egos[i], physics.lines[i], physics.pending[i],
        physics.brakes[i], physics.segments[i], physics.paths[i], physics.before[i], physics.parts[i], dt,
    )  # fmt: skip


@kernel(exact=True)
def step_bodies(
    bodies: np.ndarray, episode: Any, ego: Any, line: Any, pending: np.ndarray, brake: Any,
    segments: np.ndarray, paths: np.ndarray, before: np.ndarray, parts: np.ndarray, dt: float,
) -> None:  # fmt: skip
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
def _move_back(bodies: np.ndarray, i: int, step: Any, part: float) -> None:
    """Move a body from the end of a step to its place after a part of it."""
    body, before = bodies[i], step.before[i]
    covered, changed = body.travelled - before.travelled, body.speed != before.speed
    distance, body.speed = progress(bodies, i, step, part)
    move(body, step.paths, distance - covered if changed else (part - 1.0) * covered)


@kernel(exact=True)
def first_contact_of(bodies: np.ndarray, count: int, step: Any) -> tuple[float, int]:
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
def _is_uniform(body: Any, before: Any) -> bool:
    """Return whether a body has kept its heading and speed in a step."""
    return body.heading == before.heading and body.speed == before.speed


@kernel(exact=True)
def is_terminated(bodies: np.ndarray, episode: Any, approached: bool) -> bool:
    """Return whether the episode is over, see `BrakingEnv`; updates `closed_in`, once per decision.

    Args:
        bodies: `BODY` records, the ego first.
        episode: `EPISODE` record.
        approached: Whether a vehicle is about to touch a standing ego, see `is_approached`.
    """
    ego = bodies[0]
    if episode.touched > 0:
        return True
    if ego.speed == 0.0:
        return ego.script_speed > 0.0 and not approached
    solid, left, resolved = 0, 0, True
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
        resolved = resolved and ended and straight and ego.speed < along
    if solid == 0:
        return False
    return left == 0 or (episode.closed_in > 0 and resolved)


@kernel(exact=True)
def _is_passed(ego: Any, body: Any) -> bool:
    """Return whether a body is behind the ego's rear and not faster than the ego along its heading."""
    dx, dy = body.x - ego.x, body.y - ego.y
    behind = -(dx * cos(ego.heading) + dy * sin(ego.heading)) - (ego.length + body.length) / 2
    return behind > PASSED_DISTANCE and speed_along_ego(ego, body) <= ego.speed


@kernel(exact=True)
def speed_along_ego(ego: Any, body: Any) -> float:
    """Return a body's speed along the ego's heading [m/s]."""
    return body.speed * cos(body.heading - ego.heading)


@kernel(exact=True)
def is_truncated(episode: Any) -> bool:
    """Return whether the scenario's duration has passed."""
    return episode.time >= episode.duration - 1e-9
