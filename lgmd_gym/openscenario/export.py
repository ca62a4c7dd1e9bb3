"""Export of cases as OpenSCENARIO XML 1.3.

Paths are clothoid splines, changes of speed are events at their times. Reading an exported file returns the
same episode: its duration, grey levels and the FCW driver are properties of the file and of the entities.
A segment with a build-up is a `SpeedProfileAction` with `maxAccelerationRate` or `maxDecelerationRate`.
"""

from math import cos, pi, sin
from pathlib import Path
from xml.etree import ElementTree as ET

from lgmd_gym.benchmark.case import Case
from lgmd_gym.camera import CLEAR
from lgmd_gym.envs.dynamics.path import Path as DrivenPath
from lgmd_gym.envs.dynamics.script import Bend, Pose, Segment
from lgmd_gym.envs.families.scenario import LANE_WIDTH, Actor, RoadPlan, Scenario
from lgmd_gym.envs.motion import is_truck
from lgmd_gym.errors import check_path, check_type
from lgmd_gym.openscenario.bodies import SHADE
from lgmd_gym.openscenario.compiler import DURATION
from lgmd_gym.openscenario.motion import Place, Timeline
from lgmd_gym.openscenario.reader import DRIVER, FAMILY, SUFFIX
from lgmd_gym.processes.files import replace_file

BEHIND, AHEAD, ARM = 300.0, 6000.0, 250.0  # [m], extent of straight roads, and of crossing roads
HEADER = {"revMajor": "1", "revMinor": "7", "name": "lgmd-gym", "version": "1.00"}


def road_xml(plan: RoadPlan) -> ET.Element:
    """Return a road plan as OpenDRIVE.

    A crossing is written as two roads that overlap, without a junction.
    """
    root = ET.Element("OpenDRIVE")
    ET.SubElement(root, "header", HEADER)
    if plan.kind == "curve":
        _road(root, 0, (-BEHIND, LANE_WIDTH / 2, 0.0), _curve(plan), 1, 1)
        return root
    straight = [Bend(BEHIND + AHEAD)]
    if plan.kind == "straight":
        left = (plan.ego_lane + 0.5) * LANE_WIDTH
        _road(root, 0, (-BEHIND, left, 0.0), straight, 0, plan.lanes)
        return root
    _road(root, 0, (-BEHIND, LANE_WIDTH / 2, 0.0), straight, 1, 1)
    if plan.kind == "crossing":
        start = (plan.distance, LANE_WIDTH / 2 - ARM, pi / 2)
        _road(root, 1, start, [Bend(2.0 * ARM)], 1, 1)
    return root


def _curve(plan: RoadPlan) -> list[Bend]:
    """Return the bends of the reference line, half a lane to the left of the plan's bends."""
    bends = [Bend(BEHIND + plan.distance)]
    for bend in plan.bends:
        scale = 1.0 - bend.curvature * LANE_WIDTH / 2
        bends.append(Bend(bend.length * scale, bend.curvature / scale))
    return [*bends, Bend(ARM)]


def _road(
    root: ET.Element, number: int, start: tuple[float, float, float], bends: list[Bend], left: int, right: int
) -> None:
    """Append a road with driving lanes to the left and right of its reference line."""
    length = sum(bend.length for bend in bends)
    values = {"id": str(number), "junction": "-1", "length": repr(length), "name": f"road {number}"}
    road = ET.SubElement(root, "road", values)
    view = ET.SubElement(road, "planView")
    path, s = DrivenPath(Pose(start[0], -start[1], -start[2]), tuple(bends)), 0.0
    for bend in bends:
        pose = path.pose(s)
        place = {"s": s, "x": pose.x, "y": -pose.y, "hdg": -pose.heading, "length": bend.length}
        item = ET.SubElement(view, "geometry", {name: repr(float(value)) for name, value in place.items()})
        if bend.curvature == 0.0:
            ET.SubElement(item, "line")
        else:
            ET.SubElement(item, "arc", {"curvature": repr(bend.curvature)})
        s += bend.length
    section = ET.SubElement(ET.SubElement(road, "lanes"), "laneSection", {"s": "0"})
    if left:
        _lanes(section, "left", range(left, 0, -1))
    centre = ET.SubElement(ET.SubElement(section, "center"), "lane", {"id": "0", "type": "none"})
    _mark(centre, "broken" if left else "solid")
    _lanes(section, "right", range(-1, -right - 1, -1))


def _lanes(section: ET.Element, side: str, numbers: range) -> None:
    group = ET.SubElement(section, side)
    outer = max(numbers, key=abs)
    for number in numbers:
        lane = ET.SubElement(group, "lane", {"id": str(number), "type": "driving"})
        ET.SubElement(lane, "width", {"sOffset": "0", "a": repr(LANE_WIDTH), "b": "0", "c": "0", "d": "0"})
        _mark(lane, "solid" if number == outer else "broken")


def _mark(lane: ET.Element, kind: str) -> None:
    ET.SubElement(lane, "roadMark", {"sOffset": "0", "type": kind, "color": "standard"})


EGO_HEIGHT = 1.5  # [m]
DATE = "2026-01-01T00:00:00"  # constant, so that exports are reproducible
TAIL = 500.0  # [m], straight at the end of a trajectory
_WEATHER = {
    "night": ("Sun", {"azimuth": "0", "elevation": "0", "illuminance": "0.1"}),
    "fog": ("Fog", {"visualRange": "100"}),
    "rain": ("Precipitation", {"precipitationIntensity": "10", "precipitationType": "rain"}),
}
_KINDS = {"car": "car", "bicycle": "bicycle", "motorcycle": "motorbike"}
_OBJECTS = {"box": "obstacle", "road_marking": "roadMark"}


def export_case(case: Case, path: str | Path) -> tuple[Path, Path]:
    """Write a case as OpenSCENARIO 1.3, and its road as OpenDRIVE next to it.

    The light and weather of a random level and the world are not exported.

    Args:
        case: The case.
        path: File to write (.xosc), which must not exist; the road has the same name with ".xodr".

    Returns:
        The two files.

    Raises:
        ValueError: If a file exists or cannot be written, or OpenSCENARIO has no such weather.
    """
    path = check_path("path", path)
    check_type("case", case, Case)
    if path.suffix != SUFFIX:
        raise ValueError(f"the file must end in {SUFFIX}, got {str(path)!r}")
    files = path, path.with_suffix(".xodr")
    for file in files:
        if file.exists():
            raise ValueError(f"{str(file)!r} exists; choose another file or remove it")
    if not path.parent.is_dir():
        raise ValueError(f"{str(path)!r} cannot be written: No such folder; create it first")
    scenario = case.scenario
    weather = str(dict(case.arguments).get("weather", CLEAR))
    roots = scenario_xml(scenario, files[1].name, weather, case.fcw_driver), road_xml(scenario.road)
    try:
        for file, root in zip(files, roots, strict=True):
            ET.indent(root)
            text = ET.tostring(root, encoding="unicode", xml_declaration=False)
            replace_file(file, f'<?xml version="1.0" encoding="utf-8"?>\n{text}\n')
    except BaseException as error:  # neither file is left, so that the same command can be repeated
        for file in files:
            file.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise ValueError(f"{str(path)!r} cannot be written: {error.strerror}") from None
        raise
    return files


def scenario_xml(scenario: Scenario, road: str, weather: str = CLEAR, fcw_driver: bool = False) -> ET.Element:
    """Return a scenario as OpenSCENARIO 1.3."""
    root = ET.Element("OpenSCENARIO")
    header = _add(root, "FileHeader", author="lgmd-gym", date=DATE, description=scenario.family)
    header.attrib |= {"revMajor": "1", "revMinor": "3"}
    _properties(header, {DURATION: repr(scenario.duration), DRIVER: str(fcw_driver).lower()})
    declarations = _add(root, "ParameterDeclarations")
    _add(declarations, "ParameterDeclaration", name=FAMILY, parameterType="string", value=scenario.family)
    _add(root, "CatalogLocations")
    _add(_add(root, "RoadNetwork"), "LogicFile", filepath=road)
    entities, board = _add(root, "Entities"), _add(root, "Storyboard")
    actions = _add(_add(board, "Init"), "Actions")
    if weather != CLEAR:
        _environment(actions, weather)
    act = ET.Element("Act", name="Act")
    ego = _ego(scenario)
    for number, actor in enumerate((ego, *scenario.actors)):
        name = "Ego" if number == 0 else f"Actor{number}"
        _entity(entities, name, actor)
        ahead = 0.0 if number == 0 else scenario.ego_length / 2 + actor.gap + actor.length / 2
        _initial(actions, name, actor, Place(ahead, actor.lateral_offset, actor.heading))
        _events(act, name, actor.speed, actor.profile)
    if len(act):
        story = _add(board, "Story", name="Story")
        story.append(act)
    _condition(_add(board, "StopTrigger"), "end", scenario.duration, "greaterThan")
    return root


def _ego(scenario: Scenario) -> Actor:
    """Return the ego as an actor at the origin."""
    return Actor(
        gap=0.0,
        speed=scenario.ego_speed,
        profile=scenario.ego_profile,
        path=scenario.ego_path,
        length=scenario.ego_length,
        width=scenario.ego_width,
        height=EGO_HEIGHT,
        reference=scenario.ego_reference,
    )


def _add(parent: ET.Element, tag: str, **attributes: object) -> ET.Element:
    """Append an element; floats are written with all digits."""
    texts = {
        name: repr(value) if isinstance(value, float) else str(value) for name, value in attributes.items()
    }
    return ET.SubElement(parent, tag, texts)


def _properties(parent: ET.Element, values: dict[str, str]) -> None:
    block = _add(parent, "Properties")
    for name, value in values.items():
        _add(block, "Property", name=name, value=value)


def _entity(entities: ET.Element, name: str, actor: Actor) -> None:
    owner = _add(entities, "ScenarioObject", name=name)
    if actor.kind in _KINDS:
        category = "truck" if is_truck(actor) else _KINDS[actor.kind]
        item = _add(owner, "Vehicle", name=name, vehicleCategory=category)
    elif actor.kind == "pedestrian":
        item = _add(owner, "Pedestrian", name=name, mass=75, pedestrianCategory="pedestrian")
    else:
        item = _add(owner, "MiscObject", name=name, mass=1000, miscObjectCategory=_OBJECTS[actor.kind])
    box = _add(item, "BoundingBox")
    _add(box, "Center", x=float(actor.reference), y=0.0, z=actor.height / 2)
    _add(box, "Dimensions", height=float(actor.height), length=float(actor.length), width=float(actor.width))
    if actor.kind in _KINDS:
        _add(item, "Performance", maxSpeed=70.0, maxAcceleration=12.0, maxDeceleration=12.0)
        axles = _add(item, "Axles")
        for tag, steering, x in (("FrontAxle", 0.5, 2.0 * max(actor.reference, 0.0)), ("RearAxle", 0.0, 0.0)):
            place = {"maxSteering": steering, "positionX": x, "positionZ": 0.3}
            _add(axles, tag, **place, trackWidth=1.5, wheelDiameter=0.6)
    _properties(item, {} if actor.shade is None else {SHADE: str(actor.shade)})


def _initial(actions: ET.Element, name: str, actor: Actor, centre: Place) -> None:
    """Append the initial position, speed and trajectory of an entity."""
    x = centre.x - actor.reference * cos(centre.heading)
    y = centre.y - actor.reference * sin(centre.heading)
    start = {"x": x, "y": y, "z": 0.0, "h": float(centre.heading)}
    private = _add(actions, "Private", entityRef=name)
    teleport = _add(_add(private, "PrivateAction"), "TeleportAction")
    _add(_add(teleport, "Position"), "WorldPosition", **start)
    if actor.speed == 0.0 and not actor.profile:
        return
    speed = _add(_add(_add(private, "PrivateAction"), "LongitudinalAction"), "SpeedAction")
    _add(speed, "SpeedActionDynamics", dynamicsDimension="time", dynamicsShape="step", value=0.0)
    _add(_add(speed, "SpeedActionTarget"), "AbsoluteTargetSpeed", value=float(actor.speed))
    follow = _add(_add(_add(private, "PrivateAction"), "RoutingAction"), "FollowTrajectoryAction")
    _add(_add(follow, "TimeReference"), "None")
    _add(follow, "TrajectoryFollowingMode", followingMode="position")
    trajectory = _add(_add(follow, "TrajectoryRef"), "Trajectory", name=f"{name}Path", closed="false")
    spline = _add(_add(trajectory, "Shape"), "ClothoidSpline")
    for number, bend in enumerate((*actor.path, Bend(TAIL))):
        first, last, length = map(float, (bend.curvature, bend.last_curvature, bend.length))
        values = {"curvatureStart": first, "curvatureEnd": last, "length": length}
        part = _add(spline, "ClothoidSplineSegment", **values)
        if number == 0:
            _add(_add(part, "PositionStart"), "WorldPosition", **start)


def _events(act: ET.Element, name: str, speed: float, profile: tuple[Segment, ...]) -> None:
    """Append the changes of speed of an entity; delayed segments begin when the previous one ends."""
    timeline, end = Timeline(speed), 0.0
    group = ET.Element("ManeuverGroup", name=name, maximumExecutionCount="1")
    _add(_add(group, "Actors", selectTriggeringEntities="false"), "EntityRef", entityRef=name)
    maneuver = _add(group, "Maneuver", name=f"{name}Speed")
    for number, segment in enumerate(profile):
        start, before = max(segment.start, end), timeline.at(max(segment.start, end)).speed
        if segment.final_speed == before:
            continue
        end = timeline.change(start, segment.acceleration, segment.final_speed, segment.build_up)
        event = _add(maneuver, "Event", name=f"{name}Speed{number}", priority="override")
        action = _add(_add(event, "Action", name=f"{name}Action{number}"), "PrivateAction")
        _change(_add(action, "LongitudinalAction"), segment, segment.final_speed > before)
        _condition(_add(event, "StartTrigger"), f"{name}Start{number}", start, "greaterOrEqual")
    if len(maneuver):
        act.append(group)


def _change(action: ET.Element, segment: Segment, faster: bool) -> None:
    strength = abs(segment.acceleration)
    if segment.build_up == 0.0:
        speed = _add(action, "SpeedAction")
        dynamics = {"dynamicsDimension": "rate", "dynamicsShape": "linear", "value": float(strength)}
        _add(speed, "SpeedActionDynamics", **dynamics)
        _add(_add(speed, "SpeedActionTarget"), "AbsoluteTargetSpeed", value=float(segment.final_speed))
        return
    profile = _add(action, "SpeedProfileAction", followingMode="follow")
    name = "maxAcceleration" if faster else "maxDeceleration"
    limits = {name: float(strength), f"{name}Rate": strength / segment.build_up}
    _add(profile, "DynamicConstraints", **limits)
    _add(profile, "SpeedProfileEntry", speed=float(segment.final_speed))


def _condition(trigger: ET.Element, name: str, time: float, rule: str) -> None:
    values = {"name": name, "delay": 0.0, "conditionEdge": "none"}
    item = _add(_add(trigger, "ConditionGroup"), "Condition", **values)
    _add(_add(item, "ByValueCondition"), "SimulationTimeCondition", value=float(time), rule=rule)


def _environment(actions: ET.Element, name: str) -> None:
    if name not in _WEATHER:
        known = ", ".join(_WEATHER)
        raise ValueError(f"OpenSCENARIO has no weather {name!r}; known: {known}")
    action = _add(_add(actions, "GlobalAction"), "EnvironmentAction")
    weather = _add(_add(action, "Environment", name=name), "Weather", fractionalCloudCover="zeroOktas")
    tag, values = _WEATHER[name]
    _add(weather, tag, **values)
