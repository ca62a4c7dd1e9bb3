"""Distances of entities and positions by the distance types of OpenSCENARIO, and how fast they close."""

from math import cos, hypot, inf, isnan, nan, sin
from typing import NamedTuple

from lgmd_gym.openscenario.motion import Place
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.ways import Span
from lgmd_gym.openscenario.world import Mover, ScenarioMap

EUCLIDEAN, LONGITUDINAL, LATERAL = "euclidianDistance", "longitudinal", "lateral"
_TYPES = (EUCLIDEAN, "cartesianDistance", LONGITUDINAL, LATERAL)  # cartesianDistance: old name of the first
_MOMENT = 1e-4  # [s], for the rate of a distance along the road
_BESIDE = 0.5  # [m] before or after the roads of an entity, beyond which a place is not beside them
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
    world: ScenarioMap | None = None  # the roads along which it is measured; None for the entity's axes

    def between(self, one: Mover, other: Target, time: float) -> float:
        """Return the distance at a time, >= 0 [m]."""
        if self.world is not None:
            return self._along_road(self.world, one, other, time)
        return hypot(*self._gap(one, other, time))

    def _along_road(self, world: ScenarioMap, one: Mover, other: Target, time: float) -> float:
        """Return the distance along or across the road of an entity, >= 0; nan beyond its end [m]."""
        here, there = one.place(time), other.place(time)
        spans = _spans(world, one, here)
        (begin, own_left, line), (end, left, _) = station(spans, here), station(spans, there)
        ahead = (end > begin) == (cos(here.heading - line.heading) > 0.0)
        apart = abs(end - begin) if self.kind == LONGITUDINAL else abs(left - own_left)
        if self.freespace and self.kind == LONGITUDINAL:
            apart -= one.front if ahead else one.rear
            if other.mover is not None:
                same = cos(there.heading - here.heading) > 0.0
                apart -= other.mover.rear if ahead == same else other.mover.front
        elif self.freespace:
            apart -= one.body.width / 2 + (0.0 if other.mover is None else other.mover.body.width / 2)
        return apart if isnan(apart) else max(apart, 0.0)

    def time_to_collision(self, one: Mover, other: Target, time: float) -> float:
        """Return the distance divided by its present rate of decrease [s]; inf if it does not decrease."""
        if self.world is not None:
            distance = self.between(one, other, time)
            closing = (distance - self.between(one, other, time + _MOMENT)) / _MOMENT
            return 0.0 if distance == 0.0 else distance / closing if closing > 0.0 else inf
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


def _spans(world: ScenarioMap, mover: Mover, place: Place) -> tuple[Span, ...]:
    """Return the lane sections of an entity's way, or its road without a way."""
    if mover.way is not None:
        return mover.way.spans
    road, _, _ = world.locate(place)
    return (Span(road, 1, 0, 0.0, road.length, 0.0),)


def station(spans: tuple[Span, ...], place: Place) -> tuple[float, float, Place]:
    """Return distance along and offset from the roads of a way, nan beyond its ends, and their pose [m]."""
    found: list[tuple[float, float, float, Place]] = []
    for road in dict.fromkeys(span.road for span in spans):
        s = min(max(road.line.project(place), 0.0), road.length)
        span = next(item for item in spans if item.road is road)
        along = span.start + span.direction * (s - span.begin)
        line = span.line(along)
        seen = place.seen_from(line)
        inside = abs(seen.x) < _BESIDE
        apart = abs(seen.x) * 1e3 + abs(seen.y)
        found.append((apart, along if inside else nan, seen.y if inside else nan, line))
    _, along, left, line = min(found, key=lambda item: item[0])
    return along, left, line


def read_distance(item: Element, world: ScenarioMap, default: str | None = EUCLIDEAN) -> Distance:
    """Return the distance that a condition states; without a type it is Euclidean, as in the standard.

    Args:
        item: The condition.
        world: The roads.
        default: Distance type if `relativeDistanceType` is missing; None if the attribute is required.
    """
    along = item.flag("alongRoute")  # of OpenSCENARIO 1.0: the distance along the road
    system = item.choice("coordinateSystem", ("entity", "road", "lane"), "entity")
    kind = item.choice("relativeDistanceType", _TYPES, LONGITUDINAL if along else default)
    kind = EUCLIDEAN if kind == "cartesianDistance" else kind
    item.choice("routingAlgorithm", ("undefined",), "undefined")
    on_road = along or system != "entity"
    return Distance(kind, item.flag("freespace"), world if on_road and kind != EUCLIDEAN else None)


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
