"""Distances of entities and positions by the distance types of OpenSCENARIO, and how fast they close."""

from math import cos, hypot, inf, sin
from typing import NamedTuple

from lgmd_gym.openscenario.motion import Place
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.world import Mover

EUCLIDEAN, LONGITUDINAL, LATERAL = "euclidianDistance", "longitudinal", "lateral"
_TYPES = (EUCLIDEAN, "cartesianDistance", LONGITUDINAL, LATERAL)  # cartesianDistance: old name of the first
_ORIGIN = (0.0, 0.0, 0.0)  # box of a point


class Target(NamedTuple):
    """An entity or a position to which a distance is measured."""

    mover: Mover | None  # None for a position
    position: Place | None = None  # None for an entity

    def place(self, time: float) -> Place:
        """Return the pose of the reference point at a time [s]."""
        if self.mover is not None:
            return self.mover.place(time)
        assert self.position is not None
        return self.position


class Distance(NamedTuple):
    """Kind of a distance, in the axes of the entity from which it is measured."""

    kind: str  # euclidianDistance, longitudinal or lateral
    freespace: bool  # between the bounding boxes rather than the reference points

    def between(self, one: Mover, other: Target, time: float) -> float:
        """Return the distance at a time, >= 0 [m]."""
        return hypot(*self._gap(one, other, time))

    def time_to_collision(self, one: Mover, other: Target, time: float) -> float:
        """Return the distance divided by its present rate of decrease [s]; inf if it does not decrease."""
        x, y = self._gap(one, other, time)
        distance = hypot(x, y)
        if distance == 0.0:
            return 0.0
        vx, vy = relative_velocity(one, other.mover, other.place(time), time)
        closing = -(x * vx + y * vy) / distance
        return distance / closing if closing > 0.0 else inf

    def _gap(self, one: Mover, other: Target, time: float) -> tuple[float, float]:
        """Return the shortest vector between both in the axes of the first entity [m]."""
        seen = other.place(time).seen_from(one.place(time))
        own = _box(one) if self.freespace else _ORIGIN
        box = _box(other.mover) if self.freespace and other.mover is not None else _ORIGIN
        corners = _corners(seen, box)
        along = _outside([corner.x for corner in corners], -own[1], own[0])
        across = _outside([corner.y for corner in corners], -own[2], own[2])
        if self.kind == LONGITUDINAL:
            return along, 0.0
        if self.kind == LATERAL:
            return 0.0, across
        back = [corner.seen_from(seen) for corner in _corners(Place(0.0, 0.0, 0.0), own)]
        apart = (
            _outside([point.x for point in back], -box[1], box[0]),
            _outside([point.y for point in back], -box[2], box[2]),
        )
        if along == across == 0.0 and apart == (0.0, 0.0):  # no axis separates the boxes
            return 0.0, 0.0
        candidates = [
            (_outside([corner.x], -own[1], own[0]), _outside([corner.y], -own[2], own[2]))
            for corner in corners
        ]
        c, s = cos(seen.heading), sin(seen.heading)
        for point in back:
            x = _outside([point.x], -box[1], box[0])
            y = _outside([point.y], -box[2], box[2])
            candidates.append((s * y - c * x, -s * x - c * y))
        return min(candidates, key=lambda item: hypot(*item))


def read_distance(item: Element, default: str | None = EUCLIDEAN) -> Distance:
    """Return the distance that a condition states; without a type it is Euclidean, as in the standard.

    Args:
        item: The condition.
        default: Distance type if `relativeDistanceType` is missing; None if the attribute is required.
    """
    if item.flag("alongRoute"):
        raise item.error(f"{item.tag} alongRoute=true is not supported; use relativeDistanceType")
    item.choice("coordinateSystem", ("entity",), "entity")
    kind = item.choice("relativeDistanceType", _TYPES, default)
    item.choice("routingAlgorithm", ("undefined",), "undefined")
    return Distance(EUCLIDEAN if kind == "cartesianDistance" else kind, item.flag("freespace"))


def relative_velocity(one: Mover, other: Mover | None, there: Place, time: float) -> tuple[float, float]:
    """Return the velocity of another entity, None for a position, in the axes of the first [m/s]."""
    speed = 0.0 if other is None else other.signed_speed(time)
    angle = there.heading - one.place(time).heading
    return speed * cos(angle) - one.signed_speed(time), speed * sin(angle)


def _box(mover: Mover) -> tuple[float, float, float]:
    """Return the distances from the reference point to the front, the rear and a side [m]."""
    return mover.front, mover.rear, mover.body.width / 2


def _corners(place: Place, box: tuple[float, float, float]) -> list[Place]:
    front, rear, side = box
    return [place.moved(x, y) for x in {front, -rear} for y in {side, -side}]


def _outside(values: list[float], low: float, high: float) -> float:
    """Return the signed distance of the interval of some values from [low, high]; 0 if they overlap."""
    if min(values) > high:
        return min(values) - high
    return max(values) - low if max(values) < low else 0.0
