"""Surrogate safety measures: gap, time to contact, time headway, DRAC and required deceleration.

Undefined values are `inf`. A road object without a `path` is assumed to move straight on.
"""

from collections.abc import Sequence
from math import cos, inf, sin
from typing import Any, NamedTuple

from lgmd_gym.envs.dynamics.contact import Rectangle, first_touch, outline, speed_along
from lgmd_gym.envs.dynamics.swept_contact import PathMotion, gap_on_path, time_on_paths

TTC_HORIZON, TTC_STEP = 10.0, 0.1  # [s]
GAP_HORIZON, GAP_STEP = 300.0, 1.0  # [m]


class Lead(NamedTuple):
    """The first obstacle on the ego's path.

    Attributes:
        gap: Free distance along the ego's path, from its front bumper [m].
        other: The obstacle.
    """

    gap: float
    other: Any


def find_lead(ego: Any, obstacles: Sequence[Any]) -> Lead | None:
    """Return the first obstacle on the ego's path within 300 m, or None.

    The ego's outline is swept along its path; obstacles are taken at their current positions.
    """
    here, straight = outline(ego), _is_straight(ego)
    dx, dy = GAP_HORIZON * cos(here.heading), GAP_HORIZON * sin(here.heading)
    gap, lead = inf, None
    for other in obstacles:
        place = outline(other)
        if straight:
            free = GAP_HORIZON * first_touch(here, place, dx, dy)
        else:
            free = gap_on_path(_motion(ego), Rectangle(*map(float, place)), GAP_HORIZON, GAP_STEP)
        if free < gap:
            gap, lead = free, other
    return None if lead is None else Lead(gap, lead)


def time_to_contact(ego: Any, obstacles: Sequence[Any]) -> float:
    """Return the time to the ego's first contact at constant speeds and paths [s]; `inf` beyond 10 s.

    Definition: Euro NCAP AEB C2C v4.3.1, 2.1.
    """
    here, straight = outline(ego), _is_straight(ego)
    vx, vy = ego.speed * cos(here.heading), ego.speed * sin(here.heading)
    ttc = inf
    for other in obstacles:
        if straight and _is_straight(other):
            place = outline(other)
            dx = TTC_HORIZON * (vx - other.speed * cos(place.heading))
            dy = TTC_HORIZON * (vy - other.speed * sin(place.heading))
            time = TTC_HORIZON * first_touch(here, place, dx, dy)
        else:
            time = time_on_paths(_motion(ego), _motion(other), TTC_HORIZON, TTC_STEP)
        ttc = min(ttc, time)
    return ttc


def time_headway(ego: Any, lead: Lead | None) -> float:
    """Return the time headway THW = gap / v [s]; `inf` without a lead or at standstill."""
    return inf if lead is None or ego.speed == 0.0 else lead.gap / ego.speed


def deceleration_to_avoid_crash(ego: Any, lead: Lead | None) -> float:
    """Return DRAC = Δv² / (2·gap) [m/s²]; 0 if the gap does not close, `inf` without a lead or at contact."""
    if lead is None or lead.gap <= 0.0:
        return inf
    closing_speed = ego.speed - speed_along(ego, lead.other)
    return max(closing_speed, 0.0) ** 2 / (2.0 * lead.gap)


def required_deceleration(ego: Any, lead: Lead | None) -> float:
    """Return the deceleration that just avoids contact if the lead keeps its acceleration [m/s²].

    Jansson (2005), 5.3.5: max(0, DRAC − a_lead); `inf` without a lead or at contact.
    """
    drac = deceleration_to_avoid_crash(ego, lead)
    return inf if lead is None else max(drac - lead.other.acceleration, 0.0)


def _is_straight(item: Any) -> bool:
    path = getattr(item, "path", None)
    return path is None or path.straight


def _motion(item: Any) -> PathMotion:
    """Return the motion of a road object on a path, with plain floats for the compiled functions."""
    speed, length, width = float(item.speed), float(item.LENGTH), float(item.WIDTH)
    return PathMotion(item.path.table, float(item.travelled), speed, length, width)
