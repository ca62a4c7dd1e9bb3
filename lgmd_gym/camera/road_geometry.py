"""The static geometry of a highway-env road: asphalt, markings and roadside as arrays.

Lanes are read by duck typing, once per road network.
"""

import math
import weakref
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lgmd_gym.camera.clutter import draw_clutter, place_clutter
from lgmd_gym.camera.objects import OBJECT, sorted_by_x
from lgmd_gym.camera.roadside import guard_rails, posts_and_plants

if TYPE_CHECKING:
    from highway_env.road.lane import AbstractLane
    from highway_env.road.road import Road, RoadNetwork


SHOULDER = 0.5
"""Width of the asphalt beyond the outer line [m]."""
STRIPED, CONTINUOUS, CONTINUOUS_LINE = 1, 2, 3  # highway_env.road.lane.LineType

QUAD = np.dtype([("corners", np.float64, 8), *((name, np.float64) for name in ("x", "y", "radius"))])
"""A quad of asphalt: x, y of its corners in turn; centre and radius of a circle around them [m]."""
LINE = np.dtype([(name, np.float64) for name in ("x", "y", "cos", "sin", "length", "start", "striped")])
"""A straight piece of a marking: its first end [m], direction, length and start along the lane [m], 1.0 if
striped."""

_LANE_STEP = 2.0
_IN_LINE = 1e-6  # ends of lanes in line with each other [m]
_MAX_PIECES = 2000
_MAX_KNOWN = 2  # geometries of a network that are remembered
_BAY_LENGTH = 20.0  # a network whose longest lane is no longer than this is a car park [m]


class RoadGeometry(NamedTuple):
    """The static part of a road."""

    surface: np.ndarray  # asphalt, `QUAD` records, shape (n,)
    lines: np.ndarray  # markings, `LINE` records, shape (n,)
    roadside: np.ndarray  # posts, trees and guard rails, `OBJECT` records sorted by x, shape (n,)
    paved: bool  # whether all ground is asphalt, as for a road without lanes


_CACHE: weakref.WeakKeyDictionary[object, dict[tuple[object, ...], RoadGeometry]] = (
    weakref.WeakKeyDictionary()
)


def road_geometry(
    road: "Road | RoadNetwork",
    roadside: float = 0.0,
    seed: int = 0,
    rail: bool = False,
    cluttered: bool = False,
    queue_lane: int | None = None,
) -> RoadGeometry:
    """Return the geometry of a road's network, cached for the lifetime of the network.

    Args:
        road: The highway-env `Road` or its `RoadNetwork`.
        roadside: Density of posts and trees, as a multiple of the natural density.
        seed: Seed of their positions.
        rail: Whether guard rails run along the outer edges.
        cluttered: Whether clutter stands along the road, see `draw_clutter`.
        queue_lane: See `place_clutter`.
    """
    network = network_of(road)
    key = (roadside, seed, rail, cluttered, queue_lane)
    if network is None:
        return _extract([], *key)
    try:
        known = _CACHE.setdefault(network, {})
    except TypeError:  # not hashable or without weak references: no cache
        return _extract(_lanes(network), *key)
    geometry = known.get(key)  # another thread may clear the dictionary at any time
    if geometry is None:
        geometry = _extract(_lanes(network), *key)
        if len(known) >= _MAX_KNOWN:  # each world has a roadside of its own
            known.clear()
        known[key] = geometry
    return geometry


def network_of(road: "Road | RoadNetwork") -> Any:
    """Return the network of a highway-env `Road`, or None; a `RoadNetwork` is returned as it is."""
    return road if hasattr(road, "graph") else getattr(road, "network", None)


def _lanes(network: "RoadNetwork") -> "list[AbstractLane]":
    lanes = [lane for ends in network.graph.values() for group in ends.values() for lane in group]
    return [lane for lane in lanes if math.isfinite(lane.length) and lane.length > 0.0]


def _extract(lanes: "list[AbstractLane]", *key: Any) -> RoadGeometry:
    """Return the geometry of lanes; `key` is the other arguments of `road_geometry`."""
    if not lanes:
        return RoadGeometry(np.zeros(0, QUAD), np.zeros(0, LINE), np.zeros(0, OBJECT), True)
    surface: list[np.ndarray] = []
    lines: list[np.ndarray] = [np.zeros((0, 6))]
    segments: list[np.ndarray] = []
    for lane in lanes:
        stations = _stations(lane)
        surface.append(_ribbon(lane, stations))
        segments.append(_segments(lane, stations))
        for side, kind in enumerate(getattr(lane, "line_types", None) or (0, 0)):
            if kind in (STRIPED, CONTINUOUS, CONTINUOUS_LINE):  # pyright: ignore[reportUnnecessaryContains]
                lines.append(_line(lane, stations, side, striped=kind == STRIPED))
    if max(lane.length for lane in lanes) <= _BAY_LENGTH:
        surface.append(_car_park(np.concatenate(surface)))
        records = np.zeros(0, OBJECT)
    else:
        records = _roadside_of(np.concatenate(segments).tobytes(), *key)
    quads = quad_records(_joined(np.concatenate(surface)))
    return RoadGeometry(quads, line_records(_without_duplicates(np.concatenate(lines))), records, False)


@lru_cache(maxsize=16)
def _roadside_of(
    segments: bytes, roadside: float, seed: int, rail: bool, cluttered: bool, queue_lane: int | None
) -> np.ndarray:
    """Return the roadside, cached by the shape of the lanes, because each reset builds a new network."""
    pieces = np.frombuffer(segments).reshape(-1, 6)
    parts = [posts_and_plants(pieces, roadside, seed)]
    if rail:
        parts.append(guard_rails(pieces))
    if cluttered:
        clutter = draw_clutter(np.random.default_rng([seed, 11]))
        parts.append(place_clutter(pieces, clutter, seed, queue_lane=queue_lane))
    return sorted_by_x(parts)


def _stations(lane: "AbstractLane") -> np.ndarray:
    """Return the distances along the lane between which it is drawn straight; shape (n,) [m]."""
    length = float(lane.length)
    if type(lane).__name__ == "StraightLane":  # highway-env's, with a constant width
        return np.array([0.0, length])
    probe = length * np.array([0.0, 0.07, 0.19, 0.31, 0.43, 0.5, 0.62, 0.71, 0.83, 0.94, 1.0])
    points = np.array([lane.position(s, 0.0) for s in probe], dtype=np.float64)
    chord = points[0] + np.outer(probe / length, points[-1] - points[0])
    widths = [lane.width_at(s) for s in probe]
    if np.abs(points - chord).max() < 0.01 and max(widths) - min(widths) < 0.01:
        return probe[[0, -1]]
    headings = np.unwrap([lane.heading_at(s) for s in np.linspace(0.0, length, 64)])
    # 0.08 rad per piece keeps an edge of 25 m radius within 2 cm of its arc.
    pieces = max(length / _LANE_STEP, float(np.abs(np.diff(headings)).sum()) / 0.08)
    return np.linspace(0.0, length, min(int(pieces) + 2, _MAX_PIECES))


def _segments(lane: "AbstractLane", stations: np.ndarray) -> np.ndarray:
    """Return a lane in straight pieces: x0, y0, x1, y1, start along the lane, width; shape (n, 6) [m]."""
    centre = np.array([lane.position(s, 0.0) for s in stations], dtype=np.float64)
    width = np.array([lane.width_at(s) for s in stations[:-1]])
    return np.concatenate((centre[:-1], centre[1:], stations[:-1, None], width[:, None]), axis=1)


def _edge(lane: "AbstractLane", stations: np.ndarray, side: int, extra: float) -> np.ndarray:
    lateral = [(side - 0.5) * (lane.width_at(s) + 2.0 * extra) for s in stations]
    return np.array([lane.position(s, r) for s, r in zip(stations, lateral, strict=True)], dtype=np.float64)


def _ribbon(lane: "AbstractLane", stations: np.ndarray) -> np.ndarray:
    left, right = _edge(lane, stations, 0, SHOULDER), _edge(lane, stations, 1, SHOULDER)
    return np.concatenate((left[:-1], right[:-1], right[1:], left[1:]), axis=1)


def _joined(surface: np.ndarray) -> np.ndarray:
    """Join quads of neighbouring straight lanes that begin and end in line, into fewer edges to draw."""
    joined: list[np.ndarray] = []
    for quad in surface:
        if joined and _continues(joined[-1], quad):
            joined[-1] = np.concatenate((joined[-1][:2], quad[2:6], joined[-1][6:]))
        else:
            joined.append(quad)
    return np.array(joined)


def quad_records(quads: np.ndarray) -> np.ndarray:
    """Return the `QUAD` records of quads, shape (n, 8): x, y of their corners in turn."""
    corners = quads.reshape(-1, 4, 2)
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    return np.column_stack((quads, centres, radii)).view(QUAD)[:, 0]


def line_records(lines: np.ndarray) -> np.ndarray:
    """Return the `LINE` records of lines with a length.

    Args:
        lines: x, y of both ends and the start along the lane [m], 1.0 if striped; float64, shape (n, 6).
    """
    sides = lines[:, 2:4] - lines[:, :2]
    lengths = np.hypot(*sides.T)
    lines, sides, lengths = (values[lengths > 0.0] for values in (lines, sides, lengths))
    records = np.column_stack((lines[:, :2], sides / lengths[:, None], lengths, lines[:, 4:]))
    return records.view(LINE)[:, 0]


def _continues(quad: np.ndarray, other: np.ndarray) -> bool:
    """Return whether another quad overlaps with or touches the right side of a quad, along all of it."""
    for left, right in ((slice(0, 2), slice(2, 4)), (slice(6, 8), slice(4, 6))):
        across = quad[right] - quad[left]
        width = max(float(np.hypot(*across)), 1e-9)
        for side, first, last in ((left, 0.0, width), (right, width, math.inf)):
            offset = other[side] - quad[left]
            along = float(offset @ across) / width
            aside = float(offset[0] * across[1] - offset[1] * across[0]) / width
            if not (abs(aside) < _IN_LINE and first - _IN_LINE <= along <= last + _IN_LINE):
                return False
    return True


def _line(lane: "AbstractLane", stations: np.ndarray, side: int, *, striped: bool) -> np.ndarray:
    edge = _edge(lane, stations, side, 0.0)
    along = np.stack((stations[:-1], np.full(len(stations) - 1, float(striped))), axis=1)
    return np.concatenate((edge[:-1], edge[1:], along), axis=1)


def _car_park(surface: np.ndarray) -> np.ndarray:
    """Return one quad around all bays of a car park, because its aisles are not lanes."""
    x, y = surface[:, 0::2], surface[:, 1::2]
    x0, x1, y0, y1 = x.min() - 5.0, x.max() + 5.0, y.min() - 3.0, y.max() + 3.0
    return np.array([[x0, y0, x0, y1, x1, y1, x1, y0]])


def _without_duplicates(lines: np.ndarray) -> np.ndarray:
    """Drop lines of neighbouring lanes that coincide within 10 cm; a solid line replaces a striped one."""
    ends = np.round(lines[:, :4] * 10.0)
    swapped = ends[:, [2, 3, 0, 1]]
    flip = (ends[:, 0] > swapped[:, 0]) | ((ends[:, 0] == swapped[:, 0]) & (ends[:, 1] > swapped[:, 1]))
    keys = np.where(flip[:, None], swapped, ends)
    order = np.argsort(lines[:, 5], kind="stable")
    _, first = np.unique(keys[order], axis=0, return_index=True)
    return np.ascontiguousarray(lines[np.sort(order[first])])
