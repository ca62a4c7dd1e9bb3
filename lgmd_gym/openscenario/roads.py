"""OpenDRIVE road networks: reference lines, lanes, the links between roads, and routes."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from heapq import heappop, heappush
from itertools import pairwise
from math import atan2, pi
from pathlib import Path
from typing import NamedTuple

from lgmd_gym.envs.dynamics.script import Bend
from lgmd_gym.errors import unknown_name
from lgmd_gym.openscenario.curves import fit
from lgmd_gym.openscenario.motion import Place, Track
from lgmd_gym.openscenario.nodes import Element, Node, parse_file

_CLOSE = 1e-3  # [m], tolerance of the geometries of a reference line
End = tuple[str, str]  # road, and "start" or "end"


class Width(NamedTuple):
    """A cubic polynomial of the distance from `s`."""

    s: float
    coefficients: tuple[float, float, float, float]


class Lane(NamedTuple):
    """A lane of a lane section."""

    kind: str  # OpenDRIVE's lane type, such as "driving"
    widths: tuple[Width, ...]


@dataclass(frozen=True, eq=False)
class Road:
    """A road."""

    name: str  # its id
    length: float  # length [m]
    line: Track  # reference line
    # start of each lane section [m], and its lanes by id; + left of the reference line
    sections: tuple[tuple[float, dict[int, Lane]], ...]
    offsets: tuple[Width, ...]  # lane offsets
    left_hand: bool  # whether traffic drives on the left
    junction: str  # id of the junction that the road belongs to, "-1" for none
    links: dict[str, End]  # road ends that the road's start and end are connected to

    def lanes(self, s: float) -> dict[int, Lane]:
        """Return the lanes at a distance [m]."""
        return self._section(s)[1]

    def width(self, lane: int, s: float) -> float:
        """Return the width of a lane at a distance [m]."""
        start, lanes = self._section(s)
        return _polynomial(lanes[lane].widths, s - start)

    def _section(self, s: float) -> tuple[float, dict[int, Lane]]:
        return next((item for item in reversed(self.sections) if item[0] <= s), self.sections[0])

    def lane_centre(self, lane: int, s: float, twice: float | None = None) -> float:
        """Return the offset of a lane's centre from the reference line, + left [m].

        Args:
            lane: Id of the lane.
            s: Distance along the road [m].
            twice: Twice a distance within the lane section, for its ends; None for that of `s` [m].
        """
        start, lanes = self._section(s if twice is None else twice / 2)
        total = _polynomial(self.offsets, s)
        if lane == 0:
            return total
        if lane not in lanes:
            raise unknown_name(f"lane of road {self.name}", str(lane), map(str, lanes))
        side = 1 if lane > 0 else -1
        for number in _inside(lanes, lane):
            total += side * _polynomial(lanes[number].widths, s - start)
        return total + side * _polynomial(lanes[lane].widths, s - start) / 2

    def constant_centre(self, lane: int, low: float, high: float) -> bool:
        """Return whether the offset of a lane's centre is constant between two distances [m]."""
        start, lanes = self._section((low + high) / 2)
        inside = [lanes[number].widths for number in (*_inside(lanes, lane), lane)]
        widths = all(_is_constant(item, low - start, high - start) for item in inside)
        return widths and _is_constant(self.offsets, low, high)

    @cached_property
    def joints(self) -> tuple[float, ...]:
        """Distances at which the shape of the road or of its lanes changes, without its ends [m]."""
        found, distance = {item.s for item in self.offsets}, 0.0
        for bend in self.line.bends:
            distance += bend.length
            found.add(distance)
        for start, lanes in self.sections:
            found.add(start)
            found |= {start + width.s for lane in lanes.values() for width in lane.widths}
        return tuple(sorted(item for item in found if 0.0 < item < self.length))

    def direction(self, lane: int) -> int:
        """Return 1 if the traffic of a lane drives along the reference line, else -1."""
        return 1 if (lane < 0) != self.left_hand else -1

    def is_open(self, direction: int) -> bool:
        """Return whether traffic may drive in a direction; roads outside of junctions are open in both."""
        lanes = [lane for _, inside in self.sections for lane in inside if lane]
        return self.junction == "-1" or any(self.direction(lane) == direction for lane in lanes)

    def at(self, s: float, t: float = 0.0) -> Place:
        """Return the pose of the reference line at a distance, shifted to the left by `t` [m]."""
        return self.line.at(s, t)

    def nearest(self, place: Place) -> tuple[float, float]:
        """Return distance along and offset from the reference line of the point nearest to a place [m]."""
        s = self.line.nearest(place, 0.0, self.length)
        return s, place.seen_from(self.line.at(s)).y

    def bends(
        self, direction: int, t: float, low: float = 0.0, high: float | None = None
    ) -> tuple[Bend, ...]:
        """Return the bends of the line at offset `t` of the reference line [m].

        Args:
            direction: 1 for the direction of the reference line, -1 for the opposite.
            t: Offset from the reference line, + left of it [m].
            low: Distance along the road at which they begin, in the direction of the reference line [m].
            high: Distance at which they end; None for the end of the road [m].
        """
        high = self.length if high is None else high
        part, bends, along = self.line.part(low, high), list[Bend](), 0.0
        for bend in part.bends:
            constant = bend.curvature == bend.last_curvature
            if t != 0.0 and not constant:
                bends += _parallel(Track(part.at(along), (bend,)), t)
            else:
                scale = 1.0 - bend.curvature * t if t != 0.0 else 1.0
                if scale <= 0.0:
                    raise ValueError(f"road {self.name} has no line at {t:.3g} m: it is beyond its centre")
                last = None if constant else bend.last_curvature / scale
                bends.append(Bend(bend.length * scale, bend.curvature / scale, last))
            along += bend.length
        missing = high - low - along
        bends += [Bend(missing)] if missing > _CLOSE else []
        return tuple(bends) if direction > 0 else tuple(map(_reversed, reversed(bends)))


def _inside(lanes: dict[int, Lane], lane: int) -> list[int]:
    """Return the ids of the lanes between the centre and a lane, from the centre outwards."""
    side = 1 if lane > 0 else -1
    return sorted((number for number in lanes if 0 < number * side < lane * side), key=abs)


@lru_cache(maxsize=4096)
def _parallel(line: Track, t: float) -> tuple[Bend, ...]:
    """Return the bends of the line at an offset from another one [m]."""
    if min(1.0 - bend * t for item in line.bends for bend in (item.curvature, item.last_curvature)) <= 0.0:
        raise ValueError(f"a spiral has no line at {t:.3g} m: it is beyond its centre")
    return fit(lambda distance: line.at(distance, t), (0.0, line.length))


def _reversed(bend: Bend) -> Bend:
    constant = bend.end_curvature is None
    return Bend(bend.length, -bend.last_curvature, None if constant else -bend.curvature)


def _is_constant(items: tuple[Width, ...], low: float, high: float) -> bool:
    """Return whether polynomials are constant between two distances [m]."""
    last = max((item.s for item in items if item.s <= low + 1e-9), default=low)
    used = [item for item in items if last <= item.s < high - 1e-9]
    values = {item.coefficients[0] for item in used}
    if used and used[0].s > low + 1e-9:  # 0 before the first record
        values.add(0.0)
    return len(values) <= 1 and all(not any(item.coefficients[1:]) for item in used)


def _polynomial(items: tuple[Width, ...], s: float) -> float:
    item = next((item for item in reversed(items) if item.s <= s + 1e-9), None)
    if item is None:
        return 0.0
    return _cubic(item.coefficients, s - item.s)


def _cubic(coefficients: tuple[float, ...], x: float) -> float:
    a, b, c, d = coefficients
    return a + x * (b + x * (c + x * d))


def _slope(coefficients: tuple[float, ...], x: float) -> float:
    _, b, c, d = coefficients
    return b + x * (2.0 * c + x * 3.0 * d)


@dataclass(frozen=True)
class RoadNetwork:
    """The roads of an OpenDRIVE file by id, and the road ends that direct junctions connect."""

    roads: dict[str, Road]
    direct: dict[End, list[End]] = field(default_factory=dict[End, list[End]])

    def road(self, name: str) -> Road:
        """Return the road with an id."""
        if name not in self.roads:
            raise unknown_name("road", name, self.roads)
        return self.roads[name]

    def route(self, first: str, direction: int | None, last: str) -> list[tuple[Road, int]]:
        """Return the shortest way from one road to another, as roads and directions.

        Args:
            first: Id of the first road.
            direction: Direction on it, 1 along the reference line; None for any.
            last: Id of the last road.
        """
        starts = (1, -1) if direction is None else (direction,)
        queue: list[tuple[float, str, int, tuple[tuple[str, int], ...]]]
        queue = [(self.road(first).length, first, way, ((first, way),)) for way in starts]
        seen = set[tuple[str, int]]()
        while queue:
            length, name, way, steps = heappop(queue)
            if name == last:
                return [(self.roads[road], side) for road, side in steps]
            if (name, way) in seen:
                continue
            seen.add((name, way))
            for other, end in self.after(name, "end" if way > 0 else "start"):
                side = 1 if end == "start" else -1
                if not self.roads[other].is_open(side):
                    continue
                total = length + self.roads[other].length
                heappush(queue, (total, other, side, (*steps, (other, side))))
        raise ValueError(f"the road network has no way from road {first} to road {last}")

    def after(self, name: str, end: str) -> Iterator[End]:
        """Yield the road ends that are connected to the end of a road."""
        link = self.roads[name].links.get(end)
        if link is not None and link[0] in self.roads:
            yield link
        yield from self.direct.get((name, end), ())
        for other in self.roads.values():
            for side, target in other.links.items():
                if target == (name, end):
                    yield other.name, side


def read_roads(path: Path) -> RoadNetwork:
    """Return the road network of an OpenDRIVE file."""
    return _network(parse_file(path))


@lru_cache(maxsize=32)
def _network(node: Node) -> RoadNetwork:
    root = Element(node, {})
    if root.tag != "OpenDRIVE":
        raise root.error(f"an OpenDRIVE file must begin with OpenDRIVE, got {root.tag}")
    roads: dict[str, Road] = {}
    for item in root.all("road"):
        road = _road(item)
        if road.name in roads:
            raise item.error(f"road id {road.name!r} is used twice; choose another")
        roads[road.name] = road
    if not roads:
        raise root.error("the file has no road")
    return RoadNetwork(roads, _direct_junctions(root, roads))


def _direct_junctions(root: Element, roads: dict[str, Road]) -> dict[End, list[End]]:
    """Return the road ends that direct junctions connect, without connecting roads, in both directions."""
    ends: dict[tuple[str, str], str] = {}  # end of a road at a junction
    for item in root.all("road"):
        for end, other in _link_elements(item):
            if other.text("elementType") == "junction":
                ends[item.text("id"), other.text("elementId")] = end
    found: dict[End, list[End]] = {}
    for junction in root.all("junction"):
        for connection in junction.all("connection") if junction.text("type", "default") == "direct" else ():
            incoming, linked = connection.text("incomingRoad"), connection.text("linkedRoad")
            contact, end = (
                connection.choice("contactPoint", ("start", "end")),
                (incoming, junction.text("id")),
            )
            if end not in ends or linked not in roads:
                raise connection.error(f"road {incoming} or {linked} is not at junction {end[1]}")
            one, other = (incoming, ends[end]), (linked, contact)
            found.setdefault(one, []).append(other)
            found.setdefault(other, []).append(one)
    return found


def _road(item: Element) -> Road:
    lanes = item.child("lanes")
    sections = tuple((section.number("s"), _lanes(section)) for section in lanes.all("laneSection"))
    if not sections:
        raise lanes.error("a road must have a laneSection")
    return Road(
        item.text("id"),
        item.number("length"),
        _reference_line(item.child("planView")),
        sections,
        tuple(_width(offset, "s") for offset in lanes.all("laneOffset")),
        item.text("rule", "RHT") == "LHT",
        item.text("junction", "-1"),
        dict(_links(item)),
    )


def _links(item: Element) -> Iterator[tuple[str, End]]:
    """Yield the connections to roads; those to junctions follow from the connecting roads."""
    for own, other in _link_elements(item):
        if other.text("elementType") == "road":
            yield own, (other.text("elementId"), other.choice("contactPoint", ("start", "end")))


def _link_elements(item: Element) -> Iterator[tuple[str, Element]]:
    """Yield the ends of a road with the elements of what follows them."""
    link = item.find("link")
    for tag, own in (("predecessor", "start"), ("successor", "end")):
        other = None if link is None else link.find(tag)
        if other is not None:
            yield own, other


def _lanes(section: Element) -> dict[int, Lane]:
    lanes: dict[int, Lane] = {}
    for side in section.all("left", "right"):
        for lane in side.all("lane"):
            widths = tuple(_width(width, "sOffset") for width in lane.all("width"))
            lanes[lane.whole("id")] = Lane(lane.text("type"), widths)
    return lanes


def _width(item: Element, start: str) -> Width:
    a, b, c, d = (item.number(name) for name in "abcd")
    return Width(item.number(start), (a, b, c, d))


def _reference_line(view: Element) -> Track:
    """Return the reference line; its geometries must be continuous."""
    start, bends, line = None, list[Bend](), None
    for item in sorted(view.all("geometry"), key=lambda item: item.number("s")):
        place = Place(item.number("x"), item.number("y"), item.number("hdg"))
        if line is None:
            start = place
        else:
            end = line.at(line.length)
            if abs(end.x - place.x) + abs(end.y - place.y) > _CLOSE:
                raise item.error("the geometries of a road must be continuous")
        length = item.number("length")
        if length > 1e-9:
            bends += _bends(item, length, place)
        assert start is not None
        line = Track(start, tuple(bends))
    if line is None:
        raise view.error("planView must contain a geometry")
    return line


def _bends(item: Element, length: float, start: Place) -> tuple[Bend, ...]:
    """Return the bends of a geometry that begins at a pose."""
    shape = item.only("line", "arc", "spiral", "paramPoly3")
    if shape.tag == "line":
        return (Bend(length),)
    if shape.tag == "arc":
        return (Bend(length, shape.number("curvature")),)
    if shape.tag == "spiral":
        return (Bend(length, shape.number("curvStart"), shape.number("curvEnd")),)
    normalized = shape.choice("pRange", ("arcLength", "normalized"), "normalized") == "normalized"
    u, v = (tuple(shape.number(f"{name}{axis}") for name in "abcd") for axis in "UV")

    def at(p: float) -> Place:
        place = start.moved(_cubic(u, p), _cubic(v, p))
        return place.turned(atan2(_slope(v, p), _slope(u, p)))

    with item.locate_errors("paramPoly3: "):
        return fit(at, (0.0, 1.0 if normalized else length))


Stop = tuple[Road, int | None, float]  # road, lane, distance along the road [m]


class Leg(NamedTuple):
    """A road of a route."""

    road: Road
    direction: int  # 1 along the reference line, -1 against it
    start: float  # [m], distance along the route at its beginning


@dataclass(frozen=True)
class Route:
    """A way along roads; lanes and offsets refer to the direction of travel."""

    legs: tuple[Leg, ...]  # the roads
    origin: float  # distance from the beginning of the first road to the first waypoint [m]

    @classmethod
    def through(cls, network: RoadNetwork, stops: list[Stop]) -> "Route":
        """Return the shortest route through waypoints."""
        steps: list[tuple[Road, int]] = []
        for (road, lane, s), (other, _, after) in pairwise(stops):
            direction = None if lane is None or lane == 0 else road.direction(lane)
            if road is other and after != s:
                direction = 1 if after > s else -1
            way = network.route(road.name, direction, other.name)
            steps += way if not steps or steps[-1] != way[0] else way[1:]
        legs, length = list[Leg](), 0.0
        for road, direction in steps:
            legs.append(Leg(road, direction, length))
            length += road.length
        first, direction = steps[0]
        return cls(tuple(legs), stops[0][2] if direction > 0 else first.length - stops[0][2])

    @cached_property
    def track(self) -> Track:
        """Path along the reference lines, from the beginning of the first road on."""
        return self.shifted(0.0)

    def shifted(self, left: float) -> Track:
        """Return the path at a distance to the left of the reference lines [m]."""
        first = self.legs[0]
        start = first.road.at(0.0 if first.direction > 0 else first.road.length, first.direction * left)
        bends = [leg.road.bends(leg.direction, leg.direction * left) for leg in self.legs]
        heading = start if first.direction > 0 else start.turned(pi)
        return Track(heading, tuple(bend for part in bends for bend in part))

    def at(self, distance: float, left: float = 0.0) -> Place:
        """Return the pose at a distance along the route, shifted to the left [m]."""
        return self.track.at(self.origin + distance, left)

    def lane_centre(self, lane: int, distance: float) -> float:
        """Return the offset of a lane's centre, + left of the direction of travel [m]."""
        along = self.origin + distance
        leg = next(leg for leg in reversed(self.legs) if leg.start <= along or leg.start == 0.0)
        s = along - leg.start
        s = s if leg.direction > 0 else leg.road.length - s
        number = leg.direction * lane
        if leg.direction < 0 and lane > 0 and leg.road.direction(-number) < 0:
            number = -number  # an id of the road rather than of the direction of travel, as in esmini
        return leg.direction * leg.road.lane_centre(number, s)
