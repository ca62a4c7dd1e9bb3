"""The ego and the actors of an episode as records, and their motion."""

from math import asin, atan, inf, nan, tan

import numpy as np

from lgmd_gym.envs.dynamics.brake import next_part
from lgmd_gym.envs.dynamics.contact import Rectangle
from lgmd_gym.envs.dynamics.longitudinal import SCRIPT_FIELDS, advance, step_script
from lgmd_gym.envs.dynamics.path import centre_at
from lgmd_gym.envs.dynamics.units import MAX_SPEED
from lgmd_gym.kernels import kernel

EGO, CAR, BOX, ROAD_MARKING, PEDESTRIAN, BICYCLE, MOTORCYCLE = 0, 1, 2, 3, 4, 5, 6  # kinds of bodies
REGAIN_TIME = 0.5  # [s] within which the driver regains the scripted speed after braking

BODY = np.dtype(
    [
        *(
            (name, np.float64)
            for name in ("x", "y", "heading", "speed", "acceleration", "travelled", "steering")
        ),
        *((name, np.float64) for name in ("length", "width", "height", "shade", "reference")),
        *((name, np.int64) for name in ("kind", "path", "path_end")),
        *SCRIPT_FIELDS,
    ]
)
"""A body: centre [m], heading [rad], speed [m/s], acceleration [m/s²], distance along its path [m], steering
angle of highway-env's bicycle model [rad], size [m], grey level, distance of its centre ahead of the point
that follows its path [m], kind, and the rows of its path in a table (first and last + 1); then its script."""

EGO_STATE = np.dtype([("on_script", np.int64), ("yaw_rate", np.float64)])
"""Whether the ego still follows its script, as no demand has become active; mean yaw rate over the last step,
+ to the right [rad/s]."""


STEP_START = np.dtype(
    [
        *((name, np.float64) for name in ("x", "y", "heading", "travelled", "speed", "acceleration")),
        *SCRIPT_FIELDS,
    ]
)
"""Fields of a body before a step, as in `BODY`: where it was, and what its motion in the step depends on."""


@kernel(exact=True)
def copy_motion(source: np.record, target: np.record) -> None:
    """Copy what the motion of a body depends on, between `BODY` and `STEP_START` records."""
    target.speed, target.acceleration = source.speed, source.acceleration
    target.script_speed, target.script_acceleration = source.script_speed, source.script_acceleration
    target.script_time, target.segment, target.segment_end = (
        source.script_time,
        source.segment,
        source.segment_end,
    )


@kernel(exact=True)
def outline_of(body: np.record) -> Rectangle:
    """Return the outline of a body."""
    return Rectangle(body.x, body.y, body.heading, body.length, body.width)


@kernel(exact=True)
def move(body: np.record, paths: np.ndarray, distance: float) -> None:
    """Move a body along its path by a distance [m]."""
    before = body.heading
    body.travelled += distance
    pose = centre_at(paths[body.path : body.path_end], body.travelled, body.reference)
    body.x, body.y, body.heading = pose.x, pose.y, pose.heading
    body.steering = 0.0
    if body.path_end - body.path > 1 and distance > 0.0:
        # The steering angle at which highway-env's bicycle model has the same yaw rate.
        slip = asin(max(-0.7, min(0.7, (body.heading - before) / distance * body.length / 2)))
        body.steering = atan(2.0 * tan(slip))


@kernel(exact=True)
def step_actor(body: np.record, segments: np.ndarray, paths: np.ndarray, dt: float) -> None:
    """Advance an actor by `dt` [s] along its script."""
    distance = step_script(body, segments, dt)
    body.speed, body.acceleration = body.script_speed, body.script_acceleration
    if distance != 0.0 or body.kind == CAR:
        move(body, paths, distance)


@kernel(exact=True)
def step_ego(
    body: np.record,
    ego: np.record,
    line: np.record,
    pending: np.ndarray,
    brake: np.record,
    segments: np.ndarray,
    paths: np.ndarray,
    parts: np.ndarray,
    dt: float,
) -> None:
    """Advance the ego by `dt` [s] under its delayed demands.

    Args:
        body: The ego's `BODY` record.
        ego: The ego's `EGO_STATE` record.
        line: `DELAY_LINE` record.
        pending: Demands in the line, see `put_demand`.
        brake: `BRAKE` record.
        segments: Table of the scripts' segments.
        paths: Table of the paths' cells.
        parts: Output: duration [s] and target acceleration [m/s²] of each part of the step. The target is NaN
            on the script, and the last duration is inf. Float64, shape (demands + 1, 2).
        dt: Duration [s].
    """
    heading, end, distance, number = body.heading, line.time + dt, 0.0, 0
    while True:
        duration, demand = next_part(line, pending, end)
        moved, target = _advance_ego(body, ego, brake, segments, duration, demand)
        distance += moved
        parts[number, 0], parts[number, 1] = duration, target
        if not line.time < end:
            break
        number += 1
    parts[number, 0] = inf
    move(body, paths, distance)
    ego.yaw_rate = (body.heading - heading) / dt


@kernel(exact=True)
def _advance_ego(
    body: np.record, ego: np.record, brake: np.record, segments: np.ndarray, duration: float, demand: float
) -> tuple[float, float]:
    """Advance the ego's speed under one demand.

    Returns:
        Distance travelled [m], and the target of the acceleration [m/s²]; NaN on the script.
    """
    scripted = step_script(body, segments, duration)
    if demand != 0.0:
        ego.on_script = 0
    if ego.on_script:
        body.speed, body.acceleration = body.script_speed, body.script_acceleration
        return scripted, nan
    target = _target_acceleration(body, brake, demand)
    moved = advance(body.speed, body.acceleration, target, brake.jerk, duration)
    body.speed, body.acceleration = moved[1], moved[2]
    return moved[0], target


@kernel(exact=True)
def _target_acceleration(body: np.record, brake: np.record, demand: float) -> float:
    """Return the ego's acceleration under a constant demand after the build-up [m/s²]."""
    if demand < 0.0:
        # A demand weaker than the scripted deceleration does not release the scripted brake.
        return min(demand * brake.max_deceleration, body.script_acceleration)
    if demand > 0.0:
        return demand * brake.max_acceleration if body.speed < MAX_SPEED else 0.0
    deficit, limit = body.script_speed - body.speed, brake.regain_acceleration
    return body.script_acceleration + min(max(deficit / REGAIN_TIME, -limit), limit)


@kernel(exact=True)
def ego_braking(body: np.record, ego: np.record) -> float:
    """Return the ego's deceleration beyond the script, >= 0 [m/s²]."""
    return 0.0 if ego.on_script else max(0.0, body.script_acceleration - body.acceleration)
