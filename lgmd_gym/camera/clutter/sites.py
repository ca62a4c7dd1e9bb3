"""Sites of clutter along a road, and the parts that stand there."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lgmd_gym.camera.objects import MODEL_MARK, OBJECT
from lgmd_gym.camera.roadside import PLANT_RANGE, clear_of, directions

_WIDEST = 40  # roads are measured up to this width [m]


class Places(NamedTuple):
    """Places on a road with the direction of travel; arrays of shape (n,)."""

    x: np.ndarray  # position on the outer edge of a lane, or on its centre line [m]
    y: np.ndarray  # the same [m]
    cos: np.ndarray  # direction of travel
    sin: np.ndarray  # the same
    side: np.ndarray  # 1 if the outer edge is to the right of the direction of travel, -1 to the left
    width: np.ndarray  # width of the lane, or of the road that a kind spans [m]
    kind: np.ndarray  # number of the kind of clutter

    def select(self, chosen: np.ndarray) -> "Places":
        """Return some of the places."""
        return Places(*(values[chosen] for values in self))

    def beyond(self, out: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """Return x and y of points beyond the edge [m]."""
        right = self.side * out
        return self.x - right * self.sin, self.y + right * self.cos

    def of_kind(self, kind: int) -> "Sites":
        """Return the sites of one kind."""
        place = np.flatnonzero(self.kind == kind)
        return Sites(place, self.width[place])


class Sites(NamedTuple):
    """Where the clutter of one kind is; arrays of shape (n,)."""

    place: np.ndarray  # index of the place in `Places`
    width: np.ndarray  # its width [m]

    def select(self, chosen: np.ndarray) -> "Sites":
        """Return some of the sites."""
        return Sites(self.place[chosen], self.width[chosen])


def lane_places(
    segments: np.ndarray,
    densities: Sequence[float],
    rng: np.random.Generator,
    x_range: tuple[float, float] | None,
) -> Places:
    """Draw places on the centre lines of all lanes.

    Args:
        segments: See `posts_and_plants`.
        densities: Density of each kind [1/km].
        rng: Random generator.
        x_range: Bounds of x; None for all.
    """
    unit, length = directions(segments)
    density = np.asarray(densities, dtype=np.float64)
    steps = 1000.0 / np.maximum(density, 1e-9)
    # The places of a kind are jittered around points of equal distance along each lane.
    offset = rng.random(len(steps)) * steps
    start = (segments[:, 4] - offset[:, None]) / steps[:, None]
    first = np.ceil(start)
    count = np.maximum(np.ceil(start + length / steps[:, None]) - first, 0.0).astype(np.int64)
    count[density <= 0.0] = 0
    flat = count.ravel()
    item = np.repeat(np.arange(flat.size), flat)
    kind, owner = np.divmod(item, len(segments))
    nth = np.arange(len(item)) - np.repeat(np.cumsum(flat) - flat, flat)
    along = first.ravel()[item] + nth + rng.uniform(-0.4, 0.4, len(item))
    along = np.clip(offset[kind] + along * steps[kind] - segments[owner, 4], 0.0, length[owner])
    cos, sin = unit[owner].T
    x, y = segments[owner, 0] + along * cos, segments[owner, 1] + along * sin
    places = Places(x, y, cos, sin, np.ones(len(x)), segments[owner, 5], kind)
    if x_range is None:
        return places
    return places.select((x >= x_range[0]) & (x <= x_range[1]))


def edge_places(
    segments: np.ndarray,
    densities: Sequence[float],
    rng: np.random.Generator,
    x_range: tuple[float, float] | None,
) -> Places:
    """Draw places on the outer edges, those beyond which there is no lane; see `lane_places`."""
    lanes = lane_places(segments, [*densities, *densities], rng, x_range)
    second, kind = np.divmod(lanes.kind, len(densities))
    lanes = lanes._replace(side=2.0 * second - 1.0, kind=kind)
    x, y = lanes.beyond(0.5 * lanes.width)
    # A metre beyond any other edge is another lane.
    kerb = np.stack(lanes.beyond(0.5 * lanes.width + 1.0), axis=1)
    return lanes._replace(x=x, y=y).select(clear_of(kerb, segments, np.zeros(len(kerb))))


def with_road_width(edges: Places, kinds: int, segments: np.ndarray) -> Places:
    """Return edge places in which the first kinds have the width of the whole road.

    Each road has two outer edges: for these kinds, only its right edge is kept, and of two-way roads only
    that in the direction of growing x.
    """
    forward = (edges.cos > 1e-9) | ((np.abs(edges.cos) <= 1e-9) & (edges.sin > 0.0))
    spans = edges.kind < kinds
    edges = edges.select(~spans | (forward & (edges.side > 0.0)))
    chosen = np.flatnonzero(edges.kind < kinds)
    right = edges.select(np.repeat(chosen, _WIDEST))
    probes = np.tile(np.arange(0.5, _WIDEST), len(chosen))
    points = np.stack(right.beyond(-probes), axis=1)
    beyond = clear_of(points, segments, np.zeros(len(points))).reshape(len(chosen), _WIDEST)
    width = edges.width.copy()
    width[chosen] = np.where(beyond.any(axis=1), beyond.argmax(axis=1), 0.0)
    return edges._replace(width=width).select(width > 0.0)


MARK_RANGE = 90.0
"""Range of small marks on the ground, farther than which they cover some hundredths of a pixel [m]."""

Value = np.ndarray | float
_FIELDS = ("length", "width", "height", "shade", "base", "model", "range", "braking")


def part(
    sites: Sites,
    model: Value,
    size: tuple[Value, Value, Value],
    shade: Value,
    *,
    along: Value = 0.0,
    out: Value = 0.0,
    base: Value = 0.0,
    turn: Value = 0.0,
    distance: float = PLANT_RANGE,
    braking: Value = 0.0,
) -> np.ndarray:
    """Return one part per site.

    Args:
        sites: Where.
        model: Model of the objects.
        size: Length, width and height of the top [m].
        shade: Grey of the body.
        along: Distance ahead of the site [m].
        out: Distance beyond the edge, or to the right of the centre line [m].
        base: Height of the underside [m].
        turn: Heading relative to the direction of travel, to the right [rad].
        distance: Range from the lens [m].
        braking: Whether the brake lights are on.

    Returns:
        Columns for `records_of`, float64, shape (12, n).
    """
    columns = np.empty((12, len(sites.place)))
    if len(sites.place) == 0:  # most kinds in most worlds
        return columns
    values = (sites.place, along, out, turn, *size, shade, base, model, distance, braking)
    for row, value in zip(columns, values, strict=True):
        row[:] = value
    return columns


def mark(
    sites: Sites,
    size: tuple[Value, Value],
    shade: Value,
    *,
    along: Value = 0.0,
    out: Value = 0.0,
    turn: Value = 0.0,
    distance: float = MARK_RANGE,
) -> np.ndarray:
    """Return one rectangle on the ground per site; see `part`."""
    return part(sites, MODEL_MARK, (*size, 0.0), shade, along=along, out=out, turn=turn, distance=distance)


def records_of(parts: list[np.ndarray], places: Places) -> tuple[np.ndarray, np.ndarray]:
    """Return `OBJECT` records of all parts, and the number of the place of each one; shape (n,)."""
    columns = np.concatenate([np.zeros((12, 0)), *parts], axis=1)
    owner = columns[0].astype(np.int64)
    along, out, turn = columns[1], columns[2], columns[3]
    at = places.select(owner)
    right, cos, sin = at.side * out, np.cos(turn), np.sin(turn)
    records = np.zeros(len(owner), OBJECT)
    records["x"] = at.x + along * at.cos - right * at.sin
    records["y"] = at.y + along * at.sin + right * at.cos
    records["cos"], records["sin"] = at.cos * cos - at.sin * sin, at.sin * cos + at.cos * sin
    for name, values in zip(_FIELDS, columns[4:], strict=True):
        records[name] = values
    return records, owner
