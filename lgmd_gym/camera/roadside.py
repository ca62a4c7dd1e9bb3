"""Posts, bushes, trees and guard rails beside the road: they carry much of the flow that a driver sees."""

from __future__ import annotations

import numpy as np

_CLEAR = 2.5  # nothing but posts stands nearer to a lane's edge than this [m]
_POST_STEP, _POST_OFFSET = 50.0, 1.2
_PLANT_STEP = 40.0
_RAIL_STEP, _RAIL_OFFSET = 8.0, 0.75  # two posts a piece, as with the usual 4 m between them


def plant(segments: np.ndarray, density: float, seed: int, codes: tuple[int, int, int]) -> np.ndarray:
    """Place posts, bushes and trees along the outer edges of the lanes.

    Args:
        segments: Straight pieces of lanes, float64, shape (n, 6): x0, y0, x1, y1 of the centre line,
            distance of the start along the lane, width [m].
        density: Multiple of the natural density; 0 leaves the roadside bare.
        seed: Seed of the places and looks.
        codes: Number of columns of an object, model of a post, model of a tree.

    Returns:
        Objects sorted by x, float64, shape (n, columns), as `lgmd_gym.camera.scene.OBJ_…`.
    """
    columns, post, tree = codes
    if density <= 0.0 or not len(segments):
        return np.zeros((0, columns))
    rng = np.random.default_rng([seed, 4])
    posts = _row(_beside(segments, _POST_STEP / density, _POST_OFFSET, 0.0, rng), columns, post)
    posts[:, 4:8] = 0.1, 0.1, 1.0, 225.0
    plants = _row(_beside(segments, _PLANT_STEP / density, 4.0, 12.0, rng), columns, tree)
    # Four in ten are bushes; the rest are trees of 4 to 9 m.
    bush = rng.random(len(plants)) < 0.4
    height = np.where(bush, rng.uniform(1.0, 2.2, len(plants)), rng.uniform(4.0, 9.0, len(plants)))
    width = height * np.where(bush, rng.uniform(1.2, 1.7, len(plants)), rng.uniform(0.55, 0.8, len(plants)))
    plants[:, 4], plants[:, 5], plants[:, 6] = width, width, height
    plants[:, 7] = rng.uniform(38.0, 82.0, len(plants))
    plants = plants[_clear_of(plants[:, :2], segments, _CLEAR + 0.5 * width)]
    posts = posts[_clear_of(posts[:, :2], segments, np.full(len(posts), 0.6))]
    both = np.concatenate((posts, plants))
    return np.ascontiguousarray(both[np.argsort(both[:, 0], kind="stable")])


def rails(segments: np.ndarray, columns: int, model: int) -> np.ndarray:
    """Place guard rails along the outer edges of the lanes, in straight pieces of at most 8 m.

    Args:
        segments: As for `plant`.
        columns: Number of columns of an object.
        model: Model of a rail.

    Returns:
        Objects, float64, shape (n, columns).
    """
    starts = np.flatnonzero(segments[:, 4] == 0.0)
    pieces = [np.zeros((0, 4))]
    for lane in np.split(segments, starts[1:]):
        ends = _nodes(lane)
        for side in (-1.0, 1.0):
            line = ends[:, 0:2] + side * (0.5 * ends[:, 4:5] + _RAIL_OFFSET) * ends[:, 2:4]
            middle = 0.5 * (line[:-1] + line[1:])
            free = _clear_of(line, segments, np.full(len(line), 0.4 * _RAIL_OFFSET))
            free = (
                free[:-1] & free[1:] & _clear_of(middle, segments, np.full(len(middle), 0.4 * _RAIL_OFFSET))
            )
            pieces.append(np.concatenate((line[:-1], line[1:]), axis=1)[free])
    ends = np.concatenate(pieces)
    delta = ends[:, 2:4] - ends[:, 0:2]
    length = np.maximum(np.hypot(delta[:, 0], delta[:, 1]), 1e-9)
    out = _row(0.5 * (ends[:, 0:2] + ends[:, 2:4]), columns, model)
    out[:, 2:4] = delta / length[:, None]
    out[:, 4] = length
    out[:, 5:8] = 0.12, 0.75, 165.0  # width, height (EN 1317 systems have 0.7 to 0.8), galvanised steel
    return out


def _nodes(lane: np.ndarray) -> np.ndarray:
    """Points every 8 m along one lane's segments: x, y, unit normal to the right, width; shape (n, 5)."""
    delta = lane[:, 2:4] - lane[:, 0:2]
    length = np.maximum(np.hypot(delta[:, 0], delta[:, 1]), 1e-9)
    total = lane[-1, 4] + length[-1]
    along = np.linspace(0.0, total, int(np.ceil(total / _RAIL_STEP)) + 1)
    owner = np.clip(np.searchsorted(lane[:, 4], along, side="right") - 1, 0, len(lane) - 1)
    unit = delta[owner] / length[owner, None]
    base = lane[owner, 0:2] + unit * (along - lane[owner, 4])[:, None]
    return np.column_stack((base, -unit[:, 1], unit[:, 0], lane[owner, 5]))


def _row(places: np.ndarray, columns: int, model: int) -> np.ndarray:
    out = np.zeros((len(places), columns))
    out[:, :2] = places
    out[:, 2] = 1.0  # cosine of the heading
    out[:, 9] = model
    return out


def _beside(
    segments: np.ndarray, step: float, offset: float, spread: float, rng: np.random.Generator
) -> np.ndarray:
    """Points every `step` metres along the outer edges, `offset` to `offset + spread` beyond them."""
    delta = segments[:, 2:4] - segments[:, 0:2]
    length = np.hypot(delta[:, 0], delta[:, 1])
    start, width = segments[:, 4], segments[:, 5]
    first = np.ceil(start / step)
    count = np.maximum(np.ceil((start + length) / step) - first, 0.0).astype(np.int64)
    owner = np.repeat(np.arange(len(segments)), count)
    nth = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    along = (first[owner] + nth) * step - start[owner]
    unit = delta / np.maximum(length, 1e-9)[:, None]
    points = []
    for side in (-1.0, 1.0):
        jitter = rng.uniform(-0.4, 0.4, len(owner)) * step * (spread > 0.0)
        lateral = side * (0.5 * width[owner] + offset + spread * rng.random(len(owner)))
        base = segments[owner, 0:2] + unit[owner] * (along + jitter)[:, None]
        across = np.stack((-unit[owner, 1], unit[owner, 0]), axis=1)
        # Only the outer side of the outer lane: a metre beyond any other edge is another lane.
        kerb = base + side * (0.5 * width[owner] + 1.0)[:, None] * across
        outer = _clear_of(kerb, segments, np.zeros(len(kerb)))
        points.append((base + lateral[:, None] * across)[outer])
    return np.concatenate(points)


def _clear_of(points: np.ndarray, segments: np.ndarray, margin: np.ndarray) -> np.ndarray:
    """Which points are at least `margin` from the edge of every lane; bool, shape (n,)."""
    keep = np.ones(len(points), dtype=bool)
    for x0, y0, x1, y1, _, width in segments:
        dx, dy = x1 - x0, y1 - y0
        rx, ry = points[:, 0] - x0, points[:, 1] - y0
        t = np.clip((rx * dx + ry * dy) / max(dx * dx + dy * dy, 1e-9), 0.0, 1.0)
        keep &= np.hypot(rx - t * dx, ry - t * dy) > 0.5 * width + margin
    return keep
