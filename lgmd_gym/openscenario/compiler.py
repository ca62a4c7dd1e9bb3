"""Compilation of a scenario to time scripts: our actors follow paths and segments of speed.

Triggers and synchronisations are solved for the ego's undisturbed motion, as on a test track: an ego that
brakes does not change the motion of the others. The episode begins `START_TTC` before the first contact, or
1 s before the first change of speed of an entity if that is earlier: a longer wait at the start is cut, and a
shorter one is extended at constant speeds.

An ego that drives backwards is compiled to one that drives forwards with its leading end: the camera looks in
the direction of travel, and the body is turned by 180 degrees.
"""

from dataclasses import dataclass, replace
from functools import partial
from math import cos, hypot, inf, pi, remainder, sin

from lgmd_gym.camera import CLEAR
from lgmd_gym.envs.dynamics.contact import Rectangle, first_touch
from lgmd_gym.envs.dynamics.script import Bend, Segment
from lgmd_gym.envs.families.scenario import AFTERMATH, START_TTC, Actor, RoadPlan, Scenario
from lgmd_gym.openscenario.motion import Place, Track, first_true
from lgmd_gym.openscenario.nodes import Element, check_used
from lgmd_gym.openscenario.parameters import Catalogs
from lgmd_gym.openscenario.roads import Road, RoadNetwork, read_roads
from lgmd_gym.openscenario.storyboard import read_story, run_init
from lgmd_gym.openscenario.world import Mover, ScenarioMap, read_entities

NIGHT_LUX = 50.0
"""Illuminance of the sun below which it is night; twilight of a street is about 10 lx, a dull day 1000 lx."""
FOG = 1000.0  # [m], visual range below which the weather is fog, as in meteorology
_WIDEST = 6.0  # [m], width of a lane; wider ones are open test areas
_REACH = (-50.0, 500.0)  # [m] ahead of the ego within which a crossing road counts


def weather_of(environment: Element | None) -> str:
    """Return the weather of an `Environment`: clear, night, fog or rain.

    Night is a sun below 50 lx, fog a visual range below 1000 m, rain a precipitation with an intensity.
    """
    if environment is None:
        return CLEAR
    found = set[str]()
    road = environment.find("RoadCondition")
    if road is not None and road.number("frictionScaleFactor") != 1.0:
        raise road.error("frictionScaleFactor must be 1: the brake belongs to the world")
    weather = environment.find("Weather")
    if weather is None:
        return CLEAR
    sun, fog, rain = (weather.find(tag) for tag in ("Sun", "Fog", "Precipitation"))
    if sun is not None and _illuminance(sun) < NIGHT_LUX:
        found.add("night")
    if fog is not None and fog.number("visualRange") < FOG:
        found.add("fog")
    if rain is not None and rain.choice("precipitationType", ("dry", "rain")) == "rain":
        intensity = "precipitationIntensity" if rain.has("precipitationIntensity") else "intensity"
        found |= {"rain"} if rain.number(intensity) > 0.0 else set()
    if len(found) > 1:
        raise weather.error(f"the weathers {', '.join(sorted(found))} cannot be combined; use one")
    return found.pop() if found else CLEAR


def _illuminance(sun: Element) -> float:
    """Return the illuminance of the sun [lx]; `intensity` is its name in OpenSCENARIO 1.1."""
    for name in ("illuminance", "intensity"):
        if sun.has(name):
            return sun.number(name)
    raise sun.error("Sun needs the attribute 'illuminance'")


def road_plan(network: RoadNetwork, ego: Place, located: tuple[Road, float, float]) -> RoadPlan:
    """Return the road plan around the ego.

    A perpendicular road ahead makes a crossing, arcs of the ego's road a curve. A straight road with lanes of
    at most 6 m has these lanes; wider ones are a test area, for which the default plan is used.

    Args:
        network: The roads.
        ego: Initial pose of the ego's centre, in its direction of travel.
        located: The ego's road, distance along it and offset from it [m].
    """
    road, s, t = located
    distances = [_crossing(other, ego) for other in network.roads.values() if other.junction == "-1"]
    ahead = [item for item in distances if item is not None and _REACH[0] < item < _REACH[1]]
    if ahead:
        return RoadPlan(kind="crossing", distance=ahead[0])
    direction = 1 if cos(ego.heading - road.at(s).heading) > 0.0 else -1
    bends = road.bends(direction, 0.0)
    curved = any(bend.curvature or bend.last_curvature for bend in bends)
    curve = _curve(road, direction, t, ego) if curved else None
    return curve or _straight(road, direction, s, t)


def _crossing(road: Road, ego: Place) -> float | None:
    """Return the distance at which the straight line of a road crosses the ego's axis, or None [m]."""
    line = road.line.start.seen_from(ego)
    if abs(cos(line.heading)) > 0.1 or road.line.part(0.0, road.length).bends:
        return None
    return line.x - line.y * cos(line.heading) / sin(line.heading)


def _curve(road: Road, direction: int, t: float, ego: Place) -> RoadPlan | None:
    """Return the arcs ahead of the ego, or None if there are none."""
    begin = road.at(0.0, t) if direction > 0 else road.at(road.length, t).turned(pi)
    lane = Track(begin, road.bends(direction, t))
    bends, distance = list(lane.part(lane.nearest(ego)).bends), 0.0
    while bends and bends[0].curvature == bends[0].last_curvature == 0.0:
        distance += bends.pop(0).length
    if any(bend.curvature != bend.last_curvature for bend in bends):
        raise ValueError(f"spirals of the ego's road {road.name} are not supported; use arcs")
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


EGO = "ego"  # name of the ego, in any case; without one, the first entity
LEAD_IN = 1.0  # [s] at constant speeds before the first change of speed
HORIZON = 120.0  # [s] within which a contact is searched for
DURATION = "lgmd_gym.duration"
"""Property of the file: duration of the episode [s]; the episode then begins at the file's start."""
_TAGS = (
    "FileHeader VariableDeclarations MonitorDeclarations StopTrigger Performance SceneGraphFile UsedArea "
    "TrafficSignals TimeOfDay DomeImage Wind AdditionalAxle License"
)
IGNORED_TAGS = frozenset(_TAGS.split())
"""Elements without an effect on us, with all that they contain."""
_ATTRIBUTES = (
    "name z mass model model3d role h p r Weather.fractionalCloudCover Weather.cloudState Sun.elevation "
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
    notes: tuple[str, ...]  # what has no effect although it is supported, with file and line


def compile_scenario(root: Element, family: str) -> Compiled:
    """Return a concrete scenario."""
    with root.locate_errors():
        return _compile_board(root, family)


def _compile_board(root: Element, family: str) -> Compiled:
    catalogs = Catalogs(root)
    movers = read_entities(root, catalogs)
    network = root.child("RoadNetwork").child("LogicFile")
    roads = read_roads(network.path("filepath"))
    world = ScenarioMap(roads, catalogs, movers)
    board = root.child("Storyboard")
    environment = run_init(board, world)
    weather = weather_of(environment)
    notes = tuple(read_story(board, world).play(world))
    for node in (root.node, *catalogs.visited):
        check_used(node, IGNORED_TAGS, IGNORED_ATTRIBUTES)
    ego = next((item for name, item in movers.items() if name.lower() == EGO), None)
    if ego is None:
        raise root.child("Entities").error("the scenario needs an entity with the name Ego")
    return _compile(root, world, ego, family, weather, notes)


def _compile(
    root: Element, world: ScenarioMap, ego: Mover, family: str, weather: str, notes: tuple[str, ...]
) -> Compiled:
    others = [item for item in world.movers.values() if item is not ego and not item.deleted]
    contact, target = _first_contact(ego, [item for item in others if item.body.kind != "road_marking"])
    header = root.find("FileHeader")
    properties = {} if header is None else header.properties()
    duration = float(properties[DURATION]) if DURATION in properties else None
    start = 0.0 if duration is not None else _start(contact, [ego, *others])
    if duration is None:
        others.sort(key=lambda item: item is not target)
        changes = [item.start for mover in (ego, *others) for item in mover.timeline.segments]
        end = contact if contact < inf else max(changes, default=0.0) + START_TTC
        duration = end - start + AFTERMATH
    length = ego.body.length
    base, _, _ = _pose(ego, start)
    scenario = Scenario(
        family=family,
        ego_speed=ego.timeline.at(start).speed,
        duration=duration,
        actors=tuple(_actor(item, base, length, start) for item in others),
        ego_profile=_profile(ego, start),
        ego_path=_bends(ego, start),
        road=road_plan(world.network, base, world.locate(base)),
        ego_length=length,
        ego_width=ego.body.width,
        ego_reference=_pose(ego, start)[1] if _bends(ego, start) else 0.0,
    )
    return Compiled(scenario, weather, start, contact, ego, target, world, root, properties, notes)


def _start(contact: float, movers: list[Mover]) -> float:
    changes = [item.timeline.segments[0].start for item in movers if item.timeline.segments]
    first = min(changes, default=inf) - LEAD_IN
    start = min(contact - START_TTC, first)
    return start if start < inf else 0.0


def _pose(mover: Mover, time: float) -> tuple[Place, float, float]:
    """Return the pose of a body's centre in its direction of travel, its reference, and its speed."""
    motion = mover.timeline.at(time)
    reference = -mover.body.reference if mover.backwards else mover.body.reference
    return mover.path.at(motion.distance).moved(reference), reference, motion.speed


def _bends(mover: Mover, time: float) -> tuple[Bend, ...]:
    """Return the bends of a body's path from a time on; none for a body that never moves."""
    moves = mover.timeline.segments or mover.timeline.initial_speed > 0.0
    return mover.path.part(mover.timeline.at(time).distance).bends if moves else ()


def _profile(mover: Mover, start: float) -> tuple[Segment, ...]:
    return tuple(replace(item, start=max(item.start - start, 0.0)) for item in mover.timeline.segments)


def _actor(mover: Mover, ego: Place, ego_length: float, start: float) -> Actor:
    place, reference, speed = _pose(mover, start)
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
        a, b = _pose(one, time)[0], _pose(other, time)[0]
        apart = hypot(a.x - b.x, a.y - b.y)
        least = min(least, apart)
        if apart <= reach and _touching(one, other, time):
            touching = partial(_touching, one, other)
            return first_true(touching, max(time - 0.02, 0.0), time), 0.0
        time += max((apart - reach) / fastest, 0.005)
    return inf, least


def _top_speed(mover: Mover) -> float:
    return max(mover.timeline.initial_speed, *(item.final_speed for item in mover.timeline.segments), 0.0)


def _touching(one: Mover, other: Mover, time: float) -> bool:
    a, b = _pose(one, time)[0], _pose(other, time)[0]
    first = Rectangle(a.x, a.y, a.heading, one.body.length, one.body.width)
    second = Rectangle(b.x, b.y, b.heading, other.body.length, other.body.width)
    return first_touch(first, second, 0.0, 0.0) == 0.0
