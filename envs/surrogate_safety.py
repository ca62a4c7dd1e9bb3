"""Surrogate safety measures: gap, time to contact, time headway, DRAC and required deceleration.

Undefined values are `inf`. The functions are compiled and read `BODY` records, the ego first.
"""

from math import atan, cos, hypot, inf, sin, tan

import numpy as np

from lgmd_gym.envs.dynamics.bodies import CAR, MOTORCYCLE, ROAD_MARKING, outline_of
from lgmd_gym.envs.dynamics.contact import PathMotion, Rectangle, first_touch, gap_on_path, time_on_paths
from lgmd_gym.kernels import kernel

TTC_HORIZON, TTC_STEP = 10.0, 0.1  # [s]
GAP_HORIZON, GAP_STEP = 300.0, 1.0  # [m]
# A contact after 4 s requires 5 m/s² at a closing speed of 40 m/s only.
PREDICTION, PREDICTION_STEP = 4.0, 0.1  # [s]


@kernel(exact=True)
def lead_of(bodies: np.ndarray, count: int, paths: np.ndarray) -> tuple[float, int]:
    """Return the gap to the first solid body on the ego's path [m], and its index; `inf` and 0 if none.

    The ego's outline is swept along its path up to 300 m; other bodies are taken at their current positions.

    Args:
        bodies: `BODY` records, the ego first.
        count: Number of bodies.
        paths: Table of the paths' cells.
    """
    ego = bodies[0]
    here = outline_of(ego)
    dx, dy = GAP_HORIZON * cos(ego.heading), GAP_HORIZON * sin(ego.heading)
    gap, lead = inf, 0
    for i in range(1, count):
        body = bodies[i]
        if body.kind == ROAD_MARKING:
            continue
        place = outline_of(body)
        if _is_straight(ego):
            free = GAP_HORIZON * first_touch(here, place, dx, dy)
        else:
            free = gap_on_path(_motion(ego, paths), place, GAP_HORIZON, GAP_STEP)
        if free < gap:
            gap, lead = free, i
    return gap, lead


@kernel(exact=True)
def contact_time(bodies: np.ndarray, count: int, paths: np.ndarray) -> float:
    """Return the time to the ego's first contact at constant speeds and paths [s]; `inf` beyond 10 s.

    Definition: Euro NCAP AEB C2C v4.3.1, 2.1. Arguments: see `lead_of`.
    """
    ego = bodies[0]
    here = outline_of(ego)
    vx, vy = ego.speed * cos(ego.heading), ego.speed * sin(ego.heading)
    ttc = inf
    for i in range(1, count):
        body = bodies[i]
        if body.kind == ROAD_MARKING:
            continue
        if _is_straight(ego) and _is_straight(body):
            dx = TTC_HORIZON * (vx - body.speed * cos(body.heading))
            dy = TTC_HORIZON * (vy - body.speed * sin(body.heading))
            time = TTC_HORIZON * first_touch(here, outline_of(body), dx, dy)
        else:
            time = time_on_paths(_motion(ego, paths), _motion(body, paths), TTC_HORIZON, TTC_STEP)
        ttc = min(ttc, time)
    return ttc


@kernel(exact=True)
def is_approached(bodies: np.ndarray, count: int, paths: np.ndarray) -> bool:
    """Return whether a car or motorcycle touches the ego within 10 s; see `approaching`.

    Pedestrians and bicycles do not count: they stop in front of a standing car.
    """
    return approaching(bodies, count, paths, TTC_HORIZON, False) > 0


@kernel(exact=True)
def approaching(bodies: np.ndarray, count: int, paths: np.ndarray, horizon: float, everyone: bool) -> int:
    """Return the index of a body that touches the ego if the ego stands and others keep their speed.

    Args:
        bodies: See `lead_of`.
        count: See `lead_of`.
        paths: See `lead_of`.
        horizon: Time within which the contact counts [s].
        everyone: Whether all bodies count; otherwise cars and motorcycles.

    Returns:
        The index of the body, 0 for none.
    """
    ego = bodies[0]
    standing = PathMotion(
        paths[ego.path : ego.path_end], ego.travelled, 0.0, ego.length, ego.width, ego.reference
    )
    for i in range(1, count):
        body = bodies[i]
        if body.speed == 0.0 or body.kind == ROAD_MARKING:
            continue
        if not everyone and body.kind != CAR and body.kind != MOTORCYCLE:
            continue
        if time_on_paths(standing, _motion(body, paths), horizon, TTC_STEP) < inf:
            return i
    return 0


@kernel(exact=True)
def headway(gap: float, speed: float) -> float:
    """Return the time headway THW = gap / v [s]; `inf` at standstill."""
    return inf if speed == 0.0 else gap / speed


@kernel(exact=True)
def rate_to_avoid_crash(gap: float, closing_speed: float) -> float:
    """Return DRAC = Δv² / (2·gap) [m/s²]; 0 if the gap does not close, `inf` at contact."""
    return max(closing_speed, 0.0) ** 2 / (2.0 * gap) if gap > 0.0 else inf


@kernel(exact=True)
def _is_straight(body: np.record) -> bool:
    return body.path_end - body.path == 1


@kernel(exact=True)
def _motion(body: np.record, paths: np.ndarray) -> PathMotion:
    cells = paths[body.path : body.path_end]
    return PathMotion(cells, body.travelled, body.speed, body.length, body.width, body.reference)


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
def predicted_contact(one: np.record, other: np.record) -> float:
    """Return the time to the first contact of two bodies at constant speeds and steering angles [s].

    The result is `inf` without a contact within `PREDICTION`.
    """
    fastest = one.speed + other.speed
    reach = hypot(one.length, one.width) / 2 + hypot(other.length, other.width) / 2
    time = 0.0
    while time < PREDICTION:
        a, b = outline_after(one, time), outline_after(other, time)
        free = hypot(b.x - a.x, b.y - a.y) - reach
        if free > PREDICTION_STEP * fastest:  # no contact before that time, even head-on
            if fastest == 0.0:
                return inf
            time += free / fastest
            continue
        c, d = outline_after(one, time + PREDICTION_STEP), outline_after(other, time + PREDICTION_STEP)
        touch = first_touch(a, b, (c.x - a.x) - (d.x - b.x), (c.y - a.y) - (d.y - b.y))
        if touch <= 1.0:
            return time + touch * PREDICTION_STEP
        time += PREDICTION_STEP
    return inf


@kernel(exact=True)
def outline_after(body: np.record, time: float) -> Rectangle:
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
