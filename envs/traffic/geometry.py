"""Who is ahead of the ego in traffic, when it would touch somebody, and where it did."""

from collections.abc import Sequence
from math import cos, hypot, sin
from typing import Any

from lgmd_gym.envs.dynamics.contact import Rectangle, first_touch

CORNER = 0.25  # [m] from an end of the ego: touched there is touched at that end
NEAR = 0.02  # [m] between the corners that count as touching
HORIZON = 10.0  # [s] of `time_to_contact`


def outline(item: Any) -> Rectangle:
    """Return a road object's outline seen from above."""
    x, y = item.position
    return Rectangle(float(x), float(y), float(item.heading), item.LENGTH, item.WIDTH)


def time_to_contact(ego: Any, others: Sequence[Any]) -> float | None:
    """Return the first time the ego touches anybody if all keep speed and heading [s]; None beyond 10 s."""
    here = outline(ego)
    vx, vy = HORIZON * ego.speed * cos(here.heading), HORIZON * ego.speed * sin(here.heading)
    first = None
    for other in others:
        place, way = outline(other), HORIZON * other.speed
        dx, dy = vx - way * cos(place.heading), vy - way * sin(place.heading)
        touch = first_touch(here, place, dx, dy)
        if touch is not None and (first is None or touch < first):
            first = touch
    return None if first is None else HORIZON * first


def ahead(ego: Any, others: Sequence[Any], reach: float = 300.0) -> tuple[float, Any] | None:
    """Return the free distance straight ahead of the ego's front bumper [m] and who ends it, or None."""
    here = outline(ego)
    dx, dy = reach * cos(here.heading), reach * sin(here.heading)
    touches = ((first_touch(here, outline(other), dx, dy), other) for other in others)
    found = [(touch * reach, other) for touch, other in touches if touch is not None]
    return min(found, key=lambda pair: pair[0], default=None)


def touched_side(ego: Rectangle, other: Rectangle) -> str:
    """Return where on the ego two touching outlines meet: "front", "rear" or "side".

    They meet in the middle of the corners of either that lie nearest to the other one. A corner of the ego
    counts as that end of it.
    """
    mine = [(_outside(other, *_inside(other, x, y)), _inside(ego, x, y)[0]) for x, y in _corners(ego)]
    theirs = [(_outside(ego, *_inside(ego, x, y)), _inside(ego, x, y)[0]) for x, y in _corners(other)]
    nearest = min(away for away, _ in mine + theirs)
    meeting = [along for away, along in mine + theirs if away <= nearest + NEAR]
    along = sum(meeting) / len(meeting)
    if abs(along) < ego.length / 2 - CORNER:
        return "side"
    return "front" if along > 0.0 else "rear"


def _corners(box: Rectangle) -> list[tuple[float, float]]:
    c, s = cos(box.heading), sin(box.heading)
    ends = [(x * box.length / 2, y * box.width / 2) for x in (1, -1) for y in (1, -1)]
    return [(box.x + x * c - y * s, box.y + x * s + y * c) for x, y in ends]


def _inside(box: Rectangle, x: float, y: float) -> tuple[float, float]:
    """Return a point in a box's own axes, from its centre [m]."""
    dx, dy = x - box.x, y - box.y
    c, s = cos(box.heading), sin(box.heading)
    return dx * c + dy * s, dy * c - dx * s


def _outside(box: Rectangle, x: float, y: float) -> float:
    """Return how far a point in a box's own axes lies outside of it [m]; 0 inside."""
    return hypot(max(abs(x) - box.length / 2, 0.0), max(abs(y) - box.width / 2, 0.0))
