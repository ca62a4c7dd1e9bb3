# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Placement of clutter along the lanes of a road."""

import math
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from lgmd_gym.camera.clutter.kinds import ACROSS, BESIDE, ON_LANE, queues
from lgmd_gym.camera.clutter.settings import Clutter
from lgmd_gym.camera.clutter.sites import Sites, edge_places, lane_places, records_of, with_road_width
from lgmd_gym.camera.objects import MODEL_MARK, OBJECT, sorted_by_x, take
from lgmd_gym.camera.roadside import is_clear
from lgmd_gym.errors import check_type, check_whole
from lgmd_gym.kernels import kernel

FREE_HEIGHT = 4.5
"""No clutter stands on a lane below this height [m], except the queue."""
LANE_MARGIN = 0.3
"""Minimum distance of clutter below `FREE_HEIGHT` from a lane [m]."""
_LONGEST = 70.0  # upper bound of the length of a piece [m]
_SAMPLES = 9  # points of each long side of a piece that are compared with the lanes

Kinds: TypeAlias = dict[str, Callable[[Sites, np.random.Generator], list[np.ndarray]]]
"""Functions that return the parts of a kind, by its name."""


def place_clutter(
    segments: np.ndarray,
    clutter: Clutter,
    seed: int,
    x_range: tuple[float, float] | None = None,
    queue_lane: int | None = None,
) -> np.ndarray:
    """Place clutter along the lanes of a road.

    Args:
        segments: Straight pieces of lanes, float64, shape (n, 6): x0, y0, x1, y1 of the centre line,
            distance of the start along the lane, width [m].
        clutter: Densities.
        seed: Seed of positions and appearance.
        x_range: Bounds of x between which clutter is placed [m]; None for the whole road.
        queue_lane: Index of the lane on which queues stand, in the order of `segments`; None for none.

    Returns:
        `OBJECT` records sorted by x, shape (n,): solids and ground marks.

    Raises:
        ValueError: If an argument is of another type, or there is no such lane.
    """
    check_type("clutter", clutter, Clutter)
    rng = np.random.default_rng([check_whole("seed", seed, 0), 5])
    lanes = np.flatnonzero(segments[:, 4] == 0.0)
    if queue_lane is not None:
        check_whole("queue_lane", queue_lane, 0, len(lanes) - 1)
    if len(segments) == 0:
        return np.zeros(0, OBJECT)
    marks = _place(lane_places, ON_LANE, segments, clutter, rng, x_range)[0]
    beside, owner = _place(edge_places, ACROSS | BESIDE, segments, clutter, rng, x_range)
    if queue_lane is not None:
        lane = np.split(segments, lanes[1:])[queue_lane]
        queued, _ = _place(lane_places, {"queue": queues}, lane, clutter, rng, x_range)
        marks = np.concatenate((queued, marks))
    return sorted_by_x((take(beside, _without_conflicts(beside, owner, segments)), marks))


def _place(draw: Any, kinds: Kinds, segments: np.ndarray, clutter: Clutter, *how: Any) -> Any:
    """Return the records of several kinds, and the place of each one; `draw` draws the places."""
    rng = how[0]
    places = draw(segments, [getattr(clutter, name) for name in kinds], *how)
    if draw is edge_places:
        places = with_road_width(places, len(ACROSS), segments)
    parts = [part for kind, make in enumerate(kinds.values()) for part in make(places.of_kind(kind), rng)]
    return records_of(parts, places)


def _without_conflicts(records: np.ndarray, owner: np.ndarray, segments: np.ndarray) -> np.ndarray:
    """Return which records to keep: pieces that stand on a lane or in another piece are dropped entirely."""
    order = np.argsort(records["x"], kind="stable")
    dropped = np.zeros(owner.max(initial=-1) + 1, dtype=np.bool_)
    _drop_from_lanes(records, owner, segments, dropped)
    _drop_overlaps(records, owner, order, dropped)
    return ~dropped[owner]


@kernel(exact=True, arrays=True)
def _drop_from_lanes(records, owner, segments, dropped):
    """Mark the pieces with a part below the free height on a lane or within its margin."""
    for i in range(len(records)):
        obj = records[i]
        if obj.model == MODEL_MARK or obj.base >= FREE_HEIGHT or dropped[owner[i]]:
            continue
        radius = 0.5 * math.hypot(obj.length, obj.width)
        if is_clear(obj.x, obj.y, segments, LANE_MARGIN + radius):
            continue
        for k in range(2 * _SAMPLES):
            a = obj.length * (float(k // 2) / (_SAMPLES - 1) - 0.5)
            b = obj.width * (k % 2 - 0.5)
            x, y = obj.x + a * obj.cos - b * obj.sin, obj.y + a * obj.sin + b * obj.cos
            if not is_clear(x, y, segments, LANE_MARGIN):
                dropped[owner[i]] = True
                break


@kernel(exact=True, arrays=True)
def _drop_overlaps(records, owner, order, dropped):
    """Mark the pieces that overlap another one; the kinds that come first remain."""
    for first in range(len(order)):
        i = order[first]
        for second in range(first - 1, -1, -1):
            j = order[second]
            if records[i].x - records[j].x > _LONGEST:
                break
            if dropped[owner[i]] or dropped[owner[j]] or owner[i] == owner[j]:
                continue
            if records[i].model == MODEL_MARK or records[j].model == MODEL_MARK:
                continue
            if _overlap(records[i], records[j]) and _overlap(records[j], records[i]):
                dropped[max(owner[i], owner[j])] = True


@kernel(exact=True, arrays=True)
def _overlap(a, b):
    """Return whether box b overlaps box a across the sides of a, and in height."""
    if a.base >= b.height or b.base >= a.height:
        return False
    dx, dy = b.x - a.x, b.y - a.y
    cos, sin = abs(a.cos * b.cos + a.sin * b.sin), abs(b.sin * a.cos - b.cos * a.sin)
    along, across = abs(dx * a.cos + dy * a.sin), abs(dy * a.cos - dx * a.sin)
    inside = along < 0.5 * (a.length + cos * b.length + sin * b.width)
    return inside and across < 0.5 * (a.width + sin * b.length + cos * b.width)
