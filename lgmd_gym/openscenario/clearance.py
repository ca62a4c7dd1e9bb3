"""Conditions on the lanes around an entity: whether they are clear, and whether it has left all roads."""

from collections.abc import Callable, Sequence
from math import ceil, cos, inf, isnan
from typing import NamedTuple

from lgmd_gym.openscenario.distances import station
from lgmd_gym.openscenario.motion import Place
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.roads import Road
from lgmd_gym.openscenario.ways import Span, Way, follow
from lgmd_gym.openscenario.world import Mover, ScenarioMap, lane_at

_STEP = 0.05  # [s] between the samples of a duration


class Area(NamedTuple):
    """The area that has to be clear, relative to an entity and in the direction of its body."""

    ahead: float  # distance ahead, along the reference line [m]
    behind: float  # distance behind [m]
    lanes: tuple[tuple[float, float], ...]  # ranges of lanes relative to its own, + to the left
    freespace: bool  # of bounding boxes rather than of reference points
    opposite: bool  # whether lanes of the opposite traffic count

    def is_clear(self, mover: Mover, others: Sequence[Mover], spans: tuple[Span, ...], time: float) -> bool:
        """Return whether the area has a driving lane beside the entity and no other entity.

        Args:
            mover: The entity.
            others: The entities that count.
            spans: Lane sections of the entity's way, also before its start.
            time: Time [s].
        """
        here = mover.place(time)
        own = _seen(spans, here)
        if own is None:
            return False
        sign = 1 if cos(here.heading - own.span.line(own.along).heading) > 0.0 else -1
        beside = [
            own._replace(lane=number, inside=True)
            for number, lane in own.span.road.lanes(own.s).items()
            if number and lane.kind == "driving"
        ]
        exists = any(self._counts(lane, own, sign) for lane in beside)
        return exists and not any(self._has(mover, other, spans, time, own, sign) for other in others)

    def _has(
        self, mover: Mover, other: Mover, spans: tuple[Span, ...], time: float, own: "_Seen", sign: int
    ) -> bool:
        """Return whether another entity is in the area.

        Args:
            mover: The entity.
            other: The other entity.
            spans: Lane sections of the entity's way, also before its start.
            time: Time [s].
            own: The place of the entity.
            sign: 1 for a body in the direction of its way, else -1.
        """
        there = other.place(time)
        places = [there, *_corners(other, there)] if self.freespace else [there]
        found = [seen for seen in (_seen(spans, place) for place in places) if seen is not None]
        if not found:
            return False
        ahead = [sign * (seen.along - own.along) for seen in found]
        front, rear = (mover.front, mover.rear) if self.freespace else (0.0, 0.0)
        if min(ahead) > self.ahead + front or max(ahead) < -self.behind - rear:
            return False
        return any(self._counts(seen, own, sign) for seen in found)

    def _counts(self, seen: "_Seen", own: "_Seen", sign: int) -> bool:
        """Return whether a place is in a lane of the area; see `_has`."""
        if not seen.inside or (seen.along_traffic != own.along_traffic and not self.opposite):
            return False
        relative = sign * (seen.lanes_left - own.lanes_left)
        return any(low <= relative <= high for low, high in self.lanes)


class _Seen(NamedTuple):
    """A place beside a way."""

    span: Span
    along: float  # distance along the way [m]
    s: float  # distance along the road [m]
    lane: int  # id of the nearest lane
    inside: bool  # whether it is in this lane

    @property
    def along_traffic(self) -> bool:
        """Whether the traffic of the lane has the direction of the way."""
        return self.span.road.direction(self.lane) == self.span.direction

    @property
    def lanes_left(self) -> int:
        """Number of lanes to the left of that of the way."""
        return self.span.direction * (_rank(self.lane) - _rank(self.span.lane))


def _rank(lane: int) -> int:
    """Return the number of a lane in an order without 0, the lane without width."""
    return lane - 1 if lane > 0 else lane


def _seen(spans: tuple[Span, ...], place: Place) -> _Seen | None:
    """Return a place beside a way; None beyond its ends."""
    along, left, _ = station(spans, place)
    if isnan(along):
        return None
    span = next((item for item in reversed(spans) if item.start <= along), spans[0])
    s, t = min(max(span.s(along), 0.0), span.road.length), span.direction * left
    lane = lane_at(span.road, s, t)
    inside = abs(t - span.road.lane_centre(lane, s)) <= span.road.width(lane, s) / 2
    return _Seen(span, along, s, lane, inside)


def _corners(mover: Mover, place: Place) -> list[Place]:
    """Return the corners of a body."""
    side = mover.body.width / 2
    return [place.moved(x, y) for x in (mover.front, -mover.rear) for y in (side, -side)]


def relative_clearance(item: Element, mover: Mover, world: ScenarioMap) -> Callable[[float], bool]:
    """Return the test whether some lanes around an entity exist and contain no other entity."""
    ranges = tuple(map(_lane_range, item.all("RelativeLaneRange")))
    named = [world.mover(entry) for entry in item.all("EntityRef")]
    others = [other for other in named or world.movers.values() if other is not mover]
    area = Area(
        _reach(item, "distanceForward"),
        _reach(item, "distanceBackward"),
        ranges or ((-inf, inf),),
        item.flag("freeSpace"),
        item.flag("oppositeLanes"),
    )
    known: dict[Way, tuple[Span, ...]] = {}

    def holds(time: float) -> bool:
        if mover.way is None:
            raise item.error(f"{mover.name!r} must drive along a lane at {time:.3g} s")
        if mover.way not in known:
            known[mover.way] = _extended(world, mover.way)
        present = [other for other in others if other.track is not None and not other.deleted]
        return area.is_clear(mover, present, known[mover.way], time)

    return holds


def _lane_range(item: Element) -> tuple[float, float]:
    """Return the first and the last lane of a range; one without a limit is infinite."""
    low: float = item.whole("from") if item.has("from") else -inf
    high: float = item.whole("to") if item.has("to") else inf
    if low > high:
        raise item.error(f"{item.tag} from={low:g} must be <= to={high:g}")
    return low, high


def _reach(item: Element, name: str) -> float:
    distance = item.number(name, 0.0)
    if distance < 0.0:
        raise item.error(f"{item.tag} {name} must be >= 0 m, got {distance:g}")
    return distance


def _extended(world: ScenarioMap, way: Way) -> tuple[Span, ...]:
    """Return the lane sections of a way, and those before its start with distances below 0."""
    first = way.spans[0]
    back, _ = follow(world.network, first.road, -first.direction, first.begin, first.lane)
    before = [
        Span(span.road, -span.direction, span.lane, span.end, span.begin, -span.finish)
        for span in reversed(back.spans)
    ]
    return (*before, *way.spans)


def _on_surface(road: Road, place: Place) -> bool:
    """Return whether a place is on a lane with a surface."""
    s = road.line.project(place)
    t = place.seen_from(road.at(s)).y
    return 0.0 < s < road.length and any(
        abs(t - road.lane_centre(number, s)) <= road.width(number, s) / 2
        for number, lane in road.lanes(s).items()
        if lane.kind != "none"
    )


def off_road(item: Element, mover: Mover, world: ScenarioMap) -> Callable[[float], bool]:
    """Return the test whether the reference point of an entity has been beside all lanes for a duration.

    Lanes of the type "none", the edge of a road without surface, do not count.
    """
    duration = item.number("duration")
    count = max(ceil(duration / _STEP), 1)

    def off(time: float) -> bool:
        place = mover.place(time)
        return not any(_on_surface(road, place) for road in world.network.roads.values())

    def holds(time: float) -> bool:
        return time >= duration and all(off(time - duration * part / count) for part in range(count + 1))

    return holds
