"""Compilation of a scenario to time scripts: our actors follow paths and segments of speed.

Triggers and synchronisations are solved for the ego's undisturbed motion, as on a test track: an ego that
brakes does not change the motion of the others. The episode begins `START_TTC` before the first contact, or
1 s before the first change of speed of an entity if that is earlier: a longer wait at the start is cut, and a
shorter one is extended at constant speeds.

An ego that drives backwards is compiled to one that drives forwards with its leading end: the camera looks in
the direction of travel, and the body is turned by 180 degrees.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, cos, hypot, inf, pi, remainder, sin

from lgmd_gym.envs.dynamics.script import Bend, Segment
from lgmd_gym.envs.families.scenario import AFTERMATH, START_TTC, Actor, RoadPlan, Scenario
from lgmd_gym.openscenario.conditions import SET_BY_ACTIONS
from lgmd_gym.openscenario.motion import Place, Track, first_true
from lgmd_gym.openscenario.nodes import Element, Node, check_used
from lgmd_gym.openscenario.parameters import Catalogs
from lgmd_gym.openscenario.roads import Road, RoadNetwork, read_roads
from lgmd_gym.openscenario.storyboard import read_story, run_init
from lgmd_gym.openscenario.trailers import pulled_by
from lgmd_gym.openscenario.ways import follow
from lgmd_gym.openscenario.world import (
    Mover,
    ScenarioMap,
    lane_at,
    pose_of,
    read_entities,
    signal_key,
    touching,
)

_WIDEST = 6.0  # [m], width of a lane; wider ones are open test areas
_REACH = (-50.0, 500.0)  # [m] ahead of the ego within which a crossing road counts


def road_plan(world: ScenarioMap, ego: Place, ahead: float = _REACH[1]) -> RoadPlan:
    """Return the road plan around the ego.

    A perpendicular road ahead makes a crossing, bends of the ego's lane a curve. A straight road with lanes
    of at most 6 m has these lanes; wider ones are a test area, for which the default plan is used.

    Args:
        world: The roads.
        ego: Initial pose of the ego's centre, in its direction of travel.
        ahead: Distance ahead of the ego up to which a curve is drawn [m].
    """
    if not world.network.roads:
        return RoadPlan()
    road, s, t = world.locate(ego)
    roads = world.network.roads.values()
    distances = [_crossing(other, ego) for other in roads if other.junction == "-1"]
    found = [item for item in distances if item is not None and _REACH[0] < item < _REACH[1]]
    if found:
        return RoadPlan(kind="crossing", distance=found[0])
    direction = 1 if cos(ego.heading - road.at(s).heading) > 0.0 else -1
    bends = road.bends(direction, 0.0)
    way, _ = follow(world.network, road, direction, s, lane_at(road, s, t))
    if len(way.spans) == 1 and all(bend.curvature == bend.last_curvature for bend in bends):
        curve = _curve(_lane_bends(road, direction, t, ego)) if any(b.curvature for b in bends) else None
    else:
        left = direction * t - way.spans[0].centre(0.0) if way.spans else 0.0
        begin = ego._replace(heading=way.spans[0].line(0.0).heading) if way.spans else ego
        whole = Track(begin, way.bends(0.0, left, begin) if way.spans else ())
        curve = _curve([arc for bend in whole.part(0.0, ahead).bends for arc in _arcs(bend)])
    return curve or _straight(road, direction, s, t)


def _crossing(road: Road, ego: Place) -> float | None:
    """Return the distance at which the straight line of a road crosses the ego's axis, or None [m]."""
    line = road.line.start.seen_from(ego)
    if abs(cos(line.heading)) > 0.1 or road.line.part(0.0, road.length).bends:
        return None
    return line.x - line.y * cos(line.heading) / sin(line.heading)


def _lane_bends(road: Road, direction: int, t: float, ego: Place) -> list[Bend]:
    """Return the bends of the ego's road ahead of it."""
    begin = road.at(0.0, t) if direction > 0 else road.at(road.length, t).turned(pi)
    lane = Track(begin, road.bends(direction, t))
    return list(lane.part(lane.nearest(ego)).bends)


def _arcs(bend: Bend) -> list[Bend]:
    """Return a bend as arcs of at most 5 m; a clothoid deviates from them by millimetres."""
    if bend.curvature == bend.last_curvature:
        return [Bend(bend.length, bend.curvature)]
    count = ceil(bend.length / 5.0)
    slope = (bend.last_curvature - bend.curvature) / count
    return [Bend(bend.length / count, bend.curvature + slope * (number + 0.5)) for number in range(count)]


def _curve(bends: list[Bend]) -> RoadPlan | None:
    """Return the arcs ahead of the ego, or None if there are none."""
    distance = 0.0
    while bends and bends[0].curvature == 0.0:
        distance += bends.pop(0).length
    return RoadPlan(kind="curve", distance=distance, bends=tuple(bends)) if bends else None


def _straight(road: Road, direction: int, s: float, t: float) -> RoadPlan:
    lanes = road.lanes(s)
    driving = {
        number: road.lane_centre(number, s) for number, lane in lanes.items() if lane.kind == "driving"
    }
    own = sorted(
        (n for n in driving if road.direction(n) == direction), key=lambda n: -direction * driving[n]
    )
    if not own or any(road.width(number, s) > _WIDEST for number in own):
        return RoadPlan()
    index = min(range(len(own)), key=lambda i: abs(driving[own[i]] - t))
    if len(own) == 1 and len(driving) > 1:
        return RoadPlan(kind="two-way")
    return RoadPlan(lanes=len(own), ego_lane=index)


_DRIVEN = ("car", "box", "motorcycle", "bicycle")  # kinds of bodies that may be the ego
LEAD_IN = 1.0  # [s] at constant speeds before the first change of speed
HORIZON = 120.0  # [s] within which a contact is searched for
DURATION = "lgmd_gym.duration"
"""Property of the file: duration of the episode [s]; the episode then begins at the file's start."""
_TAGS = (
    "FileHeader VariableDeclarations MonitorDeclarations StopTrigger Performance SceneGraphFile UsedArea "
    "TrafficSignals TimeOfDay DomeImage Wind AdditionalAxle License TrailerHitch TrailerCoupler "
    "File CustomContent"
)
IGNORED_TAGS = frozenset(_TAGS.split())
"""Elements without an effect on us, with all that they contain."""
_ATTRIBUTES = (
    "name z dz mass model model3d role h p r Weather.fractionalCloudCover Weather.cloudState Sun.elevation "
    "Sun.azimuth Weather.atmosphericPressure Weather.temperature "
    "FrontAxle.maxSteering FrontAxle.wheelDiameter FrontAxle.trackWidth FrontAxle.positionZ "
    "RearAxle.maxSteering RearAxle.wheelDiameter RearAxle.trackWidth RearAxle.positionZ "
    "Vehicle.vehicleCategory Pedestrian.pedestrianCategory MiscObject.miscObjectCategory "
    "Sun.intensity Precipitation.precipitationIntensity Precipitation.intensity Controller.controllerType"
)
IGNORED_ATTRIBUTES = frozenset(_ATTRIBUTES.split())
"""Attributes without an effect on us."""


@dataclass(frozen=True)
class Compiled:
    """A concrete scenario."""

    scenario: Scenario
    weather: str  # name of the weather
    start: float  # time in the file at which the episode begins [s]
    contact: float  # time in the file of the ego's first contact if it does not brake [s]; inf without one
    ego: Mover
    # the entity that the ego touches first, or the one it comes nearest to; None without one
    target: Mover | None
    world: ScenarioMap  # the world, for positions
    root: Element  # root element with the values of the parameters
    properties: dict[str, str]  # properties of the file
    # what has no effect although it is supported, with file and line
    notes: tuple[str, ...] = ()


def compile_scenario(root: Element, family: str) -> Compiled:
    """Return a concrete scenario."""
    with root.locate_errors():
        return _compile_board(root, family)


def _compile_board(root: Element, family: str) -> Compiled:
    catalogs = Catalogs(root)
    movers = read_entities(root, catalogs)
    network, note = _network(root)
    world = ScenarioMap(network, catalogs, movers)
    world.notes += [*catalogs.notes, *filter(None, [note])]
    board = root.child("Storyboard")
    world.watched = frozenset(_watched(board.node))
    _check_signals(root.child("RoadNetwork").node, world.watched)
    run_init(board, world)
    notes = read_story(board, world).play(world)
    for node in (root.node, *catalogs.visited):
        check_used(node, IGNORED_TAGS, IGNORED_ATTRIBUTES)
    _note_routes(root, world)
    ego = _ego(root, world)
    for trailer in ego.trailers[:1]:
        world.note(trailer.item, f"the trailer of the ego {ego.name!r} is left out: it is behind the camera")
    compiled = _compile(root, world, ego, family)
    return replace(compiled, notes=(*world.notes, *notes))


def _network(root: Element) -> tuple[RoadNetwork, str]:
    """Return the road network, without a `LogicFile` one without roads, and a note on its path or ""."""
    network = root.child("RoadNetwork").find("LogicFile")
    if network is None or not network.text("filepath"):
        return RoadNetwork({}), ""
    path, note = network.path_nearby("filepath")
    if not path.suffix and not path.exists():
        path = path.with_name(f"{path.name}.xodr")
        if not path.exists():
            raise network.error(
                f"the map {network.text('filepath')!r} is not there; put {path.name} into the folder of "
                "the file"
            )
    with network.locate_errors():
        return read_roads(path), note


def _watched(node: Node) -> Iterator[str]:
    """Yield the names of the values that actions set in the start conditions of a node."""
    if node.tag == "StopTrigger":
        return
    if node.tag in SET_BY_ACTIONS:
        name = node.attributes.get(SET_BY_ACTIONS[node.tag], "").removeprefix("$")
        yield signal_key(name) if node.tag == "TrafficSignalCondition" else name
    for child in node.children:
        yield from _watched(child)


def _check_signals(node: Node, watched: frozenset[str]) -> None:
    """Raise ValueError if a condition refers to a signal that changes by the phases of a controller."""
    name = node.attributes.get("trafficSignalId", "")
    if signal_key(name) in watched:
        raise node.error(
            f"signal {name!r} of a TrafficSignalController in a TrafficSignalCondition is not supported; "
            "use TrafficSignalStateAction"
        )
    for child in node.children:
        _check_signals(child, watched)


def _note_routes(root: Element, world: ScenarioMap) -> None:
    """Note controllers, which have no effect, and entities without a position or route."""
    for mover in world.movers.values():
        if mover.track is None and not mover.deleted:
            world.note(root.child("Entities"), f"{mover.name!r} has no position and is left out")
        for item in mover.controllers[:1]:
            world.note(
                item, f"the controller of {mover.name!r} has no effect; it moves as the storyboard says"
            )
        if mover.chosen and (mover.timeline.segments or mover.timeline.initial_speed > 0.0):
            world.note(
                root.child("Entities"),
                f"{mover.name!r} takes the straightest way at junctions, because it has no route",
            )


def _ego(root: Element, world: ScenarioMap) -> Mover:
    """Return the ego: that of the map by its name, else the first vehicle that moves."""
    moving = [
        mover
        for mover in world.movers.values()
        if mover.body.kind in _DRIVEN and (mover.timeline.segments or mover.timeline.initial_speed > 0.0)
    ]
    entities = root.child("Entities")
    if world.ego is not None:
        if world.ego not in moving:
            raise entities.error(f"the ego {world.ego.name!r} never moves; give it a SpeedAction")
        return world.ego
    if not moving:
        raise entities.error("the scenario needs a vehicle that moves, as the ego; name it Ego")
    world.note(entities, f"no entity has the name Ego; the ego is {moving[0].name!r}")
    return moving[0]


def _compile(root: Element, world: ScenarioMap, ego: Mover, family: str) -> Compiled:
    others = [item for item in world.movers.values() if item is not ego and not item.deleted and item.track]
    trailers = [trailer for item in others for trailer in pulled_by(item)]
    others += [trailer.mover for trailer in trailers]
    contact, target = _first_contact(ego, [item for item in others if item.body.kind != "road_marking"])
    header = root.find("FileHeader")
    properties = {} if header is None else header.properties()
    duration = float(properties[DURATION]) if DURATION in properties else None
    start = 0.0 if duration is not None else _start(contact, [ego, *others])
    if duration is None:
        others.sort(key=lambda item: item is not target)
        changes = [item.start for mover in (ego, *others) for item in mover.timeline.segments]
        changes += [end for mover in (ego, *others) for _, end in mover.turns if end < inf]
        end = contact if contact < inf else max(changes, default=0.0) + START_TTC
        duration = end - start + AFTERMATH
    for trailer in trailers:
        trailer.check(start + duration, world)
    length = ego.body.length
    base, _, _ = pose_of(ego, start)
    scenario = Scenario(
        family=family,
        ego_speed=ego.timeline.at(start).speed,
        duration=duration,
        actors=tuple(_actor(item, base, length, start) for item in others),
        ego_profile=_profile(ego, start),
        ego_path=_bends(ego, start),
        road=road_plan(world, base, _driven(ego, start, duration) + _REACH[1] / 2),
        ego_length=length,
        ego_width=ego.body.width,
        ego_reference=pose_of(ego, start)[1] if _bends(ego, start) else 0.0,
    )
    return Compiled(scenario, world.weather, start, contact, ego, target, world, root, properties)


def _start(contact: float, movers: list[Mover]) -> float:
    changes = [item.timeline.segments[0].start for item in movers if item.timeline.segments]
    changes += [start for mover in movers for start, _ in mover.turns]
    first = min(changes, default=inf) - LEAD_IN
    start = min(contact - START_TTC, first)
    return start if start < inf else 0.0


def _driven(mover: Mover, start: float, duration: float) -> float:
    """Return the distance that an entity drives in an episode [m]."""
    return mover.timeline.at(start + duration).distance - mover.timeline.at(start).distance


def _bends(mover: Mover, time: float) -> tuple[Bend, ...]:
    """Return the bends of a body's path from a time on; none for a body that never moves."""
    moves = mover.timeline.segments or mover.timeline.initial_speed > 0.0
    return mover.path.part(mover.timeline.at(time).distance).bends if moves else ()


def _profile(mover: Mover, start: float) -> tuple[Segment, ...]:
    return tuple(replace(item, start=max(item.start - start, 0.0)) for item in mover.timeline.segments)


def _actor(mover: Mover, ego: Place, ego_length: float, start: float) -> Actor:
    place, reference, speed = pose_of(mover, start)
    seen, bends, body = place.seen_from(ego), _bends(mover, start), mover.body
    heading = remainder(seen.heading, 2.0 * pi)
    return Actor(
        gap=seen.x - ego_length / 2 - body.length / 2,
        lateral_offset=0.0 if abs(seen.y) < 1e-12 else seen.y,
        heading=0.0 if abs(heading) < 1e-12 else heading,
        speed=speed,
        profile=_profile(mover, start),
        path=bends,
        kind=body.kind,
        shade=body.shade,
        length=body.length,
        width=body.width,
        height=body.height,
        reference=reference if bends else 0.0,
    )


def _first_contact(ego: Mover, others: list[Mover]) -> tuple[float, Mover | None]:
    """Return the time of the first contact, inf for none, and the body touched or else the nearest one."""
    found, target, nearest = inf, None, inf
    for other in others:
        time, distance = _contact(ego, other, min(found, HORIZON))
        if time < found:
            found, target, nearest = time, other, 0.0
        elif distance < nearest:
            target, nearest = other, distance
    return found, target


def _contact(one: Mover, other: Mover, horizon: float) -> tuple[float, float]:
    """Return the time of the first contact before a horizon, inf for none, and the least distance [m]."""
    reach = (hypot(one.body.length, one.body.width) + hypot(other.body.length, other.body.width)) / 2
    fastest = max(_top_speed(one) + _top_speed(other), 0.1)
    time, least = 0.0, inf
    while time < horizon:
        a, b = pose_of(one, time)[0], pose_of(other, time)[0]
        apart = hypot(a.x - b.x, a.y - b.y)
        least = min(least, apart)
        if apart <= reach and touching(one, other, time):
            return first_true(partial(touching, one, other), max(time - 0.02, 0.0), time), 0.0
        free = (apart - reach) / fastest if apart > reach else _gap(one, other, a, b) / (2.0 * fastest)
        time += max(free, 0.005)
    return inf, least


def _gap(one: Mover, other: Mover, a: Place, b: Place) -> float:
    """Return a lower bound of the distance of two bodies in the axes of the first one [m]."""
    seen = b.seen_from(a)
    c, s = abs(cos(seen.heading)), abs(sin(seen.heading))
    length, width = other.body.length, other.body.width
    along = abs(seen.x) - (one.body.length + c * length + s * width) / 2
    return max(along, abs(seen.y) - (one.body.width + s * length + c * width) / 2)


def _top_speed(mover: Mover) -> float:
    return max(mover.timeline.initial_speed, *(item.final_speed for item in mover.timeline.segments), 0.0)
