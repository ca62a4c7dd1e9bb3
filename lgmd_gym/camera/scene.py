"""highway-env's Road as plain arrays. The only file of the camera that reads a Road.

Everything is duck-typed, so that neither highway-env nor what it drags in is imported. The lanes
are read once per road network; a frame reads poses only.
"""

from __future__ import annotations

import math
import struct
import weakref
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.camera.roadside import plant, rails

STRIPED, CONTINUOUS, CONTINUOUS_LINE = 1, 2, 3  # highway_env.road.lane.LineType
SHOULDER = 0.5
"""Asphalt beyond the outer line [m]."""
MAX_RANGE = 600.0
"""Vehicles farther than this from the lens are not drawn; they fade in over the last sixth [m]."""
PLANT_RANGE = 150.0
"""The same for posts and trees [m]."""
MAX_DRAWN = 512
"""No more objects than this are drawn, the nearest of the list first."""

# Columns of the array of objects.
OBJ_X, OBJ_Y, OBJ_COS, OBJ_SIN, OBJ_LENGTH, OBJ_WIDTH, OBJ_HEIGHT = 0, 1, 2, 3, 4, 5, 6
OBJ_SHADE, OBJ_BRAKE, OBJ_MODEL, OBJ_RANGE, OBJ_SPEED = 7, 8, 9, 10, 11
OBJ_SIZE = 12
MODEL_CAR, MODEL_TRUCK, MODEL_BOX, MODEL_MARK, MODEL_BARRIER, MODEL_RAIL = 0, 1, 2, 3, 4, 5
MODEL_POST, MODEL_TREE = 6, 7  # flat pictures that turn to the lens, as all from MODEL_POST on

OUTLINE = -1.0
"""Shade of a mark that is an outline in paint; other shades fill it."""

_BRAKE_LIGHT_MPS2 = -0.5
_LANE_STEP = 2.0
_MAX_PIECES = 2000
_BAY_LENGTH = 20.0  # a network of no longer lanes is a car park [m]


class RoadGeometry(NamedTuple):
    """What never moves on a road.

    Attributes:
        surface: Asphalt as quads, float64, shape (n, 8): x, y of the corners in turn [m].
        lines: Straight pieces of markings, float64, shape (n, 7): x0, y0, x1, y1, distance of both
            ends along their lane, 1.0 if striped else 0.0 [m].
        roadside: Posts, trees and guard rails as objects (columns `OBJ_…`), float64, shape (n, 12).
        paved: Everything is asphalt: a road without lanes.
    """

    surface: np.ndarray
    lines: np.ndarray
    roadside: np.ndarray
    paved: bool


_CACHE: weakref.WeakKeyDictionary[Any, dict[tuple[float, int, bool], RoadGeometry]] = (
    weakref.WeakKeyDictionary()
)


def road_geometry(road: Any, roadside: float = 0.0, seed: int = 0, rail: bool = False) -> RoadGeometry:
    """Return the geometry of `road`'s network, read on first sight and kept as long as the network lives.

    Args:
        road: The Road.
        roadside: Density of posts and trees.
        seed: Seed of their places.
        rail: Put guard rails along the outer edges.
    """
    network = getattr(road, "network", None)
    if network is None:
        return _extract([], roadside, seed, rail)
    key = (roadside, seed, rail)
    try:
        known = _CACHE.setdefault(network, {})
    except TypeError:  # not hashable or not weakly referable: read it anew
        return _extract(_lanes(network), *key)
    if key not in known:
        known[key] = _extract(_lanes(network), *key)
    return known[key]


def _lanes(network: Any) -> list[Any]:
    lanes = [lane for ends in network.graph.values() for group in ends.values() for lane in group]
    return [lane for lane in lanes if math.isfinite(lane.length) and lane.length > 0.0]


def _extract(lanes: list[Any], roadside: float, seed: int, rail: bool) -> RoadGeometry:
    surface: list[np.ndarray] = []
    lines: list[np.ndarray] = []
    segments: list[np.ndarray] = []
    for lane in lanes:
        stations = _stations(lane)
        surface.append(_ribbon(lane, stations))
        segments.append(_segments(lane, stations))
        for side, kind in enumerate(getattr(lane, "line_types", None) or (0, 0)):
            if kind in (STRIPED, CONTINUOUS, CONTINUOUS_LINE):
                lines.append(_line(lane, stations, side, striped=kind == STRIPED))
    lot = bool(lanes) and max(lane.length for lane in lanes) <= _BAY_LENGTH
    if lot:
        surface.append(_lot(np.concatenate(surface)))
    bare = not lanes or lot
    return RoadGeometry(
        surface=np.concatenate(surface) if surface else np.zeros((0, 8)),
        lines=_without_doubles(np.concatenate(lines)) if lines else np.zeros((0, 7)),
        roadside=_planted(np.zeros((0, 6)) if bare else np.concatenate(segments), roadside, seed, rail),
        paved=not lanes,
    )


def _planted(segments: np.ndarray, roadside: float, seed: int, rail: bool) -> np.ndarray:
    return _planted_once(segments.tobytes(), roadside, seed, rail)


@lru_cache(maxsize=16)
def _planted_once(segments: bytes, roadside: float, seed: int, rail: bool) -> np.ndarray:
    """Plant once for all networks of the same shape: environments build theirs anew at each reset."""
    pieces = np.frombuffer(segments).reshape(-1, 6)
    out = plant(pieces, roadside, seed, (OBJ_SIZE, MODEL_POST, MODEL_TREE))
    if rail:
        out = np.concatenate((out, rails(pieces, OBJ_SIZE, MODEL_RAIL)))
        out = np.ascontiguousarray(out[np.argsort(out[:, OBJ_X], kind="stable")])
    out[:, OBJ_RANGE] = PLANT_RANGE
    return out


def _segments(lane: Any, stations: np.ndarray) -> np.ndarray:
    """Centre line of a lane in pieces: x0, y0, x1, y1, distance of the start, width; shape (n, 6) [m]."""
    centre = np.array([lane.position(s, 0.0) for s in stations], dtype=np.float64)
    width = np.array([lane.width_at(s) for s in stations[:-1]])
    return np.concatenate((centre[:-1], centre[1:], stations[:-1, None], width[:, None]), axis=1)


def _stations(lane: Any) -> np.ndarray:
    """Distances along the lane between which it may be drawn straight; shape (n,) [m]."""
    length = float(lane.length)
    probe = length * np.array([0.0, 0.07, 0.19, 0.31, 0.43, 0.5, 0.62, 0.71, 0.83, 0.94, 1.0])
    points = np.array([lane.position(s, 0.0) for s in probe], dtype=np.float64)
    chord = points[0] + np.outer(probe / length, points[-1] - points[0])
    widths = [lane.width_at(s) for s in probe]
    if np.abs(points - chord).max() < 0.01 and max(widths) - min(widths) < 0.01:
        return probe[[0, -1]]
    headings = np.unwrap([lane.heading_at(s) for s in np.linspace(0.0, length, 64)])
    # 0.08 rad a piece keeps a kerb of 25 m radius within 2 cm of its arc.
    pieces = max(length / _LANE_STEP, float(np.abs(np.diff(headings)).sum()) / 0.08)
    return np.linspace(0.0, length, min(int(pieces) + 2, _MAX_PIECES))


def _edge(lane: Any, stations: np.ndarray, side: int, extra: float) -> np.ndarray:
    lateral = [(side - 0.5) * (lane.width_at(s) + 2.0 * extra) for s in stations]
    return np.array([lane.position(s, r) for s, r in zip(stations, lateral, strict=True)], dtype=np.float64)


def _ribbon(lane: Any, stations: np.ndarray) -> np.ndarray:
    left, right = _edge(lane, stations, 0, SHOULDER), _edge(lane, stations, 1, SHOULDER)
    return np.concatenate((left[:-1], right[:-1], right[1:], left[1:]), axis=1)


def _line(lane: Any, stations: np.ndarray, side: int, *, striped: bool) -> np.ndarray:
    edge = _edge(lane, stations, side, 0.0)
    along = np.stack((stations[:-1], stations[1:], np.full(len(stations) - 1, float(striped))), axis=1)
    return np.concatenate((edge[:-1], edge[1:], along), axis=1)


def _lot(surface: np.ndarray) -> np.ndarray:
    """Pave all between lanes that are bays: the aisle of a car park belongs to no lane."""
    x, y = surface[:, 0::2], surface[:, 1::2]
    x0, x1, y0, y1 = x.min() - 5.0, x.max() + 5.0, y.min() - 3.0, y.max() + 3.0
    return np.array([[x0, y0, x0, y1, x1, y1, x1, y0]])


def _without_doubles(lines: np.ndarray) -> np.ndarray:
    """Drop lines that two neighbouring lanes both draw, to 10 cm; solid wins over striped."""
    ends = np.round(lines[:, :4] * 10.0)
    swapped = ends[:, [2, 3, 0, 1]]
    flip = (ends[:, 0] > swapped[:, 0]) | ((ends[:, 0] == swapped[:, 0]) & (ends[:, 1] > swapped[:, 1]))
    keys = np.where(flip[:, None], swapped, ends)
    order = np.argsort(lines[:, 6], kind="stable")
    _, first = np.unique(keys[order], axis=0, return_index=True)
    return np.ascontiguousarray(lines[np.sort(order[first])])


_ROW = struct.Struct(f"={OBJ_SIZE}d")  # packing is twice as fast as assigning a row of an array
_MODELS: dict[type, tuple[int, float]] = {}


def _model_of(cls: type) -> tuple[int, float]:
    """Model and default height [m] of a class of objects, by the names of its bases."""
    names = {base.__name__ for base in cls.__mro__}
    if "Landmark" in names:
        model = MODEL_MARK, 0.0
    elif "Obstacle" in names:
        model = MODEL_BARRIER, 1.0
    else:
        model = MODEL_CAR, 1.5
    _MODELS[cls] = model
    return model


def index_shade(seed: int, index: int) -> float:
    """Body grey of the index-th vehicle: 30 to 225, well spread and the same in every process."""
    # Golden-ratio steps: neighbours in the list differ, and any few cover dark to light.
    return 30.0 + 195.0 * ((0.29 + 0.6180339887498949 * index + 0.7548776662466927 * seed) % 1.0)


def objects_into(
    out: np.ndarray,
    road: Any,
    ego: Any,
    x: float,
    y: float,
    look: tuple[float, float],
    seed: int,
    boxes: bool,
    reach: float = MAX_RANGE,
) -> int:
    """Write the poses of all that may be seen into `out`.

    Args:
        out: Gets one row per object (columns `OBJ_…`), float64, shape (MAX_DRAWN, 12).
        road: The Road.
        ego: The vehicle that is not drawn.
        x: Position of the lens [m].
        y: Position of the lens [m].
        look: Cosine and sine of the viewing direction; zeros keep what is behind, too.
        seed: Seed of the grey of vehicles without `shade`.
        boxes: Draw plain boxes instead of cars.
        reach: What is farther than this is left out [m].

    Returns:
        How many rows were written.

    Raises:
        ValueError: For a pose that is not finite.
    """
    n = 0
    look_x, look_y = look
    rows = out.data.cast("B")
    for group in (road.vehicles, road.objects):
        for index, item in enumerate(group):
            if item is ego:
                continue
            place = item.position
            # Python's own floats: arithmetic on NumPy's scalars takes several times as long.
            px, py = place.tolist() if place.__class__ is np.ndarray else place
            dx, dy = px - x, py - y
            length = item.LENGTH
            ahead = dx * look_x + dy * look_y
            if not -length - item.WIDTH < ahead < reach or dx * dx + dy * dy > reach * reach:
                if not math.isfinite(ahead):
                    raise ValueError(f"{type(item).__name__} {index} of the road has position ({px}, {py})")
                continue
            if n == MAX_DRAWN:
                return n
            _write(rows, n * _ROW.size, item, px, py, seed, index, boxes)
            n += 1
    return n


def _write(
    out: memoryview, at: int, item: Any, px: float, py: float, seed: int, index: int, boxes: bool
) -> None:
    cls = item.__class__
    model, height = _MODELS.get(cls) or _model_of(cls)
    heading = item.heading
    if not math.isfinite(heading):
        raise ValueError(f"{cls.__name__} {index} of the road has heading {heading}")
    length = item.LENGTH
    height = getattr(item, "HEIGHT", height)
    if model == MODEL_CAR:
        if boxes:
            model = MODEL_BOX
        elif height > 2.2 or length > 7.5:
            model, height = MODEL_TRUCK, max(height, 2.8)
    shade = getattr(item, "shade", None)
    if shade is None:
        shade = index_shade(seed, index) if model < MODEL_MARK else OUTLINE if model == MODEL_MARK else 185.0
    elif model == MODEL_BARRIER:
        model = MODEL_BOX  # a grey of its own is a plain thing: the barrier's stripes are not
    action = getattr(item, "action", None)
    brake = bool(action) and action.get("acceleration", 0.0) < _BRAKE_LIGHT_MPS2
    _ROW.pack_into(
        out,
        at,
        px,
        py,
        math.cos(heading),
        math.sin(heading),
        length,
        item.WIDTH,
        height,
        shade,
        brake,
        model,
        MAX_RANGE,
        getattr(item, "speed", 0.0),
    )


def ego_of(env: Any) -> tuple[Any, Any]:
    """Return (road, ego vehicle) of a highway-env environment, wrapped or not.

    Raises:
        ValueError: If the environment has no road or no ego vehicle (yet).
    """
    base = getattr(env, "unwrapped", env)
    road, ego = getattr(base, "road", None), getattr(base, "vehicle", None)
    if road is None:
        raise ValueError("the environment has no road: call reset() before render()")
    if ego is None:
        raise ValueError("the environment has no ego vehicle (env.unwrapped.vehicle is None)")
    return road, ego
