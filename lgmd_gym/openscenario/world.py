"""Entities and their bodies, and the world of a scenario: its roads, catalogs, positions and paths."""

from dataclasses import dataclass, field
from math import atan2, pi, remainder

from lgmd_gym.envs.dynamics.script import Bend
from lgmd_gym.errors import check_known, check_whole, unknown_name
from lgmd_gym.openscenario.motion import Place, Timeline, Track
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.parameters import Catalogs
from lgmd_gym.openscenario.roads import Road, RoadNetwork, Route

CONTROL_POINT = "Driver.ControlPoint.Mode"  # property of a controller, Vector DYNA4
SHADE = "lgmd_gym.shade"
"""Property of an entity: the grey level of the actor."""
KIND = "lgmd_gym.kind"
"""Property of an entity: the kind of the actor, where the category does not define it."""
_VEHICLES = {
    "car": "car",
    "van": "car",
    "truck": "car",
    "bus": "car",
    "bicycle": "bicycle",
    "motorbike": "motorcycle",
    "tram": "box",
    "train": "box",
    "trailer": "box",
    "semitrailer": "box",
}
_PEDESTRIANS = {"pedestrian": "pedestrian", "wheelchair": "pedestrian", "animal": "box"}
_FLAT = ("crosswalk", "patch", "roadMark", "parkingSpace")
_OWN = ("ego", "car", "box", "road_marking", "pedestrian", "bicycle", "motorcycle")


@dataclass(frozen=True, slots=True, kw_only=True)
class EntityBody:
    """Size and kind of an entity."""

    kind: str  # kind of actor, see `Actor`
    length: float  # length [m]
    width: float  # width [m]
    height: float  # height [m]
    reference: float  # distance of the centre ahead of the reference point, the rear axle of a vehicle [m]
    wheelbase: float = 0.0  # distance between the axles [m]; 0 without axles
    shade: int | None = None  # grey level; None for a random one


@dataclass(slots=True)
class Mover:
    """An entity in motion."""

    name: str  # name in the scenario
    body: EntityBody
    track: Track | None = None  # path of its reference point from its start; None before it is placed
    start: Place | None = None  # pose of its reference point at the start; None before it is placed
    follows: bool = False  # whether it follows a trajectory or route
    timeline: Timeline = field(default_factory=Timeline)  # its speed; distances count from the start
    backwards: bool = False  # whether it drives backwards along its track
    front_axle: bool = False  # whether the front axle follows trajectories
    leader: "Mover | None" = None  # entity whose speed it copies
    deleted: bool = False  # whether it has been deleted at the start

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
        found = catalogs.resolve(item, "Vehicle", "Pedestrian", "MiscObject")
        mover = Mover(name, _body(found))
        for controller in item.all("ObjectController"):
            mover.front_axle = reads_front_axle(controller, catalogs)
        movers[name] = mover
    return movers


def reads_front_axle(item: Element, catalogs: Catalogs) -> bool:
    """Return whether the `Controller` of an element moves the control point to the front axle."""
    if not item.node.children:
        return False
    controller = catalogs.resolve(item, "Controller")
    front_axle = False
    for name, value in controller.properties().items():
        if name != CONTROL_POINT or value not in ("FrontAxle", "RearAxle"):
            raise controller.error(f"controller property {name}={value!r} is not supported; remove it")
        front_axle = value == "FrontAxle"
    return front_axle


def _body(item: Element) -> EntityBody:
    box = item.child("BoundingBox")
    centre, size = box.child("Center"), box.child("Dimensions")
    if centre.number("y", 0.0) != 0.0:
        raise centre.error("a bounding box beside the centreline is not supported; use y=0")
    properties = item.properties()
    with item.locate_errors():
        kind = check_known(KIND, properties.get(KIND, _kind(item)), _OWN)
        shade = None if SHADE not in properties else check_whole(SHADE, float(properties[SHADE]), 0, 255)
    return EntityBody(
        kind=kind,
        length=size.number("length"),
        width=size.number("width"),
        height=size.number("height"),
        reference=centre.number("x"),
        wheelbase=_wheelbase(item),
        shade=shade,
    )


def _kind(item: Element) -> str:
    if item.tag == "Vehicle":
        return _VEHICLES[item.choice("vehicleCategory", tuple(_VEHICLES))]
    if item.tag == "Pedestrian":
        return _PEDESTRIANS[item.choice("pedestrianCategory", tuple(_PEDESTRIANS))]
    return "road_marking" if item.text("miscObjectCategory") in _FLAT else "box"


def _wheelbase(item: Element) -> float:
    axles = item.find("Axles")
    if axles is None:
        return 0.0
    positions = [axle.number("positionX") for axle in axles.all("FrontAxle", "RearAxle")]
    return max(positions) - min(positions) if len(positions) > 1 else 0.0


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


class ScenarioMap:
    """Roads, catalogs and entities."""

    def __init__(self, network: RoadNetwork, catalogs: Catalogs, movers: dict[str, Mover]) -> None:
        self.network, self.catalogs, self.movers = network, catalogs, movers

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
        _check_upright(orientation)
        if orientation.choice("type", ("absolute", "relative"), "absolute") == "relative":
            return base.turned(orientation.number("h", 0.0))
        return base._replace(heading=orientation.number("h"))

    def _WorldPosition(self, item: Element, time: float) -> Place:
        _check_upright(item)
        return Place(item.number("x"), item.number("y"), item.number("h", 0.0))

    def _LanePosition(self, item: Element, time: float) -> Place:
        road, lane, s = self.road(item), int(item.number("laneId")), item.number("s")
        return _in_lane(road, lane, s, item.number("offset", 0.0))

    def _RoadPosition(self, item: Element, time: float) -> Place:
        return self.road(item).at(item.number("s"), item.number("t"))

    def _RelativeLanePosition(self, item: Element, time: float) -> Place:
        mover = self.mover(item)
        if item.has("dsLane"):
            raise item.error("RelativeLanePosition dsLane is not supported; use ds")
        road, s, t = self.locate(mover.place(time))
        lane = _shifted(road, _lane_at(road, s, t), int(item.number("dLane")))
        return _in_lane(road, lane, s + item.number("ds"), item.number("offset", 0.0))

    def _RelativeRoadPosition(self, item: Element, time: float) -> Place:
        road, s, t = self.locate(self.mover(item).place(time))
        return road.at(s + item.number("ds"), t + item.number("dt"))

    def _RelativeObjectPosition(self, item: Element, time: float) -> Place:
        return self.mover(item).place(time).moved(item.number("dx"), item.number("dy"))

    def _RelativeWorldPosition(self, item: Element, time: float) -> Place:
        place = self.mover(item).place(time)
        return place._replace(x=place.x + item.number("dx"), y=place.y + item.number("dy"))

    def _TrajectoryPosition(self, item: Element, time: float) -> Place:
        track = self.trajectory(item.child("TrajectoryRef"), None)
        return track.at(item.number("s"), item.number("t", 0.0))

    def _RoutePosition(self, item: Element, time: float) -> Place:
        route = self.route(item.child("RouteRef"))
        where = item.child("InRoutePosition").only("FromLaneCoordinates", "FromRoadCoordinates")
        s = where.number("pathS")
        if where.tag == "FromRoadCoordinates":
            return route.at(s, where.number("t"))
        offset = route.lane_centre(int(where.number("laneId")), s)
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
            lane = int(position.number("laneId")) if position.tag == "LanePosition" else None
            position.number("offset", 0.0)
            position.number("t", 0.0)
            stops.append((self.road(position), lane, position.number("s")))
        return self.route_through(item, stops)

    def route_through(self, item: Element, stops: list[tuple[Road, int | None, float]]) -> Route:
        """Return the shortest route through places given as road, lane and distance along the road [m]."""
        if len(stops) < 2:
            raise item.error("a Route needs at least 2 waypoints")
        with item.locate_errors():
            return Route.through(self.network, stops)

    def trajectory(self, parent: Element, current: Place | None) -> Track:
        """Return the trajectory in an element, inline or from a catalog.

        Args:
            parent: Element that contains a Trajectory or a CatalogReference.
            current: Present pose of the entity, at which a trajectory without a start begins.
        """
        item = self.catalogs.resolve(parent, "Trajectory")
        if item.flag("closed"):
            raise item.error("a closed Trajectory is not supported; use closed=false")
        shape = item.child("Shape").only("Polyline", "Clothoid", "ClothoidSpline")
        if shape.tag == "Polyline":
            return self._polyline(shape)
        if shape.tag == "Clothoid":
            length, first = shape.number("length"), shape.number("curvature")
            slope = shape.number("curvatureDot" if shape.has("curvatureDot") else "curvaturePrime")
            bend = Bend(length, first, first + slope * length if slope else None)
            return Track(self.place(shape.child("Position")), (bend,))
        return self._spline(shape, current)

    def _polyline(self, shape: Element) -> Track:
        """Return a straight polyline; bends have to be clothoids, because a body cannot turn on the spot."""
        places = [self.place(vertex.child("Position")) for vertex in shape.all("Vertex")]
        if len(places) < 2:
            raise shape.error("a Polyline needs at least 2 vertices")
        first, last = places[0], places[-1]
        dx, dy = last.x - first.x, last.y - first.y
        length = (dx * dx + dy * dy) ** 0.5
        if length < 1e-6:
            raise shape.error("the first and the last vertex of a Polyline must be apart")
        start = Place(first.x, first.y, atan2(dy, dx))
        before = -1e-9
        for vertex in places[1:]:
            seen = vertex.seen_from(start)
            if abs(seen.y) > 1e-3 or seen.x < before:
                raise shape.error("a Polyline with corners is not supported; use a ClothoidSpline")
            before = seen.x
        return Track(start, (Bend(length),))

    def _spline(self, shape: Element, current: Place | None) -> Track:
        start, bends = current, list[Bend]()
        for number, part in enumerate(shape.all("ClothoidSplineSegment")):
            position = part.find("PositionStart")
            if position is not None and number > 0:
                raise position.error("PositionStart is supported in the first segment only; remove it")
            if position is not None:
                start = self.place(position)
            if part.number("hOffset", 0.0) != 0.0:
                raise part.error("hOffset must be 0: a path has no corners")
            first, last = part.number("curvatureStart"), part.number("curvatureEnd")
            length = part.number("length")
            if length < 0.0:
                raise part.error(f"ClothoidSplineSegment length must be >= 0 m, got {length:g}")
            if length > 0.0:
                bends.append(Bend(length, first, None if first == last else last))
        if start is None:
            raise shape.error("a position on a trajectory without PositionStart is not supported")
        return Track(start, tuple(bends))


def _check_upright(item: Element) -> None:
    for name in ("p", "r"):
        if abs(remainder(item.number(name, 0.0), 2 * pi)) > _UPRIGHT:
            raise item.error(f"{item.tag} {name} must be 0: bodies are upright")


def _beside(item: tuple[Road, float, float], place: Place) -> float:
    """Return the distance of a place from a road, in steps of 1 mm to make equal distances equal [m]."""
    road, s, t = item
    point = road.at(s, t)
    return round(abs(t) + abs(point.x - place.x) + abs(point.y - place.y), 3)


def _in_lane(road: Road, lane: int, s: float, offset: float) -> Place:
    """Return the place in a lane, with the heading of its traffic; the offset is + left of the line."""
    place = road.at(s, road.lane_centre(lane, s) + offset)
    return place if lane == 0 or road.direction(lane) > 0 else place.turned(pi)


def _lane_at(road: Road, s: float, t: float) -> int:
    """Return the lane whose centre is nearest to an offset from the reference line [m]."""
    return min(road.lanes(s), key=lambda lane: abs(road.lane_centre(lane, s) - t))


def _shifted(road: Road, lane: int, change: int) -> int:
    """Return the lane `change` lanes to the left; lane 0 has no width and does not count."""
    other = lane + change
    return (
        other + (1 if change > 0 else -1) if change and (other == 0 or (other > 0) != (lane > 0)) else other
    )
