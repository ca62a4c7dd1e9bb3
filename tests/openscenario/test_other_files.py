"""Files as esmini, ASAM and CARLA write them: what they leave open, and what has no effect."""

import re

import pytest
from support.openscenario import (
    AWAY,
    CORNER,
    HEADER,
    START,
    STRAIGHT,
    at,
    compiled,
    entity_condition,
    event,
    lane_position,
    parameter,
    private,
    road,
    road_file,
    scenario,
    segments,
    speed,
    story,
    teleport,
    value_condition,
    vehicle,
    weather,
    world_position,
    write,
)

from lgmd_gym.openscenario.reader import read_cells


def notes(folder, text):
    return [note.split(": ", 1)[1] for note in compiled(folder, text).notes]


def started(folder, trigger, init=START):
    found = segments(folder, story("Target", event("E", AWAY, trigger)), init=init)
    return found[0].start if found else None


def test_a_position_beyond_the_road(tmp_path):
    found = notes(tmp_path, scenario(START.replace('s="160"', 's="1001.5"')))
    assert found == ["LanePosition s=1001.5 m is beyond road 0, which is 1000 m long"]
    assert notes(tmp_path, scenario(START.replace('s="160"', 's="1000.5"'))) == []


def test_openscenario_1_0(tmp_path):
    old = scenario(START).replace('revMinor="3"', 'revMinor="0"')
    assert compiled(tmp_path, old).scenario == compiled(tmp_path, scenario(START)).scenario


@pytest.mark.parametrize(
    ("names", "ego"), [(("Target", "Ego"), "Ego"), (("Car", "HERO"), "HERO"), (("Parked", "Car"), "Car")]
)
def test_the_name_of_the_ego(tmp_path, names, ego):
    """An entity with the name Ego or hero in any case, else the first vehicle that moves."""
    parked, moving = names
    init = START.replace('"Ego"', f'"{moving}"').replace('"Target"', f'"{parked}"')
    found = compiled(tmp_path, scenario(init, entities=vehicle(parked) + vehicle(moving)))
    assert found.ego.name == ego
    assert any("no entity has the name Ego; the ego is 'Car'" in note for note in found.notes) == (
        ego == "Car"
    )


@pytest.mark.parametrize(
    ("init", "message"),
    [
        (START.replace(speed(10), speed(0)), "the ego 'Ego' never moves; give it a SpeedAction"),
        (
            START.replace(speed(10), speed(0)).replace('"Ego"', '"A"'),
            "needs a vehicle that moves, as the ego",
        ),
    ],
)
def test_scenarios_without_a_moving_ego(tmp_path, init, message):
    entities = vehicle("A" if '"A"' in init else "Ego") + vehicle("Target")
    with pytest.raises(ValueError, match=rf"case\.xosc:\d+: .*{message}"):
        compiled(tmp_path, scenario(init, entities=entities))


CONTROLLER = (
    '<ObjectController><Controller name="c"><Properties><Property name="esminiController" value="ACC"/>'
    "</Properties></Controller></ObjectController>"
)


def test_controllers_have_no_effect(tmp_path):
    entities = vehicle("Ego", extra=CONTROLLER) + vehicle("Target")
    override = (
        '<ControllerAction><OverrideControllerValueAction><Brake value="1" active="true"/>'
        '<Throttle value="0" active="false"/></OverrideControllerValueAction></ControllerAction>'
    )
    init = START + private("Target", override, "<ActivateControllerAction longitudinal='true'/>")
    assert notes(tmp_path, scenario(init, entities=entities)) == [
        "Brake of 'Target' has no effect; it moves as the storyboard says",
        "the controller of 'Ego' has no effect; it moves as the storyboard says",
    ]


def test_an_empty_trigger_starts_at_once(tmp_path):
    text = scenario(START, story("Target", event("E", AWAY, "<StartTrigger/>")))
    assert notes(tmp_path, text) == ["StartTrigger has no condition; it starts at once"]
    assert started(tmp_path, "<StartTrigger/>") == 0.0


def test_a_plane_without_roads(tmp_path):
    init = private("Ego", f"<TeleportAction><Position>{world_position(0, 0)}</Position></TeleportAction>",
                   speed(10)) + teleport("Target", world_position(60, 0))  # fmt: skip
    text = scenario(init).replace('<LogicFile filepath="road.xodr"/>', "")
    assert compiled(tmp_path, text).contact == pytest.approx(5.6)
    with pytest.raises(ValueError, match="unknown road '0'"):
        compiled(tmp_path, scenario(START).replace('<LogicFile filepath="road.xodr"/>', ""))


def test_a_map_by_name(tmp_path):
    """CARLA's files name a map: its file has to be in their folder."""
    text = scenario(START, road_name="Town01")
    with pytest.raises(ValueError, match=r"the map 'Town01' is not there; put Town01\.xodr into the folder"):
        compiled(tmp_path, text)
    (tmp_path / "Town01.xodr").write_text(STRAIGHT)
    assert compiled(tmp_path, text).contact == pytest.approx(5.6)


def test_folders_of_unused_catalogs(tmp_path):
    missing = '<VehicleCatalog><Directory path="nowhere"/></VehicleCatalog>'
    assert compiled(tmp_path, scenario(START, catalogs=missing)).contact == pytest.approx(5.6)
    reference = (
        '<ScenarioObject name="Ego"><CatalogReference catalogName="C" entryName="car"/></ScenarioObject>'
    )
    with pytest.raises(ValueError, match=r"case\.xosc:\d+: the folder 'nowhere' does not exist"):
        compiled(tmp_path, scenario(START, catalogs=missing, entities=reference))


def test_catalogs_by_the_name_of_their_file(tmp_path):
    (tmp_path / "catalogs").mkdir()
    body = vehicle("Ego").split(">", 1)[1].removesuffix("</ScenarioObject>")
    text = f'<OpenSCENARIO>{HEADER}<Catalog name="Other">{body}</Catalog></OpenSCENARIO>'
    (tmp_path / "catalogs" / "Cars.xosc").write_text(text)
    folder = '<VehicleCatalog><Directory path="catalogs"/></VehicleCatalog>'
    for name in ("Cars", "Other"):
        entities = f'<ScenarioObject name="Ego"><CatalogReference catalogName="{name}" entryName="Ego"/>'
        entities += "</ScenarioObject>" + vehicle("Target")
        assert compiled(
            tmp_path, scenario(START, catalogs=folder, entities=entities)
        ).contact == pytest.approx(5.6)


CAR = re.search("<Vehicle.*</Vehicle>", vehicle("Ego"), re.S)[0]
COLLISION = '<CollisionCondition><EntityRef entityRef="Target"/></CollisionCondition>'


@pytest.mark.parametrize(
    ("condition", "time"),
    [
        (COLLISION, 5.6),  # 60 m less 4 m
        (COLLISION.replace('<EntityRef entityRef="Target"/>', '<ByType type="vehicle"/>'), 5.6),
        (COLLISION.replace('<EntityRef entityRef="Target"/>', '<ByType type="pedestrian"/>'), None),
        ('<EndOfRoadCondition duration="2"/>', 92.0),  # 900 m of road
    ],
)
def test_collisions_and_the_end_of_the_road(tmp_path, condition, time):
    """The first vehicle has no name of an ego, so that its contacts start events."""
    events = story("Target", event("E", AWAY, entity_condition(condition, "Car")))
    init, entities = START.replace('"Ego"', '"Car"'), vehicle("Car") + vehicle("Target")
    found = segments(tmp_path, events, init, entities=entities)
    assert [item.start for item in found] == ([] if time is None else [pytest.approx(time, abs=1e-6)])


@pytest.mark.parametrize(
    ("condition", "entity"),
    [
        (COLLISION, "Ego"),
        (COLLISION.replace('<EntityRef entityRef="Target"/>', '<ByType type="vehicle"/>'), "Ego"),
        (COLLISION.replace('"Target"', '"Ego"'), "Target"),
    ],
)
def test_events_after_a_contact_of_the_ego(tmp_path, condition, entity):
    """The episode ends with the contact, so that they never start."""
    events = story("Target", event("E", AWAY, entity_condition(condition, entity)))
    assert segments(tmp_path, events) == []
    assert notes(tmp_path, scenario(START, events)) == [
        "event 'E' waits for a contact of the ego, which ends the episode; it is left out"
    ]


def test_paths_of_other_folders(tmp_path):
    """A map and catalogs that are relative to a folder above the file, and a catalog that is a file."""
    inner = tmp_path / "files" / "inner"
    for folder in (inner / "own", tmp_path / "catalogs", tmp_path / "maps"):
        folder.mkdir(parents=True)
    catalog = f'<OpenSCENARIO>{HEADER}<Catalog name="Cars">{CAR}</Catalog></OpenSCENARIO>'
    for folder in (inner / "own", tmp_path / "catalogs"):
        (folder / "cars.xosc").write_text(catalog)
    (tmp_path / "maps" / "road.xodr").write_text(STRAIGHT)
    entities = '<ScenarioObject name="Ego"><CatalogReference catalogName="Cars" entryName="Ego"/>'
    entities += "</ScenarioObject>" + vehicle("Target")

    def found(folder):
        locations = f'<VehicleCatalog><Directory path="{folder}"/></VehicleCatalog>'
        text = scenario(START, catalogs=locations, entities=entities, road_name="maps/road.xodr")
        (cell,) = read_cells(write(inner, text))
        assert cell.compiled.contact == pytest.approx(5.6)
        return [note.split(": ", 1)[1] for note in cell.compiled.notes]

    above = f"'maps/road.xodr' is relative to {str(tmp_path)!r}, not to the folder of the file"
    base = str(tmp_path / "files")
    assert found("../catalogs") == [
        f"'../catalogs' is relative to {base!r}, not to the folder of the file", above
    ]  # fmt: skip
    assert found("own/cars") == ["the catalog is the file 'cars.xosc', not a folder", above]
    with pytest.raises(ValueError, match="the folder 'nowhere' does not exist; check CatalogLocations"):
        found("nowhere")


def test_empty_actions_of_the_triggering_entities(tmp_path):
    empty = story("Target", event("E", AWAY, at(1))).replace("false", "true", 1)
    with pytest.raises(ValueError, match=r"case\.xosc:\d+: selectTriggeringEntities=true is not supported"):
        compiled(tmp_path, scenario(START, empty))
    action = f'<Action name="EA"><PrivateAction>{AWAY}</PrivateAction></Action>'
    empty = empty.replace(action, '<Action name="EA"/>')
    assert notes(tmp_path, scenario(START, empty)) == ["Action 'EA' is empty and has no effect"]


@pytest.mark.parametrize(
    ("position", "message"),
    [
        (lane_position(160, -1.5), "LanePosition laneId must be a whole number, got '-1.5'"),
        (
            '<RelativeLanePosition entityRef="Ego" dLane="0.5" ds="60"/>',
            "RelativeLanePosition dLane must be a whole number, got '0.5'",
        ),
    ],
)
def test_fractions_of_lanes(tmp_path, position, message):
    with pytest.raises(ValueError, match=rf"case\.xosc:\d+: {message}"):
        compiled(tmp_path, scenario(START.replace(lane_position(160), position)))


def distance(kind, value, rule="lessThan", freespace="false", more='coordinateSystem="road"'):
    return entity_condition(
        f'<RelativeDistanceCondition entityRef="Target" relativeDistanceType="{kind}" value="{value}" '
        f'freespace="{freespace}" rule="{rule}" {more}/>'
    )


@pytest.mark.parametrize(
    ("trigger", "time"),
    [
        # The target is at s = 30 m of road 2; from s = 20 m of road 0 along the lines.
        (distance("longitudinal", 100), (80 + 15.707963 + 30 - 100) / 10),
        (distance("longitudinal", 100, freespace="true"), (80 + 15.707963 + 30 - 104) / 10),
        (distance("lateral", 1), 0.0),
        (distance("lateral", 1, "greaterThan"), None),
        (distance("euclidianDistance", 90), None),
    ],
)
def test_distances_along_the_road(tmp_path, trigger, time):
    """Along x to (100, 0), a quarter circle of 10 m, and up. The lane is outside: 1.57 · 1.75 m longer."""
    init = START.replace(lane_position(100), lane_position(20)).replace(
        lane_position(160), lane_position(30, -1, 2)
    )
    text = scenario(init, story("Target", event("E", AWAY, trigger)))
    found = compiled(tmp_path, text, CORNER).world.movers["Target"].timeline.segments
    if "euclidian" in trigger:  # over the corner
        assert found
    else:
        assert [item.start for item in found] == ([] if time is None else [pytest.approx(time, abs=2e-3)])


def headway(value, rule, more=""):
    return entity_condition(
        f'<TimeHeadwayCondition entityRef="Target" value="{value}" rule="{rule}" freespace="false" {more}/>'
    )


def test_headway_along_the_route(tmp_path):
    """`alongRoute` of OpenSCENARIO 1.0; a headway is not defined for an entity behind."""
    assert started(tmp_path, headway(2, "lessThan", 'alongRoute="true"')) == pytest.approx(4.0, abs=1e-6)
    behind = START.replace(lane_position(160), lane_position(60))
    assert started(tmp_path, headway(2, "greaterThan"), behind) is None


def value(tag, name, number):
    return f'<GlobalAction><{tag} {tag[0].lower()}{tag[1:-6]}Ref="{name}">{number}</{tag}></GlobalAction>'


@pytest.mark.parametrize("kind", ["Parameter", "Variable"])
def test_parameters_and_variables_during_the_run(tmp_path, kind):
    """1 becomes 3 after 2 s, and 6 after 4 s; an event waits for more than 5."""
    declared = parameter("x", 1, "double") if kind == "Parameter" else ""
    condition = value_condition(
        f'<{kind}Condition {kind.lower()}Ref="x" rule="greaterThan" value="5"/>', edge="rising"
    )
    change = '<ModifyAction><Rule><MultiplyByValue value="2"/></Rule></ModifyAction>'
    sets = [
        f'<Event name="E{time}" priority="parallel"><Action name="A{time}">'
        f"{value(f'{kind}Action', 'x', inside)}</Action>{at(time)}</Event>"
        for time, inside in ((2, '<SetAction value="3"/>'), (4, change))
    ]
    text = scenario(START, story("Target", *sets, event("Go", AWAY, condition)), parameters=declared)
    if kind == "Variable":
        text = text.replace(
            "<CatalogLocations>",
            '<VariableDeclarations><VariableDeclaration name="x" variableType="double" value="1"/>'
            "</VariableDeclarations><CatalogLocations>",
        )
    (segment,) = compiled(tmp_path, text).world.movers["Target"].timeline.segments
    assert segment.start == pytest.approx(4.0)


def test_repeated_events(tmp_path):
    """Twice 2 m/s more, each within 1 s and after the end of the one before."""
    more = speed(0, "rate", "linear", 2).replace(
        '<AbsoluteTargetSpeed value="0"/>',
        '<RelativeTargetSpeed entityRef="Target" value="2" speedTargetValueType="delta" continuous="false"/>',
    )
    twice = event("E", more, at(1)).replace(
        'priority="override"', 'priority="override" maximumExecutionCount="2"'
    )
    found = segments(tmp_path, story("Target", twice))
    assert [(item.start, item.final_speed) for item in found] == [(1.0, 2.0), (2.0, 4.0)]
    with pytest.raises(ValueError, match="maximumExecutionCount must be >= 0, got -1"):
        segments(tmp_path, story("Target", twice.replace('Count="2"', 'Count="-1"')))


def grouped(*events, count):
    return story("Target", *events).replace(
        '"G" maximumExecutionCount="1"', f'"G" maximumExecutionCount="{count}"'
    )


def test_repeated_groups(tmp_path):
    """To 2 m/s within 1 s, then back to 0 within 1 s; the group begins again when both are complete."""
    done = (
        '<StoryboardElementStateCondition storyboardElementType="event" storyboardElementRef="A" state="{}"/>'
    )
    first = event("A", speed(2, "rate", "linear", 2), at(1))
    second = event("B", speed(0, "rate", "linear", 2), value_condition(done.format("completeState")))
    found = segments(tmp_path, grouped(first, second, count=2))
    assert [(round(item.start, 6), item.final_speed) for item in found] == [(1, 2), (2, 0), (3, 2), (4, 0)]
    assert len(segments(tmp_path, grouped(first, second, count=3))) == 6
    # A rising edge of the time is there once: the second execution never ends.
    once = event("B", speed(0, "rate", "linear", 2), at(2.5).replace('Edge="none"', 'Edge="rising"'))
    text = scenario(START, grouped(first, once, count=3))
    compiled_once = compiled(tmp_path, text)
    found = compiled_once.world.movers["Target"].timeline.segments
    assert [(round(item.start, 6), item.final_speed) for item in found] == [(1, 2), (2.5, 0), (3.5, 2)]
    assert compiled_once.notes == ()


def test_keeping_the_speed_of_another(tmp_path):
    """The target accelerates to the ego's 10 m/s from 1 to 6 s, and brakes with it from 8 s on."""
    keep = speed(0, "rate", "linear", 2).replace(
        '<AbsoluteTargetSpeed value="0"/>',
        '<RelativeTargetSpeed entityRef="Ego" value="0" speedTargetValueType="delta" continuous="true"/>',
    )
    braking = speed(4, "rate", "linear", 3)
    stories = story("Target", event("K", keep, at(1))) + story("Ego", event("B", braking, at(8)))
    timeline = compiled(tmp_path, scenario(START, stories)).world.movers["Target"].timeline
    assert timeline.at(6.0).speed == pytest.approx(10.0)
    assert timeline.at(9.0).speed == pytest.approx(7.0)
    assert timeline.at(12.0).speed == pytest.approx(4.0)


def test_distances_along_a_lane(tmp_path):
    """An outer lane of a curve: 50 m along it are 50 / 1.00875 m along the line."""
    arc = road_file(road(0, 0, 0, 0, 1000, '<arc curvature="0.005"/>'))
    ahead = '<RelativeLanePosition entityRef="Ego" dLane="0" dsLane="50" offset="0"/>'
    init = START.replace(lane_position(160), ahead)
    place = compiled(tmp_path, scenario(init), arc).world.movers["Target"].place(0.0)
    expected = compiled(tmp_path, scenario(START), arc).world.network.road("0").at(100 + 50 / 1.00875, -1.75)
    assert place.distance(expected) < 1e-6


def test_what_moves_nothing(tmp_path):
    tilted = START.replace(lane_position(160), '<WorldPosition x="160" y="-1.75" h="0" p="0.1" r="3"/>')
    user = '<UserDefinedAction><CustomCommandAction type="x">y</CustomCommandAction></UserDefinedAction>'
    text = scenario(tilted, globals_=user, entities=vehicle("Ego") + vehicle("Target") + vehicle("Unplaced"))
    assert notes(tmp_path, text) == [
        "UserDefinedAction has no effect",
        "WorldPosition p has no effect: bodies are upright",
        "WorldPosition r has no effect: bodies are upright",
        "'Unplaced' has no position and is left out",
    ]
    assert compiled(tmp_path, text).contact == pytest.approx(5.6)


def test_a_change_of_the_weather(tmp_path):
    rain = weather('<Precipitation precipitationType="rain" precipitationIntensity="0.5"/>')
    change = f'<Event name="W" priority="parallel"><Action name="W">{rain}</Action>{at(2)}</Event>'
    assert compiled(tmp_path, scenario(START, story("Ego", change), globals_=rain)).weather == "rain"
    with pytest.raises(ValueError, match="a change of the weather from clear to rain is not supported"):
        compiled(tmp_path, scenario(START, story("Ego", change)))


def test_the_first_cells_of_a_file(tmp_path):
    path = write(tmp_path, scenario(START))
    assert len(read_cells(path, 1)) == 1
