"""Small OpenSCENARIO and OpenDRIVE files for tests, and functions that read them."""

from textwrap import indent

from lgmd_gym.openscenario.nodes import Element, parse_file
from lgmd_gym.openscenario.parameters import declare
from lgmd_gym.openscenario.reader import read_cells

HEADER = '<FileHeader revMajor="1" revMinor="3" date="2026-01-01T00:00:00" author="a" description="d"/>'
LANES = """<lanes><laneSection s="0">
<left><lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></left>
<center><lane id="0" type="none"/></center>
<right><lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right>
</laneSection></lanes>"""


def road(number, x, y, heading, length, shape="<line/>", link="", junction="-1", lanes=LANES):
    """Return a road with one geometry; `link` as "predecessor:2:end successor:3:start"."""
    links = ""
    for item in link.split():
        tag, other, end = item.split(":")
        links += f'<{tag} elementType="road" elementId="{other}" contactPoint="{end}"/>'
    return (
        f'<road id="{number}" junction="{junction}" length="{length}"><link>{links}</link><planView>'
        f'<geometry s="0" x="{x}" y="{y}" hdg="{heading}" length="{length}">{shape}</geometry>'
        f"</planView>{lanes}</road>"
    )


def road_file(*roads):
    return f'<OpenDRIVE><header revMajor="1" revMinor="7"/>{"".join(roads)}</OpenDRIVE>'


STRAIGHT = road_file(road(0, 0, 0, 0, 1000))
QUARTER = 15.707963267948966  # [m], a quarter of a circle with a radius of 10 m
# Road 0 along x to (100, 0); road 1, an arc to the left with radius 10 m; road 2 up from (110, 10).
CORNER = road_file(
    road(0, 0, 0, 0, 100),
    road(
        1, 100, 0, 0, QUARTER, '<arc curvature="0.1"/>', "predecessor:0:end successor:2:start", junction="1"
    ),
    road(2, 110, 10, 1.5707963267948966, 100),
)
SIZE = '<Dimensions length="4" width="2" height="1.5"/>'
AXLES = """<Performance maxSpeed="70" maxAcceleration="9" maxDeceleration="9"/>
<Axles><FrontAxle maxSteering="0.5" wheelDiameter="0.6" trackWidth="1.5" positionX="2.5" positionZ="0.3"/>
<RearAxle maxSteering="0" wheelDiameter="0.6" trackWidth="1.5" positionX="0" positionZ="0.3"/></Axles>"""


def vehicle(name, category="car", x=0.0, properties="", extra=""):
    """Return an entity of 4 × 2 m whose centre is `x` [m] ahead of its reference point."""
    return (
        f'<ScenarioObject name="{name}"><Vehicle name="{name}" vehicleCategory="{category}">'
        f'<BoundingBox><Center x="{x}" y="0" z="0.7"/>{SIZE}</BoundingBox>'
        f"{AXLES}{properties}</Vehicle>{extra}</ScenarioObject>"
    )


def pedestrian(name):
    box = '<BoundingBox><Center x="0" y="0" z="0.9"/><Dimensions length="0.6" width="0.5" height="1.8"/>'
    return (
        f'<ScenarioObject name="{name}"><Pedestrian name="{name}" mass="75" pedestrianCategory="pedestrian">'
        f"{box}</BoundingBox></Pedestrian></ScenarioObject>"
    )


def teleport(entity, position):
    return private(entity, f"<TeleportAction><Position>{position}</Position></TeleportAction>")


def private(entity, *actions):
    inside = "".join(f"<PrivateAction>{action}</PrivateAction>" for action in actions)
    return f'<Private entityRef="{entity}">{inside}</Private>'


def speed(value, dimension="time", shape="step", amount=0):
    return (
        f'<LongitudinalAction><SpeedAction><SpeedActionDynamics dynamicsDimension="{dimension}" '
        f'dynamicsShape="{shape}" value="{amount}"/><SpeedActionTarget><AbsoluteTargetSpeed value="{value}"/>'
        "</SpeedActionTarget></SpeedAction></LongitudinalAction>"
    )


def lane_position(s, lane=-1, road_id=0, extra=""):
    return f'<LanePosition roadId="{road_id}" laneId="{lane}" s="{s}" {extra}/>'


def world_position(x, y, h=0.0):
    return f'<WorldPosition x="{x}" y="{y}" h="{h}"/>'


def value_condition(inside, edge="none", delay=0):
    return (
        f'<StartTrigger><ConditionGroup><Condition name="c" conditionEdge="{edge}" delay="{delay}">'
        f"<ByValueCondition>{inside}</ByValueCondition></Condition></ConditionGroup></StartTrigger>"
    )


def entity_condition(inside, entity="Ego", edge="none", delay=0, rule="any"):
    return (
        f'<StartTrigger><ConditionGroup><Condition name="c" conditionEdge="{edge}" delay="{delay}">'
        f'<ByEntityCondition><TriggeringEntities triggeringEntitiesRule="{rule}"><EntityRef '
        f'entityRef="{entity}"/></TriggeringEntities><EntityCondition>{inside}</EntityCondition>'
        "</ByEntityCondition></Condition></ConditionGroup></StartTrigger>"
    )


def at(time, rule="greaterThan"):
    return value_condition(f'<SimulationTimeCondition value="{time}" rule="{rule}"/>')


def event(name, action, trigger=""):
    return (
        f'<Event name="{name}" priority="override"><Action name="{name}A"><PrivateAction>{action}'
        f"</PrivateAction></Action>{trigger}</Event>"
    )


def story(entity, *events, trigger=""):
    return (
        '<Story name="S"><Act name="Act"><ManeuverGroup name="G" maximumExecutionCount="1">'
        f'<Actors selectTriggeringEntities="false"><EntityRef entityRef="{entity}"/></Actors>'
        f'<Maneuver name="M">{"".join(events)}</Maneuver></ManeuverGroup>{trigger}</Act></Story>'
    )


def scenario(init, stories="", entities="", parameters="", catalogs="", globals_="", road_name="road.xodr"):
    """Return a scenario; the ego and a target are its entities unless others are given."""
    entities = entities or vehicle("Ego") + vehicle("Target")
    body = (
        f"{HEADER}\n<ParameterDeclarations>{parameters}</ParameterDeclarations>\n"
        f"<CatalogLocations>{catalogs}</CatalogLocations>\n"
        f'<RoadNetwork><LogicFile filepath="{road_name}"/></RoadNetwork>\n<Entities>{entities}</Entities>\n'
        f"<Storyboard><Init><Actions>{globals_}{init}</Actions></Init>\n{stories}\n<StopTrigger/></Storyboard>"
    )
    return f"<OpenSCENARIO>\n{indent(body, ' ')}\n</OpenSCENARIO>"


def parameter(name, value, kind="double", constraints=""):
    return (
        f'<ParameterDeclaration name="{name}" parameterType="{kind}" value="{value}">{constraints}'
        "</ParameterDeclaration>\n"
    )


# The ego at s = 100 m with 10 m/s, and a stationary target 60 m ahead of it, 54 to 58 m from front to rear.
START = private(
    "Ego", f"<TeleportAction><Position>{lane_position(100)}</Position></TeleportAction>", speed(10)
) + teleport("Target", lane_position(160))


def write(folder, text, name="case.xosc", roads=STRAIGHT):
    """Write a scenario and its roads; return the path of the scenario."""
    (folder / "road.xodr").write_text(roads)
    path = folder / name
    path.write_text(text)
    return path


def compiled(folder, text, roads=STRAIGHT):
    """Return the only cell of a scenario, compiled."""
    (cell,) = read_cells(write(folder, text, roads=roads))
    return cell.compiled


def variation(inside, scenario_file="case.xosc"):
    return (
        f'<OpenSCENARIO>\n{HEADER}\n<ParameterValueDistribution><ScenarioFile filepath="{scenario_file}"/>\n'
        f"<Deterministic>\n{inside}\n</Deterministic></ParameterValueDistribution></OpenSCENARIO>"
    )


def values(name, *texts):
    inside = "".join(f'<Element value="{text}"/>' for text in texts)
    return (
        f'<DeterministicSingleParameterDistribution parameterName="{name}"><DistributionSet>{inside}'
        "</DistributionSet></DeterministicSingleParameterDistribution>\n"
    )


def element(folder, text):
    """Return the root of an XML text as an element with its declared parameters."""
    path = folder / "part.xml"
    path.write_text(text)
    root = Element(parse_file(path), {})
    return Element(root.node, declare(root, {}))


AWAY = speed(6, "rate", "linear", 2)
FAST = private("Ego", f"<TeleportAction><Position>{lane_position(100)}</Position></TeleportAction>",
               speed("${$Ego_speed_kph / 3.6}"))  # fmt: skip
SPEED = parameter("Ego_speed_kph", "36")
SUN = '<Sun azimuth="0" elevation="1" illuminance="{}"/>'


def segments(folder, stories, init=START, name="Target", **kwargs):
    """Return the compiled speed segments of an entity."""
    return compiled(folder, scenario(init, stories, **kwargs)).world.movers[name].timeline.segments


def varied(folder, *items, name="vary", parameters=SPEED, init=None):
    """Write a scenario and a file that varies it; return the path of the second."""
    init = FAST + teleport("Target", lane_position(160)) if init is None else init
    write(folder, scenario(init, parameters=parameters))
    path = folder / f"{name}.xosc"
    path.write_text(variation("".join(items)))
    return path


def weather(inside):
    """Return the global action of an environment with this weather."""
    return (
        '<GlobalAction><EnvironmentAction><Environment name="e"><Weather fractionalCloudCover="zeroOktas">'
        f"{inside}"
        "</Weather></Environment></EnvironmentAction></GlobalAction>"
    )
