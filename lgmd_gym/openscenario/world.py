"""Entities and their bodies, and the world of a scenario: its roads, catalogs, positions and paths."""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import cos, hypot, pi, remainder

from lgmd_gym.camera import CLEAR
from lgmd_gym.envs.dynamics.contact import Rectangle, first_touch
from lgmd_gym.errors import unknown_name
from lgmd_gym.openscenario.bodies import EntityBody, Trailer, read_body, read_trailers
from lgmd_gym.openscenario.motion import Place, Timeline, Track
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.parameters import Catalogs
from lgmd_gym.openscenario.roads import Road, RoadNetwork, Route
from lgmd_gym.openscenario.trajectories import Trajectory, read_trajectory
from lgmd_gym.openscenario.ways import Way, follow

CONTROL_POINT = "Driver.ControlPoint.Mode"  # property of a controller, Vector DYNA4
EGOS = ("ego", "hero")  # names of the ego, in any case; without one, the first vehicle that moves


@dataclass(slots=True)
class Mover:
    """An entity in motion."""

    name: str  # name in the scenario
    body: EntityBody
    tag: str = "Vehicle"  # Vehicle, Pedestrian or MiscObject
    track: Track | None = None  # path of its reference point from its start; None before it is placed
    start: Place | None = None  # pose of its reference point at the start; None before it is placed
    follows: bool = False  # whether it follows a trajectory or route
    timeline: Timeline = field(default_factory=Timeline)  # its speed; distances count from the start
    backwards: bool = False  # whether it drives backwards along its track
    front_axle: bool = False  # whether the front axle follows trajectories
    controllers: list[Element] = field(default_factory=list[Element])  # controllers without effect
    leader: "Mover | None" = None  # entity whose speed it copies
    relation: tuple[float, float] = (1.0, 0.0)  # factor of that speed, and addition to it [m/s]
    trailers: tuple[Trailer, ...] = ()  # its trailers, in their order
    deleted: bool = False  # whether it has been deleted at the start
    way: Way | None = None  # the lanes along which its path leads; None without any
    chosen: bool = False  # whether its way is one of several
    legs: tuple[tuple[Road, int], ...] = ()  # roads and directions of its route; empty without one
    turns: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    """Start and end of its lateral actions [s]."""
    # plans the path of the present lateral action again and returns its end; None without one
    replan: Callable[[], float] | None = None
    replan_until: float = 0.0  # end of the present lateral action [s]

    @property
    def path(self) -> Track:
        """Path of the reference point; ValueError for an entity without a position."""
        if self.track is None:
            raise ValueError(f"entity {self.name!r} has no position; add a TeleportAction to Init")
        return self.track

    def place(self, time: float = 0.0) -> Place:
        """Return the pose of the reference point at a time [s]."""
        place = self.path.at(self.timeline.at(time).distance)
        return place.turned(pi) if self.backwards else place

    def signed_speed(self, time: float) -> float:
        """Return the speed in the direction of the body at a time [s], negative backwards [m/s]."""
        speed = self.timeline.at(time).speed
        return -speed if self.backwards else speed

    @property
    def front(self) -> float:
        """Distance from the reference point to the front [m]."""
        return self.body.reference + self.body.length / 2

    @property
    def rear(self) -> float:
        """Distance from the reference point to the rear, + backwards [m]."""
        return self.body.length / 2 - self.body.reference


def read_entities(scenario: Element, catalogs: Catalogs) -> dict[str, Mover]:
    """Return the entities of a scenario by name."""
    movers: dict[str, Mover] = {}
    for item in scenario.child("Entities").all("ScenarioObject"):
        name = item.text("name")
        if name in movers:
            raise item.error(f"ScenarioObject name {name!r} is used twice; choose another")
        found = catalogs.resolve(item, "Vehicle", "Pedestrian", "MiscObject")
        mover = Mover(name, read_body(found), found.tag, trailers=read_trailers(found, catalogs))
        for controllers in item.all("ObjectController"):
            read_controllers(controllers, mover, catalogs)
        movers[name] = mover
    return movers


def read_controllers(item: Element, mover: Mover, catalogs: Catalogs) -> None:
    """Set the control point of an entity; other properties of its controllers have no effect.

    Args:
        item: Element that contains controllers or references to catalogs.
        mover: The entity.
        catalogs: The catalogs.
    """
    for child in item.all("ObjectController"):
        read_controllers(child, mover, catalogs)
    for child in item.all("Controller", "CatalogReference"):
        node = catalogs.node(child) if child.tag == "CatalogReference" else child.node
        child.skip()
        if node is None:
            mover.controllers.append(child)
            continue
        controller = Element(node, child.scope)
        controller.skip()
        block = controller.find("Properties")
        properties = [] if block is None else [property.node for property in block.all("Property")]
        values = {entry.attributes.get("name"): entry.attributes.get("value") for entry in properties}
        mode = values.pop(CONTROL_POINT, None)
        if mode not in (None, "FrontAxle", "RearAxle"):
            raise controller.error(f"{CONTROL_POINT} must be FrontAxle or RearAxle, got {mode!r}")
        mover.front_axle = mode == "FrontAxle"
        if values or mode is None:
            mover.controllers.append(child)


def carry_over(world: "ScenarioMap", mover: Mover, time: float) -> None:
    """Carry a change of speed over to a lateral action, and to the entities that copy the speed."""
    if mover.replan is not None and time < mover.replan_until:
        mover.replan_until = mover.replan()
    for other in world.movers.values():
        if other.leader is mover:
            other.timeline.copy_from(time, mover.timeline, other.relation)
            carry_over(world, other, time)


def pose_of(mover: Mover, time: float) -> tuple[Place, float, float]:
    """Return the pose of a body's centre in its direction of travel, its reference, and its speed."""
    motion = mover.timeline.at(time)
    reference = -mover.body.reference if mover.backwards else mover.body.reference
    return mover.path.at(motion.distance).moved(reference), reference, motion.speed


def touching(one: Mover, other: Mover, time: float) -> bool:
    """Return whether two bodies touch at a time [s]."""
    a, b = pose_of(one, time)[0], pose_of(other, time)[0]
    reach = hypot(one.body.length, one.body.width) + hypot(other.body.length, other.body.width)
    if 4.0 * ((a.x - b.x) ** 2 + (a.y - b.y) ** 2) > reach**2 + 1.0:
        return False
    first = Rectangle(a.x, a.y, a.heading, one.body.length, one.body.width)
    second = Rectangle(b.x, b.y, b.heading, other.body.length, other.body.width)
    return first_touch(first, second, 0.0, 0.0) == 0.0


_BEYOND = 1.0  # [m] from the end of a road
_UPRIGHT = 1e-6  # [rad] or [m]
POSITIONS = (
    "LanePosition",
    "RoadPosition",
    "WorldPosition",
    "RelativeLanePosition",
    "RelativeRoadPosition",
    "RelativeObjectPosition",
    "RelativeWorldPosition",
    "TrajectoryPosition",
    "RoutePosition",
)


def signal_key(name: str) -> str:
    """Return the name of the state of a traffic signal among the values of a scenario."""
    return f"signal {name}"  # a parameter has no space in its name


class ScenarioMap:
    """Roads, catalogs and entities.

    Attributes:
        notes: What has no effect or deviates from the file, with file and line.
        weather: Name of the weather at the start.
        watched: Names of the parameters, variables and states of signals in conditions.
        values: Values given to them by actions, with their times [s].
        ego: The entity with the name "ego" or "hero", in any case; None without one.
    """

    def __init__(self, network: RoadNetwork, catalogs: Catalogs, movers: dict[str, Mover]) -> None:
        self.network, self.catalogs, self.movers = network, catalogs, movers
        self.notes = list[str]()
        self.weather = CLEAR
        self.watched = frozenset[str]()
        self.values: dict[str, list[tuple[float, str]]] = {}
        self.ego = next((mover for name, mover in movers.items() if name.lower() in EGOS), None)

    def mover(self, item: Element, attribute: str = "entityRef") -> Mover:
        """Return the entity that an attribute names."""
        name = item.text(attribute)
        if name not in self.movers:
            raise item.error(str(unknown_name("entity", name, self.movers)))
        return self.movers[name]

    def road(self, item: Element) -> Road:
        """Return the road that `roadId` names."""
        with item.locate_errors():
            return self.network.road(item.text("roadId"))

    def locate(self, place: Place) -> tuple[Road, float, float]:
        """Return the road nearest to a place, and distance along and offset from it [m].

        Roads outside of junctions come first.
        """
        found = [(road, *road.nearest(place)) for road in self.network.roads.values()]
        return min(found, key=lambda item: (_beside(item, place), item[0].junction != "-1", item[0].name))

    def place(self, parent: Element, time: float = 0.0) -> Place:
        """Return the place of the position in an element.

        Args:
            parent: Element that contains a position.
            time: Time of the entities that the position is relative to [s].
        """
        item = parent.only(*POSITIONS)
        with item.locate_errors():
            base = getattr(self, f"_{item.tag}")(item, time)
        orientation = item.find("Orientation")
        if orientation is None:
            return base
        _note_tilt(orientation, self)
        if orientation.choice("type", ("absolute", "relative"), "absolute") == "relative":
            return base.turned(orientation.number("h", 0.0))
        return base._replace(heading=orientation.number("h"))

    def _WorldPosition(self, item: Element, time: float) -> Place:
        _note_tilt(item, self)
        return Place(item.number("x"), item.number("y"), item.number("h", 0.0))

    def _LanePosition(self, item: Element, time: float) -> Place:
        road, lane = self.road(item), item.whole("laneId")
        return _in_lane(road, lane, self._along(item, road), item.number("offset", 0.0))

    def _RoadPosition(self, item: Element, time: float) -> Place:
        road = self.road(item)
        return road.at(self._along(item, road), item.number("t"))

    def _along(self, item: Element, road: Road) -> float:
        """Return the distance of a position along its road [m]."""
        s = item.number("s")
        if not -_BEYOND <= s <= road.length + _BEYOND:
            self.note(
                item, f"{item.tag} s={s:g} m is beyond road {road.name}, which is {road.length:g} m long"
            )
        return s

    def _RelativeLanePosition(self, item: Element, time: float) -> Place:
        mover = self.mover(item)
        road, s, t = self.road_of(mover, mover.place(time))
        lane = shifted(road, lane_at(road, s, t), item.whole("dLane"))
        if item.has("dsLane"):
            return self._along_lane(road, lane, s, item.number("dsLane"), item.number("offset", 0.0))
        return _in_lane(road, lane, s + item.number("ds"), item.number("offset", 0.0))

    def _along_lane(self, road: Road, lane: int, s: float, distance: float, offset: float) -> Place:
        """Return the place at a distance along a lane, in the direction of the reference line [m]."""
        direction = road.direction(lane) if lane else 1
        way, _ = follow(self.network, road, 1 if distance >= 0.0 else -1, s, lane)
        if not way.spans:
            raise ValueError(f"road {road.name} ends at {s:.4g} m")
        side = way.spans[0].direction
        track = Track(
            way.spans[0].place(0.0, side * offset),
            way.bends(0.0, side * offset, way.spans[0].place(0.0, side * offset)),
        )
        place = track.at(abs(distance))
        return place if side == direction else place.turned(pi)

    def _RelativeRoadPosition(self, item: Element, time: float) -> Place:
        mover = self.mover(item)
        road, s, t = self.road_of(mover, mover.place(time))
        return road.at(s + item.number("ds"), t + item.number("dt"))

    def _RelativeObjectPosition(self, item: Element, time: float) -> Place:
        return self.mover(item).place(time).moved(item.number("dx"), item.number("dy"))

    def _RelativeWorldPosition(self, item: Element, time: float) -> Place:
        place = self.mover(item).place(time)
        return place._replace(x=place.x + item.number("dx"), y=place.y + item.number("dy"))

    def _TrajectoryPosition(self, item: Element, time: float) -> Place:
        track = self.trajectory(item.child("TrajectoryRef"), None).track
        return track.at(item.number("s"), item.number("t", 0.0))

    def _RoutePosition(self, item: Element, time: float) -> Place:
        route = self.route(item.child("RouteRef"))
        where = item.child("InRoutePosition").only("FromLaneCoordinates", "FromRoadCoordinates")
        s = where.number("pathS")
        if where.tag == "FromRoadCoordinates":
            return route.at(s, where.number("t"))
        offset = route.lane_centre(where.whole("laneId"), s)
        return route.at(s, offset + where.number("laneOffset", 0.0))

    def route(self, parent: Element) -> Route:
        """Return the route in an element, inline or from a catalog."""
        item = self.catalogs.resolve(parent, "Route")
        if item.flag("closed"):
            raise item.error("a closed Route is not supported; use closed=false")
        stops: list[tuple[Road, int | None, float]] = []
        for waypoint in item.all("Waypoint"):
            waypoint.choice("routeStrategy", ("shortest", "fastest", "leastIntersections", "random"))
            position = waypoint.child("Position").only("LanePosition", "RoadPosition")
            lane = position.whole("laneId") if position.tag == "LanePosition" else None
            position.number("offset", 0.0)
            position.number("t", 0.0)
            turned = position.find("Orientation")
            if turned is not None and (
                turned.choice("type", ("absolute", "relative"), "absolute") == "absolute"
                or turned.number("h", 0.0) != 0.0
            ):
                raise turned.error("the Orientation of a Waypoint is not supported; remove it")
            stops.append((self.road(position), lane, position.number("s")))
        return self.route_through(item, stops)

    def route_through(self, item: Element, stops: list[tuple[Road, int | None, float]]) -> Route:
        """Return the shortest route through places given as road, lane and distance along the road [m]."""
        if len(stops) < 2:
            raise item.error("a Route needs at least 2 waypoints")
        with item.locate_errors():
            return Route.through(self.network, stops)

    def trajectory(self, parent: Element, current: Place | None, time: float = 0.0) -> Trajectory:
        """Return the trajectory in an element, inline or from a catalog.

        Args:
            parent: Element that contains a Trajectory or a CatalogReference.
            current: Present pose of the entity, at which a trajectory without a start begins.
            time: Time of the entities that positions are relative to [s].
        """
        item = self.catalogs.resolve(parent, "Trajectory")
        return read_trajectory(item, lambda position: self.place(position, time), current)

    def note(self, item: Element, text: str) -> None:
        """Add a note with file and line on what has no effect or deviates from the file."""
        note = str(item.error(text))
        if note not in self.notes:
            self.notes.append(note)

    def value_of(self, item: Element, name: str, time: float) -> str:
        """Return the value of a parameter or variable at a time [s]."""
        given = [value for when, value in self.values.get(name, []) if when <= time]
        return given[-1] if given else item.resolve(f"${name}")

    def inside(self, road: Road, s: float, t: float) -> bool:
        """Return whether a place is on the lanes of a road; distance along and offset from it [m]."""
        edges = [road.lane_centre(lane, s) + side * road.width(lane, s) / 2 for lane in road.lanes(s) if lane
                 for side in (-1, 1)]  # fmt: skip
        return bool(edges) and 0.0 < s < road.length and min(edges) <= t <= max(edges)

    def road_of(self, mover: Mover, place: Place) -> tuple[Road, float, float]:
        """Return the road of a place on an entity's way, and distance along and offset from it [m]."""
        if mover.way is None:
            return self.locate(place)
        roads = {span.road.name: span.road for span in mover.way.spans}
        found = [(road, *road.nearest(place)) for road in roads.values()]
        return min(found, key=lambda item: _beside(item, place))

    def settle(self, mover: Mover) -> None:
        """Set the path of an entity that follows no trajectory: along its lane, or straight on."""
        start = mover.start
        if mover.follows or start is None:
            return
        ahead = start.turned(pi) if mover.backwards else start
        mover.track, mover.way, mover.replan = Track(ahead), None, None
        if not self.network.roads:
            return
        road, s, t = self.locate(start)
        along = cos(ahead.heading - road.at(s).heading)
        if abs(abs(along) - 1.0) < 1e-9 and 0.0 < s < road.length:
            direction = 1 if along > 0.0 else -1
            begin = road.at(0.0, t) if direction > 0 else road.at(road.length, t).turned(pi)
            way, chosen = follow(self.network, road, direction, s, lane_at(road, s, t))
            mover.way, mover.chosen = way, chosen
            if len(way.spans) == 1 and way.spans[0].constant:
                whole = Track(begin, road.bends(direction, t))
                mover.track = Track(ahead, whole.part(whole.nearest(start)).bends)
            else:
                left = ahead.seen_from(way.spans[0].line(0.0)).y - way.spans[0].centre(0.0)
                mover.track = Track(ahead, way.bends(0.0, left, ahead))


def _note_tilt(item: Element, world: ScenarioMap) -> None:
    for name in ("p", "r"):
        if abs(remainder(item.number(name, 0.0), 2 * pi)) > _UPRIGHT:
            world.note(item, f"{item.tag} {name} has no effect: bodies are upright")


def _beside(item: tuple[Road, float, float], place: Place) -> float:
    """Return the distance of a place from a road, in steps of 1 mm to make equal distances equal [m]."""
    road, s, t = item
    point = road.at(s, t)
    return round(abs(t) + abs(point.x - place.x) + abs(point.y - place.y), 3)


def _in_lane(road: Road, lane: int, s: float, offset: float) -> Place:
    """Return the place in a lane, with the heading of its traffic; the offset is + left of the line."""
    place = road.at(s, road.lane_centre(lane, s) + offset)
    return place if lane == 0 or road.direction(lane) > 0 else place.turned(pi)


def lane_at(road: Road, s: float, t: float) -> int:
    """Return the lane whose centre is nearest to an offset from the reference line [m]."""
    return min(road.lanes(s), key=lambda lane: abs(road.lane_centre(lane, s) - t))


def shifted(road: Road, lane: int, change: int) -> int:
    """Return the lane `change` lanes to the left; lane 0 has no width and does not count."""
    other = lane + change
    return (
        other + (1 if change > 0 else -1) if change and (other == 0 or (other > 0) != (lane > 0)) else other
    )
