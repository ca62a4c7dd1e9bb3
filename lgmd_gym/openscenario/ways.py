"""Ways along lanes: over lane sections and from road to road, and the paths beside their centre."""

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from math import atan2, cos, pi, remainder, tau
from typing import NamedTuple

from lgmd_gym.envs.dynamics.script import Bend
from lgmd_gym.openscenario.curves import fit
from lgmd_gym.openscenario.motion import Place
from lgmd_gym.openscenario.roads import Road, RoadNetwork

REACH = 3000.0
"""Length of a way from its start [m]; a path goes straight on after it."""
GAP = 1.0  # [m] between the lanes of connected roads, above which a way ends
_TIGHT = 1e-3  # [m] and [rad], below which the lanes of two roads are continuous
_STEP = 1e-2  # [m], for derivatives


class Span(NamedTuple):
    """A lane section of a way."""

    road: Road
    direction: int  # 1 along the reference line, -1 against it
    lane: int  # id of the lane
    begin: float  # distance along the road at which the way enters [m]
    end: float  # distance along the road at which the way leaves [m]
    start: float  # distance along the way at `begin`, along the reference lines [m]

    @property
    def finish(self) -> float:
        """Distance along the way at `end` [m]."""
        return self.start + abs(self.end - self.begin)

    def s(self, along: float) -> float:
        """Return the distance along the road at one along the way [m]."""
        return self.begin + self.direction * (along - self.start)

    def line(self, along: float) -> Place:
        """Return the pose of the reference line in the direction of travel."""
        place = self.road.at(self.s(along))
        return place if self.direction > 0 else place.turned(pi)

    def centre(self, along: float) -> float:
        """Return the offset of the lane's centre from the reference line, + left of the travel [m]."""
        inside = min(max(self.s(along), min(self.begin, self.end)), max(self.begin, self.end))
        return self.direction * self.road.lane_centre(self.lane, inside, self.begin + self.end)

    def place(self, along: float, left: float = 0.0) -> Place:
        """Return the pose of the lane's centre, or one at a distance to its left [m]."""
        if self.constant:
            return self.line(along).moved(0.0, self.centre(along) + left)
        return _beside(self, along, lambda _: left)

    @property
    def constant(self) -> bool:
        """Whether the centre of the lane has a constant distance from the reference line."""
        return self.road.constant_centre(self.lane, min(self.begin, self.end), max(self.begin, self.end))


def _beside(span: Span, along: float, left: Callable[[float], float]) -> Place:
    """Return the pose of the curve at a distance to the left of the lane's centre [m]."""

    def at(distance: float) -> Place:
        return span.line(distance).moved(0.0, span.centre(distance) + left(distance))

    low, high = max(along - _STEP, span.start), min(along + _STEP, span.finish)
    before, after, here = at(low), at(high), at(along)
    if high - low < _STEP / 2:
        return here
    return here._replace(heading=atan2(after.y - before.y, after.x - before.x))


class Way(NamedTuple):
    """A lane from its start over lane sections and roads."""

    spans: tuple[Span, ...]

    @property
    def length(self) -> float:
        """Length along the reference lines [m]."""
        return self.spans[-1].finish

    def span(self, along: float) -> Span:
        """Return the lane section at a distance along the way [m]."""
        return next((item for item in reversed(self.spans) if item.start <= along), self.spans[0])

    def curve(self, left: Callable[[float], float]) -> Callable[[float], Place]:
        """Return the pose at a distance to the left of the lane's centre, as a function of the distance."""
        return lambda along: _beside(self.span(along), along, left)

    def stops(self, begin: float, end: float) -> list[float]:
        """Return the distances at which the shape of the lane changes, with both ends [m]."""
        found = {begin, end}
        for span in self.spans:
            joints = [span.start + span.direction * (s - span.begin) for s in span.road.joints]
            found |= {item for item in (span.start, *joints) if begin < item < end}
        ordered = sorted(found)
        return [
            item
            for item, after in zip(ordered, [*ordered[1:], end + 1.0], strict=True)
            if item == begin or after - item > 1e-3
        ]

    def bends(self, begin: float, left: float, start: Place) -> tuple[Bend, ...]:
        """Return the bends of the path from a distance on, at a distance to the left of the centre [m].

        Args:
            begin: Distance along the way at which the path begins [m].
            left: Distance from the centre of the lane, + left [m].
            start: Pose at which the path begins.
        """
        return _bends(self, round(begin, 9), round(left, 9), start)


@lru_cache(maxsize=512)
def _bends(way: Way, begin: float, left: float, start: Place) -> tuple[Bend, ...]:
    spans = [span for span in way.spans if span.finish > begin + 1e-9]
    if not spans:
        return ()
    joints = all(_joined(one, other, left) for one, other in pairwise(spans))
    if joints and all(span.constant for span in spans):
        bends: list[Bend] = []
        for span in spans:
            low, high = span.s(max(begin, span.start)), span.end
            offset = span.direction * (span.centre(span.start) + left)
            bends += span.road.bends(span.direction, offset, min(low, high), max(low, high))
        return tuple(bends)
    return fit(way.curve(lambda _: left), way.stops(begin, way.length), start)


def _joined(one: Span, other: Span, left: float) -> bool:
    """Return whether the path is continuous from one lane section to the next."""
    end, start = one.place(one.finish, left), other.place(other.start, left)
    turn = remainder(end.heading - start.heading, tau)
    return end.distance(start) < _TIGHT and abs(turn) < _TIGHT


def follow(
    network: RoadNetwork,
    road: Road,
    direction: int,
    s: float,
    lane: int,
    legs: Sequence[tuple[Road, int]] = (),
) -> tuple[Way, bool]:
    """Return the way along a lane from a place on, over `REACH` or to the end of the roads.

    The lane continues as the one whose centre is nearest to its own at the end of a lane section. Where
    several roads follow and no route is given, the way is the straightest one.

    Args:
        network: The roads.
        road: First road.
        direction: 1 along its reference line, -1 against it.
        s: Distance along the road at which the way begins [m].
        lane: Id of the lane there.
        legs: Roads after the first one, with their directions; empty to choose them.

    Returns:
        The way, and whether it had to choose between several roads.
    """
    spans, chosen, left = list[Span](), False, list(legs)
    start = 0.0
    while True:
        for begin, end in _sections(road, direction, s):
            if spans:
                lane = _nearest_lane(road, direction, begin, end, spans[-1])
            spans.append(Span(road, direction, lane, begin, end, start))
            start = spans[-1].finish
        if start > REACH:
            spans[-1] = spans[-1]._replace(end=spans[-1].s(REACH))
        if not spans or start >= REACH:
            return Way(tuple(spans)), chosen
        last = spans[-1].place(start)
        options = list(_after(network, road, direction, spans[-1], last))
        if left:
            options = [left.pop(0)]
        if not options:
            return Way(tuple(spans)), chosen
        chosen = chosen or len(options) > 1
        road, direction = min(options, key=lambda item: (_turn(*item, last), item[0].name))
        s = 0.0 if direction > 0 else road.length


def _sections(road: Road, direction: int, s: float) -> Iterator[tuple[float, float]]:
    """Yield begin and end of the lane sections from a distance on, in the direction of travel [m]."""
    edges = [*(start for start, _ in road.sections[1:]), road.length if direction > 0 else 0.0]
    if direction < 0:
        edges = [0.0, *(start for start, _ in road.sections[1:])][::-1]
    for edge in edges:
        if direction * (edge - s) > 1e-9:
            yield s, edge
            s = edge


def _nearest_lane(road: Road, direction: int, begin: float, end: float, before: Span) -> int:
    """Return the lane of a section whose centre continues that of the previous one."""
    last = before.place(before.finish)
    side = 1 if road.direction(1) == direction else -1  # sign of the lanes with this direction of traffic

    def apart(lane: int) -> tuple[float, bool, bool, int]:
        there = Span(road, direction, lane, begin, end, 0.0).place(0.0)
        kind = road.lanes((begin + end) / 2)[lane].kind
        return round(last.distance(there), 3), lane * side < 0, kind != "driving", abs(lane)

    return min((lane for lane in road.lanes((begin + end) / 2) if lane != 0), key=apart)


def _after(
    network: RoadNetwork, road: Road, direction: int, before: Span, last: Place
) -> Iterator[tuple[Road, int]]:
    """Yield the roads, with directions, whose lanes continue that of a lane section."""
    for name, end in network.after(road.name, "end" if direction > 0 else "start"):
        other, side = network.roads[name], 1 if end == "start" else -1
        begin, finish = next(_sections(other, side, 0.0 if side > 0 else other.length), (0.0, 0.0))
        if (
            begin == finish
            or not other.is_open(side)
            or all(lane == 0 for lane in other.lanes((begin + finish) / 2))
        ):
            continue
        lane = _nearest_lane(other, side, begin, finish, before)
        place = Span(other, side, lane, begin, finish, 0.0).place(0.0)
        if place.distance(last) <= GAP and cos(place.heading - last.heading) > 0.5:
            yield other, side


def _turn(road: Road, direction: int, last: Place) -> float:
    """Return by how much a road turns from a pose to its end [rad]."""
    end = road.at(road.length) if direction > 0 else road.at(0.0).turned(pi)
    return abs(remainder(end.heading - last.heading, tau))
