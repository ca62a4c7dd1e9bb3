"""Need of braking in traffic: the deceleration that avoids a predicted contact."""

from math import atan, cos, hypot, inf, sin, tan
from typing import Any

import numpy as np

from lgmd_gym.envs.dynamics.contact import Rectangle, first_touch
from lgmd_gym.kernels import kernel

PREDICTION, STEP = 4.0, 0.1  # [s]; a contact after 4 s requires 5 m/s² at a closing speed of 40 m/s only


@kernel(exact=True)
def required_deceleration(bodies: np.ndarray) -> float:
    """Return the highest deceleration that the ego needs to avoid a predicted contact [m/s²]; 0 without one.

    The contact is predicted up to `PREDICTION` at present speeds and steering angles, so on arcs. Avoiding it
    requires Δv / (2·t) for a closing speed Δv along the ego's heading and a time t to contact. For a lead in
    the ego's lane this is DRAC, Δv² / (2·gap). The result is `inf` at a contact with Δv > 0.

    Args:
        bodies: `BODY` records, the ego first.
    """
    ego, result = bodies[0], 0.0
    for i in range(1, len(bodies)):
        other = bodies[i]
        closing = ego.speed - other.speed * cos(other.heading - ego.heading)
        if closing <= 0.0:
            continue
        time = predicted_contact(ego, other)
        result = max(result, closing / (2.0 * time) if time > 0.0 else inf)
    return result


@kernel(exact=True)
def predicted_contact(one: Any, other: Any) -> float:
    """Return the time to the first contact of two bodies at constant speeds and steering angles [s].

    The result is `inf` without a contact within `PREDICTION`.
    """
    fastest = one.speed + other.speed
    reach = hypot(one.length, one.width) / 2 + hypot(other.length, other.width) / 2
    time = 0.0
    while time < PREDICTION:
        a, b = outline_after(one, time), outline_after(other, time)
        free = hypot(b.x - a.x, b.y - a.y) - reach
        if free > STEP * fastest:  # no contact before that time, even head-on
            if fastest == 0.0:
                return inf
            time += free / fastest
            continue
        c, d = outline_after(one, time + STEP), outline_after(other, time + STEP)
        touch = first_touch(a, b, (c.x - a.x) - (d.x - b.x), (c.y - a.y) - (d.y - b.y))
        if touch <= 1.0:
            return time + touch * STEP
        time += STEP
    return inf


@kernel(exact=True)
def outline_after(body: Any, time: float) -> Rectangle:
    """Return the outline of a body after a time at its present speed and steering angle [s]."""
    slip = atan(tan(body.steering) / 2.0)
    course, distance = body.heading + slip, body.speed * time
    curvature = sin(slip) / (body.length / 2.0)
    turned = distance * curvature
    if abs(turned) < 1e-6:
        x, y = distance * cos(course), distance * sin(course)
    else:
        x = (sin(course + turned) - sin(course)) / curvature
        y = (cos(course) - cos(course + turned)) / curvature
    return Rectangle(body.x + x, body.y + y, body.heading + turned, body.length, body.width)
