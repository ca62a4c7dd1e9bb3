# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Posts, bushes, trees and guard rails along the road."""

import math

import numpy as np

from lgmd_gym.camera.objects import MODEL_POST, MODEL_RAIL, MODEL_TREE, OBJECT, sorted_by_x, take
from lgmd_gym.kernels import kernel

PLANT_RANGE = 150.0
"""Range of the roadside from the lens; it fades in over the last sixth [m]."""

_PLANT_CLEARANCE = 2.5  # minimum distance of a plant from a lane's edge [m]
_POST_STEP, _POST_OFFSET = 50.0, 1.2
_PLANT_STEP = 40.0
_RAIL_STEP, _RAIL_OFFSET = 8.0, 0.75  # two posts a piece, at the usual spacing of 4 m


def posts_and_plants(segments: np.ndarray, density: float, seed: int) -> np.ndarray:
    """Place posts, bushes and trees along the outer edges of the lanes.

    Args:
        segments: Straight pieces of lanes, float64, shape (n, 6): x0, y0, x1, y1 of the centre line,
            distance of the start along the lane, width [m].
        density: Multiple of the natural density; 0 leaves the roadside bare.
        seed: Seed of positions and appearance.

    Returns:
        `OBJECT` records sorted by x, shape (n,).
    """
    if density <= 0.0:
        return np.zeros(0, OBJECT)
    rng = np.random.default_rng([seed, 4])
    posts = _records(_along_edges(segments, _POST_STEP / density, _POST_OFFSET, 0.0, rng), MODEL_POST)
    posts["length"], posts["width"], posts["height"], posts["shade"] = 0.1, 0.1, 1.0, 225.0
    plants = _records(_along_edges(segments, _PLANT_STEP / density, 4.0, 12.0, rng), MODEL_TREE)
    # Four in ten are bushes; the rest are trees of 4 to 9 m.
    bush = rng.random(len(plants)) < 0.4
    height = np.where(bush, rng.uniform(1.0, 2.2, len(plants)), rng.uniform(4.0, 9.0, len(plants)))
    width = height * np.where(bush, rng.uniform(1.2, 1.7, len(plants)), rng.uniform(0.55, 0.8, len(plants)))
    plants["length"], plants["width"], plants["height"] = width, width, height
    plants["shade"] = rng.uniform(38.0, 82.0, len(plants))
    plants = take(plants, clear_of(_positions(plants), segments, _PLANT_CLEARANCE + 0.5 * width))
    posts = take(posts, clear_of(_positions(posts), segments, np.full(len(posts), 0.6)))
    return sorted_by_x((posts, plants))


def guard_rails(segments: np.ndarray) -> np.ndarray:
    """Place guard rails along the outer edges in straight pieces of up to 8 m; see `posts_and_plants`."""
    first_of_lane = np.flatnonzero(segments[:, 4] == 0.0)
    pieces = [np.zeros((0, 4))]
    for lane in np.split(segments, first_of_lane[1:]):
        nodes = _nodes(lane)
        for side in (-1.0, 1.0):
            line = nodes[:, 0:2] + side * (0.5 * nodes[:, 4:5] + _RAIL_OFFSET) * nodes[:, 2:4]
            middle = 0.5 * (line[:-1] + line[1:])
            free = clear_of(line, segments, np.full(len(line), 0.4 * _RAIL_OFFSET))
            free_middle = clear_of(middle, segments, np.full(len(middle), 0.4 * _RAIL_OFFSET))
            free = free[:-1] & free[1:] & free_middle
            pieces.append(np.concatenate((line[:-1], line[1:]), axis=1)[free])
    ends = np.concatenate(pieces)
    unit, length = directions(ends)
    rails = _records(0.5 * (ends[:, 0:2] + ends[:, 2:4]), MODEL_RAIL)
    rails["cos"], rails["sin"], rails["length"] = unit[:, 0], unit[:, 1], length
    # EN 1317 systems are 0.7 to 0.8 m high; the grey is that of galvanised steel.
    rails["width"], rails["height"], rails["shade"] = 0.12, 0.75, 165.0
    return rails


def directions(segments: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the unit vectors, shape (n, 2), and lengths, shape (n,), of pieces x0, y0, x1, y1, … [m]."""
    delta = segments[:, 2:4] - segments[:, 0:2]
    length = np.maximum(np.hypot(delta[:, 0], delta[:, 1]), 1e-9)
    return delta / length[:, None], length


def _nodes(lane: np.ndarray) -> np.ndarray:
    """Return points every 8 m along a lane: x, y, unit normal to the right, width; shape (n, 5)."""
    unit, length = directions(lane)
    total = lane[-1, 4] + length[-1]
    along = np.linspace(0.0, total, int(np.ceil(total / _RAIL_STEP)) + 1)
    owner = np.clip(np.searchsorted(lane[:, 4], along, side="right") - 1, 0, len(lane) - 1)
    base = lane[owner, 0:2] + unit[owner] * (along - lane[owner, 4])[:, None]
    return np.column_stack((base, -unit[owner, 1], unit[owner, 0], lane[owner, 5]))


def _records(positions: np.ndarray, model: int) -> np.ndarray:
    records = np.zeros(len(positions), OBJECT)
    records["x"], records["y"], records["cos"] = positions[:, 0], positions[:, 1], 1.0
    records["model"], records["range"] = model, PLANT_RANGE
    return records


def _positions(records: np.ndarray) -> np.ndarray:
    return np.stack((records["x"], records["y"]), axis=1)


def _along_edges(
    segments: np.ndarray, step: float, offset: float, spread: float, rng: np.random.Generator
) -> np.ndarray:
    """Return points every `step` metres along the outer edges, `offset` to `offset + spread` beyond them."""
    unit, length = directions(segments)
    start, width = segments[:, 4], segments[:, 5]
    first = np.ceil(start / step)
    count = np.maximum(np.ceil((start + length) / step) - first, 0.0).astype(np.int64)
    owner = np.repeat(np.arange(len(segments)), count)
    nth = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    along = (first[owner] + nth) * step - start[owner]
    across = np.stack((-unit[owner, 1], unit[owner, 0]), axis=1)
    points = []
    for side in (-1.0, 1.0):
        jitter = rng.uniform(-0.4, 0.4, len(owner)) * step * (spread > 0.0)
        lateral = side * (0.5 * width[owner] + offset + spread * rng.random(len(owner)))
        base = segments[owner, 0:2] + unit[owner] * (along + jitter)[:, None]
        # Only the outer side of the outer lane: a metre beyond any other edge is another lane.
        kerb = base + side * (0.5 * width[owner] + 1.0)[:, None] * across
        outer = clear_of(kerb, segments, np.zeros(len(kerb)))
        points.append((base + lateral[:, None] * across)[outer])
    return np.concatenate(points)


@kernel(exact=True, arrays=True)
def clear_of(points, segments, margin):
    """Return whether each point is at least `margin` beyond the edges of all lanes; bool, shape (n,)."""
    clear = np.ones(len(points), dtype=np.bool_)
    for i in range(len(points)):
        clear[i] = is_clear(points[i, 0], points[i, 1], segments, margin[i])
    return clear


@kernel(exact=True, arrays=True)
def is_clear(x, y, segments, margin):
    """Return whether a point is at least `margin` beyond the edges of all lanes."""
    for j in range(len(segments)):
        x0, y0, width = segments[j, 0], segments[j, 1], segments[j, 5]
        dx, dy = segments[j, 2] - x0, segments[j, 3] - y0
        rx, ry = x - x0, y - y0
        t = min(max((rx * dx + ry * dy) / max(dx * dx + dy * dy, 1e-9), 0.0), 1.0)
        if not math.hypot(rx - t * dx, ry - t * dy) > 0.5 * width + margin:
            return False
    return True
