"""Ground truth about the ego and what is ahead of it."""

from collections.abc import Sequence
from math import cos, sin
from typing import Any, NamedTuple

from lgmd_gym.envs.dynamics.contact import first_touch
from lgmd_gym.envs.dynamics.swept_contact import gap_on_path, time_on_paths
from lgmd_gym.envs.simulation.vehicles import EgoCar
from lgmd_gym.envs.undefined import UNDEFINED

TTC_HORIZON, TTC_STEP = 10.0, 0.1  # [s]
GAP_HORIZON, GAP_STEP = 300.0, 1.0  # [m]


class Ahead(NamedTuple):
    """What the ego would touch first if all else stood still.

    Attributes:
        gap: Free distance along the ego's path, from its front bumper [m].
        other: Who or what it is.
    """

    gap: float
    other: Any


def ahead(ego: EgoCar, obstacles: Sequence[Any]) -> Ahead | None:
    """Return what is first in the ego's way within 300 m, or None.

    The way is the ego's own outline swept along its path, against everybody where they are now.
    """
    found = None
    if ego.path.straight:
        dx, dy = GAP_HORIZON * cos(ego.heading), GAP_HORIZON * sin(ego.heading)
        for other in obstacles:
            touch = first_touch(ego.rectangle, other.rectangle, dx, dy)
            if touch is not None and (found is None or touch * GAP_HORIZON < found.gap):
                found = Ahead(touch * GAP_HORIZON, other)
        return found
    gaps = ((_gap_on_path(ego, other), other) for other in obstacles)
    return min((Ahead(gap, other) for gap, other in gaps if gap == gap), key=_by_gap, default=None)


def _by_gap(front: Ahead) -> float:
    return front.gap


def _gap_on_path(ego: EgoCar, other: Any) -> float:
    """Return how far the ego can go along a bent path before it touches a standing outline [m], or NaN."""
    outline = other.rectangle
    sizes = (float(ego.LENGTH), float(ego.WIDTH), float(outline.length), float(outline.width))
    place = (outline.x, outline.y, outline.heading)
    return gap_on_path((ego.path.table, ego.along), place, sizes, GAP_HORIZON, GAP_STEP)


def time_to_contact(ego: EgoCar, obstacles: Sequence[Any]) -> float:
    """Return the first time the ego touches anybody if all keep their speed and path [s].

    Euro NCAP AEB C2C v4.3.1, 2.1. NaN if there is no touch within 10 s.
    """
    times = []
    for other in obstacles:
        if ego.path.straight and other.path.straight:
            dx = TTC_HORIZON * (ego.speed * cos(ego.heading) - other.speed * cos(other.heading))
            dy = TTC_HORIZON * (ego.speed * sin(ego.heading) - other.speed * sin(other.heading))
            touch = first_touch(ego.rectangle, other.rectangle, dx, dy)
            times.append(None if touch is None else touch * TTC_HORIZON)
        else:
            times.append(_time_on_paths(ego, other))
    return min((time for time in times if time is not None), default=UNDEFINED)


def _time_on_paths(ego: EgoCar, other: Any) -> float | None:
    """Return the time to contact of two on their paths, at least one of them bent [s]."""
    places = (ego.path.table, ego.along), (other.path.table, other.along)
    sizes = (float(ego.LENGTH), float(ego.WIDTH), float(other.LENGTH), float(other.WIDTH))
    speeds = (float(ego.speed), float(other.speed))
    time = time_on_paths(*places, speeds, sizes, TTC_HORIZON, TTC_STEP)
    return None if time != time else time


def headway(ego: EgoCar, front: Ahead | None) -> float:
    """Return the time headway THW = gap / v of what is ahead [s]; NaN for nothing, or standing."""
    return UNDEFINED if front is None or ego.speed == 0.0 else front.gap / ego.speed


def closing_speed(ego: EgoCar, front: Ahead) -> float:
    """Return by how much the ego is faster along its heading than what is ahead [m/s]."""
    return float(ego.speed - front.other.speed * cos(front.other.heading - ego.heading))


def deceleration_to_avoid_crash(ego: EgoCar, front: Ahead | None) -> float:
    """Return DRAC = Δv² / (2·gap) [m/s²]: 0 if not closing, NaN with nothing ahead or at contact."""
    if front is None or front.gap <= 0.0:
        return UNDEFINED
    return max(closing_speed(ego, front), 0.0) ** 2 / (2.0 * front.gap)


def required_deceleration(ego: EgoCar, front: Ahead | None) -> float:
    """Return the deceleration that just avoids contact if what is ahead keeps its own [m/s²].

    Jansson (2005), 5.3.5: max(0, Δv² / (2·gap) − a_lead), Δv taken at 0 if not closing.
    """
    drac = deceleration_to_avoid_crash(ego, front)
    if front is None or not drac >= 0.0:
        return UNDEFINED
    return max(drac - front.other.acceleration, 0.0)
