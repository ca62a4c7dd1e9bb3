"""Surroundings: the road plan and the camera condition of a scenario."""

from math import cos, pi, sin

from lgmd_gym.camera import CLEAR
from lgmd_gym.envs.families.scenario import RoadPlan
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.paths import Place, Track
from lgmd_gym.openscenario.roads import Road, RoadNetwork

NIGHT_LUX = 50.0
"""Illuminance of the sun below which it is night; twilight of a street is about 10 lx, a dull day 1000 lx."""
FOG = 1000.0  # [m], visual range below which the condition is fog, as in meteorology
_WIDEST = 6.0  # [m], width of a lane; wider ones are open test areas
_REACH = (-50.0, 500.0)  # [m] ahead of the ego within which a crossing road counts


def condition_of(environment: Element | None) -> str:
    """Return the camera condition of an `Environment`: clear, night, fog or rain.

    Night is a sun below 50 lx, fog a visual range below 1000 m, rain a precipitation with an intensity.

    Raises:
        ValueError: If several of them are combined, there is snow, or the road is slippery.
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
    if sun is not None and sun.has("illuminance") and sun.number("illuminance") < NIGHT_LUX:
        found.add("night")
    if fog is not None and fog.number("visualRange") < FOG:
        found.add("fog")
    if rain is not None and rain.choice("precipitationType", ("dry", "rain")) == "rain":
        intensity = "precipitationIntensity" if rain.has("precipitationIntensity") else "intensity"
        found |= {"rain"} if rain.number(intensity) > 0.0 else set()
    if len(found) > 1:
        raise weather.error(f"the conditions {', '.join(sorted(found))} cannot be combined; use one")
    return found.pop() if found else CLEAR


def road_plan(network: RoadNetwork, ego: Place, located: tuple[Road, float, float]) -> RoadPlan:
    """Return the road plan around the ego.

    A perpendicular road ahead makes a crossing, arcs of the ego's road a curve. A straight road with lanes of
    at most 6 m has these lanes; wider ones are a test area, for which the default plan is used.

    Args:
        network: The roads.
        ego: Initial pose of the ego's centre, in its direction of travel.
        located: The ego's road, distance along it and offset from it [m].

    Raises:
        ValueError: If the road has spirals.
    """
    road, s, t = located
    distances = [_crossing(other, ego) for other in network.roads.values() if other.junction == "-1"]
    ahead = [item for item in distances if item is not None and _REACH[0] < item < _REACH[1]]
    if ahead:
        return RoadPlan(kind="crossing", distance=ahead[0])
    direction = 1 if cos(ego.heading - road.at(s).heading) > 0.0 else -1
    bends = road.bends(direction, 0.0)
    curve = None
    if any(bend.curvature or bend.last_curvature for bend in bends):
        curve = _curve(road, direction, t, ego)
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
    if not own or any(_width(road, number, s) > _WIDEST for number in own):
        return RoadPlan()
    index = min(range(len(own)), key=lambda i: abs(driving[own[i]] - t))
    if len(own) == 1 and len(driving) > 1:
        return RoadPlan(kind="two-way")
    return RoadPlan(lanes=len(own), ego_lane=index)


def _width(road: Road, lane: int, s: float) -> float:
    inner = lane - (1 if lane > 0 else -1)
    edge = 0.0 if inner == 0 else _width(road, inner, s) / 2
    first = road.lane_centre(0, s) if inner == 0 else road.lane_centre(inner, s)
    return 2.0 * (abs(road.lane_centre(lane, s) - first) - edge)
