"""Curves as bends: clothoids that pass through the poses of a curve, and rounded polylines."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from math import atan2, cos, hypot, remainder, tan, tau
from typing import NamedTuple

import numpy as np

from lgmd_gym.envs.dynamics.script import MAX_CURVATURE, Bend
from lgmd_gym.openscenario.motion import Place

TOLERANCE = 2e-3
"""Largest distance of a fitted path from its curve [m]."""
SHORTEST = 0.25
"""Length below which a piece of a curve is not divided, so that its corners are rounded [m]."""
MAX_PIECES = 5000
"""Largest number of pieces that are tried between two stops of a curve."""
CORNER = 0.05
"""Distance from a corner at which a polyline is rounded, where its radius is above the smallest [m]."""
_ROUNDED = 4.0  # [m] within which a corner of a curve is rounded
_LONGEST = 20.0  # [m], length of a piece that is tested at `_PROBES`
_PROBES = (0.2, 0.4, 0.6, 0.8)
_TURN = 0.8  # [rad], largest direction of an end of a piece relative to its chord
_CURVATURE = 1.0  # [1/m], limit of a fitted clothoid
_GAUSS = np.polynomial.legendre.leggauss(12)
_NODES, _WEIGHTS = (_GAUSS[0] + 1.0) / 2.0, _GAUSS[1] / 2.0  # on [0, 1]


def clothoid(start: Place, end: Place) -> Bend | None:
    """Return the clothoid from one pose to another; None if it would turn too far or too tightly."""
    dx, dy = end.x - start.x, end.y - start.y
    chord, direction = hypot(dx, dy), atan2(dy, dx)
    first, last = remainder(start.heading - direction, tau), remainder(end.heading - direction, tau)
    if chord < 1e-6 or max(abs(first), abs(last)) > _TURN:
        return None
    # The heading relative to the chord is first + (last - first - a) x + a x² for x in [0, 1]; the lateral
    # offset at the end is 0 for one `a`, which Newton's method finds.
    a = 3.0 * (first + last)
    for _ in range(20):
        angle = first + (last - first - a) * _NODES + a * _NODES**2
        offset = float(_WEIGHTS @ np.sin(angle))
        change = offset / float(_WEIGHTS @ (np.cos(angle) * (_NODES**2 - _NODES)))
        a -= change
        if abs(change) < 1e-13:
            break
    angle = first + (last - first - a) * _NODES + a * _NODES**2
    length = chord / float(_WEIGHTS @ np.cos(angle))
    begin, finish = (last - first - a) / length, (last - first + a) / length
    if max(abs(begin), abs(finish)) > _CURVATURE:
        return None
    straight = max(abs(begin), abs(finish)) * length < 1e-12
    return Bend(length) if straight else Bend(length, begin, finish)


class _Piece(NamedTuple):
    """A clothoid from a pose."""

    start: Place
    bend: Bend

    def at(self, distance: float) -> Place:
        """Return the pose at a distance along it [m]."""
        slope = (self.bend.last_curvature - self.bend.curvature) / self.bend.length
        along = distance * _NODES
        angle = self.start.heading + along * (self.bend.curvature + slope * along / 2)
        x, y = (distance * float(_WEIGHTS @ part) for part in (np.cos(angle), np.sin(angle)))
        heading = self.start.heading + distance * (self.bend.curvature + slope * distance / 2)
        return Place(self.start.x + x, self.start.y + y, heading)

    def beside(self, place: Place, share: float) -> float:
        """Return the distance of a place that is about at a share of the length [m]."""
        distance = share * self.bend.length
        for _ in range(2):
            distance += place.seen_from(self.at(distance)).x
        return abs(place.seen_from(self.at(distance)).y)


def fit(
    curve: Callable[[float], Place], stops: Sequence[float], start: Place | None = None
) -> tuple[Bend, ...]:
    """Return bends along a curve, within `TOLERANCE` of it where it has no corners.

    Args:
        curve: Pose at a parameter; its heading is the direction in which the parameter grows.
        stops: Increasing parameters at which the bends pass through the pose.
        start: Pose at which the path begins; None for the pose of the curve.

    Raises:
        ValueError: If the curve turns too tightly for a path.
    """
    bends, here = list[Bend](), curve(stops[0]) if start is None else start
    for low, high in pairwise(stops):
        here = _fit_between(curve, low, high, here, bends)
    if here.distance(curve(stops[-1])) > SHORTEST:
        raise ValueError(f"a curve ends with a corner near x={here.x:.4g}, y={here.y:.4g}; make it smooth")
    return tuple(bends)


def _fit_between(
    curve: Callable[[float], Place], low: float, high: float, here: Place, bends: list[Bend]
) -> Place:
    """Append the bends between two parameters to those that end at a pose; return the pose of their end.

    A corner within a short piece is left out, and rounded by the next piece that is long enough.
    """
    pending, tried = [(low, high)], 0
    while pending:
        low, high = pending.pop()
        tried += 1
        if tried > MAX_PIECES:
            raise ValueError(f"a curve needs more than {MAX_PIECES} pieces; make it shorter or smoother")
        end = curve(high)
        bend = clothoid(here, end)
        short = high - low < 1e-6 or curve(low).distance(end) < 2.0 * SHORTEST
        if bend is not None and (short or _close(curve, low, high, _Piece(here, bend))):
            bends.append(bend)
            here = end
        elif not short:
            middle = (low + high) / 2
            pending += [(middle, high), (low, middle)]
        elif here.distance(end) > _ROUNDED:
            turn = remainder(end.heading - here.heading, tau)
            raise ValueError(
                f"a path with a corner or a jump to the side near x={end.x:.4g}, y={end.y:.4g} (turn of "
                f"{abs(turn):.3g} rad within {here.distance(end):.3g} m) is not supported: a radius is at "
                "least 1 m"
            )
    return here


def _close(curve: Callable[[float], Place], low: float, high: float, piece: _Piece) -> bool:
    if piece.bend.length > _LONGEST and not (piece.bend.curvature == piece.bend.last_curvature == 0.0):
        return False
    places = [(share, curve(low + share * (high - low))) for share in _PROBES]
    return all(piece.beside(place, share) <= TOLERANCE for share, place in places)


class Rounded(NamedTuple):
    """A polyline with arcs at its corners."""

    start: Place
    bends: tuple[Bend, ...]
    stations: tuple[float, ...]  # distance along the path at which it passes each vertex [m]
    deviation: float  # largest distance of the path from a vertex [m]


def round_corners(points: Sequence[tuple[float, float]]) -> Rounded:
    """Return a polyline with arcs at its corners.

    The radius of an arc is at least 1 m, or 0.5 m between short segments. It is larger where the segments
    have room, as long as the path passes the vertex at 5 cm or less.

    Args:
        points: Vertices, each away from the previous one; at least 2 [m].

    Raises:
        ValueError: If a corner has no room for an arc of 0.5 m.
    """
    steps = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(points)]
    lengths = [hypot(*step) for step in steps]
    headings = [atan2(dy, dx) for dx, dy in steps]
    bends, stations, deviation = list[Bend](), [0.0], 0.0
    halves = [0.0, *(remainder(b - a, tau) / 2 for a, b in pairwise(headings)), 0.0]
    used = distance = 0.0  # of the present segment, and of the path
    for number in range(1, len(steps)):
        half, before, after = halves[number], lengths[number - 1], lengths[number]
        tangent, radius = 0.0, 0.0
        if abs(half) > 1e-9:
            # A segment that is straight at its other end has room for an arc in its whole length.
            whole = (abs(halves[number - 1]) <= 1e-9, abs(halves[number + 1]) <= 1e-9)
            room = min(before * (1.0 if whole[0] else 0.5), after * (1.0 if whole[1] else 0.5))
            radius = _radius(abs(half), min(before, after) / 2, room, points[number])
            tangent = radius * tan(abs(half))
            deviation = max(deviation, radius * (1.0 / cos(half) - 1.0))
        straight = lengths[number - 1] - used - tangent
        if straight > 1e-9:
            bends.append(Bend(straight))
            distance += straight
        arc = 2.0 * abs(half) * radius
        stations.append(distance + arc / 2)
        if arc > 1e-9:
            bends.append(Bend(arc, (1.0 if half > 0.0 else -1.0) / radius))
            distance += arc
        used = tangent
    if lengths[-1] - used > 1e-9:
        bends.append(Bend(lengths[-1] - used))
    stations.append(distance + lengths[-1] - used)
    return Rounded(Place(*points[0], headings[0]), tuple(bends), tuple(stations), deviation)


def _radius(half: float, room: float, whole: float, point: tuple[float, float]) -> float:
    """Return the radius of the arc at a corner that turns by twice an angle [m].

    Args:
        half: Half of the angle, in [0, π / 2] [rad].
        room: Length of both segments that the arc may use [m].
        whole: Length that it may use if it needs more for a radius of 1 m [m].
        point: The corner.
    """
    largest = room / tan(half) if half < 1.55 else 0.0
    if largest < 1.0 and half < 1.55:
        largest = min(whole / tan(half), 1.0)
    if largest < 1.0 / MAX_CURVATURE:
        raise ValueError(
            f"a corner of {2.0 * half:.3g} rad at x={point[0]:.4g}, y={point[1]:.4g} is too sharp for its "
            f"segments: a radius is at least {1.0 / MAX_CURVATURE:g} m; use a ClothoidSpline"
        )
    return min(largest, max(CORNER / (1.0 / cos(half) - 1.0), 1.0))


def parallel(line: Callable[[float], Place], offset: Callable[[float], float], step: float = 1e-2):
    """Return the curve at an offset from a line, + left [m].

    Args:
        line: Pose of the line at a distance [m].
        offset: Offset at a distance [m].
        step: Distance for the derivatives [m].
    """

    def at(distance: float) -> Place:
        before, after = line(distance - step), line(distance + step)
        left = before.moved(0.0, offset(distance - step))
        right = after.moved(0.0, offset(distance + step))
        here = line(distance).moved(0.0, offset(distance))
        return here._replace(heading=atan2(right.y - left.y, right.x - left.x))

    return at


def nurbs(
    points: Sequence[tuple[float, float, float]], knots: Sequence[float], order: int
) -> Callable[[float], Place]:
    """Return a non-uniform rational B-spline as a curve of its parameter.

    Args:
        points: x [m], y [m] and weight of each control point.
        knots: Knots, as many as control points plus the order.
        order: Order, one more than the degree.
    """
    weighted = np.array([(x * w, y * w, w) for x, y, w in points])
    knot = np.asarray(knots, float)

    def homogeneous(value: float) -> np.ndarray:
        span = int(np.clip(np.searchsorted(knot, value, "right") - 1, order - 1, len(points) - 1))
        rows = weighted[span - order + 1 : span + 1].copy()
        for level in range(1, order):
            for index in range(order - 1, level - 1, -1):
                low, high = knot[index + span - order + 1], knot[index + 1 + span - level]
                share = 0.0 if high == low else (value - low) / (high - low)
                rows[index] = (1.0 - share) * rows[index - 1] + share * rows[index]
        return rows[-1]

    def point(value: float) -> tuple[float, float]:
        x, y, w = homogeneous(value)
        return float(x / w), float(y / w)

    first, last = float(knot[order - 1]), float(knot[len(points)])
    step = 1e-6 * (last - first)

    def at(value: float) -> Place:
        low, high = max(value - step, first), min(value + step, last)
        (x0, y0), (x1, y1) = point(low), point(high)
        return Place(*point(value), atan2(y1 - y0, x1 - x0))

    return at
