"""Suites from OpenSCENARIO files: names, conditions, catalogs, roads, errors, runs."""

import json
from dataclasses import replace

import gymnasium as gym
import pytest
from support.openscenario import (
    CORNER,
    HEADER,
    LANES,
    SPEED,
    START,
    STRAIGHT,
    SUN,
    compiled,
    event,
    lane_position,
    parameter,
    private,
    road,
    road_file,
    scenario,
    speed,
    story,
    teleport,
    values,
    varied,
    vehicle,
    weather,
    write,
)

from lgmd_gym.envs import Actor, RoadPlan, Scenario
from lgmd_gym.openscenario import read, read_all
from lgmd_gym.openscenario.reader import variants


def test_a_scenario_is_a_suite_of_one_case(tmp_path):
    suite = read(write(tmp_path, scenario(START), "my case.xosc"))
    (case,) = suite.cases
    assert (suite.name, case.name) == ("my-case", "my-case/my-case/v36")
    assert case.scenario.duration == pytest.approx(11.0)
    assert case.scenario.actors[0].gap == pytest.approx(50.0)
    rounded = replace(case.scenario.actors[0], gap=50.0)
    assert replace(case.scenario, duration=11.0, actors=(rounded,)) == Scenario(
        family="my-case",
        ego_speed=10.0,
        duration=11.0,
        # The centres are 60 m apart after 0.6 s, 5 s before the contact.
        actors=(Actor(gap=50.0, length=4.0, width=2.0, height=1.5),),
        ego_length=4.0,
        ego_width=2.0,
        road=RoadPlan(kind="two-way"),
    )
    assert not case.fcw_driver
    json.dumps(dict(case.arguments))  # plain data


def test_names_of_cells(tmp_path):
    more = parameter("Overlap", 100) + parameter("Scenario_ID", "CCRs", "string") + parameter("R2", 9)
    path = varied(
        tmp_path,
        values("Overlap", 100, -50),
        values("Ego_speed_kph", 30, 50),
        values("R2", 9),
        parameters=SPEED + more,
    )
    names = [case.name for case in read(path).cases]
    assert names == [
        "vary/CCRs/v30/overlap100",
        "vary/CCRs/v50/overlap100",
        "vary/CCRs/v30/overlap-50",
        "vary/CCRs/v50/overlap-50",
    ]


@pytest.mark.parametrize(
    ("cells", "expected"),
    [
        ([{"a": "1"}], ["v36"]),
        ([{"a": "1"}, {"a": "1"}], ["v36", "v36/2"]),
        ([{"R": "1", "alpha": "x"}, {"R": "2", "alpha": "y"}], ["v36/r1", "v36/r2"]),
        ([{"road": "../a/b_Lit.xodr", "light": "Sunny"}, {"road": "../a/b.xodr", "light": "Night"}],
         ["v36/sunny", "v36/night"]),
        ([{"GVT_init_speed_kph": "20"}, {"GVT_init_speed_kph": "30.5"}], ["v36/target20", "v36/target30.5"]),
        ([{"VRU_Entry": "NCAP_Adult"}, {"VRU_Entry": "NCAP Child!"}], ["v36/adult", "v36/ncap-child"]),
    ],
)  # fmt: skip
def test_variants_contain_what_differs(cells, expected):
    assert variants(cells, [10.0] * len(cells)) == expected


def test_fcw_cells_have_the_driver(tmp_path):
    assert read(varied(tmp_path, values("Ego_speed_kph", 50), name="CCRs_FCW")).cases[0].fcw_driver
    named = SPEED + parameter("Scenario_ID", "CCRs_FCW", "string")
    assert read(varied(tmp_path, values("Ego_speed_kph", 50), parameters=named)).cases[0].fcw_driver
    assert not read(varied(tmp_path, values("Ego_speed_kph", 50))).cases[0].fcw_driver


@pytest.mark.parametrize(
    ("inside", "expected"),
    [
        (SUN.format(100000), None),
        (SUN.format(50), None),
        (SUN.format(49), "night"),
        ('<Fog visualRange="999"/>', "fog"),
        ('<Fog visualRange="1000"/>', None),
        ('<Precipitation precipitationType="rain" precipitationIntensity="1"/>', "rain"),
        ('<Precipitation precipitationType="rain" precipitationIntensity="0"/>', None),
        ('<Precipitation precipitationType="dry" precipitationIntensity="0"/>', None),
    ],
)
def test_environments_set_the_weather(tmp_path, inside, expected):
    (case,) = read(write(tmp_path, scenario(START, globals_=weather(inside)))).cases
    assert dict(case.arguments).get("weather") == expected


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        (SUN.format(0) + '<Fog visualRange="9"/>', "the weathers fog, night cannot be combined; use one"),
        ('<Precipitation precipitationType="snow"/>', "precipitationType='snow' is not supported"),
    ],
)
def test_conditions_that_are_not_supported(tmp_path, inside, message):
    with pytest.raises(ValueError, match=message):
        read(write(tmp_path, scenario(START, globals_=weather(inside))))


CATALOG = f"""<OpenSCENARIO>{HEADER}<Catalog name="Cars">
<Vehicle name="Long" vehicleCategory="{{kind}}"><ParameterDeclarations>
<ParameterDeclaration name="length" parameterType="double" value="5"/></ParameterDeclarations>
<BoundingBox><Center x="1" y="0" z="1"/><Dimensions length="$length" width="2" height="1.5"/></BoundingBox>
</Vehicle><Pedestrian name="Walker" mass="80" pedestrianCategory="pedestrian"><BoundingBox>
<Center x="0" y="0" z="1"/><Dimensions length="0.6" width="0.5" height="1.8"/></BoundingBox></Pedestrian>
</Catalog></OpenSCENARIO>"""
LOCATIONS = '<VehicleCatalog><Directory path="catalogs"/></VehicleCatalog>'


def from_catalog(folder, entry="Long", kind="car", locations=LOCATIONS, assigned=""):
    (folder / "catalogs").mkdir(exist_ok=True)
    (folder / "catalogs" / "cars.xosc").write_text(CATALOG.format(kind=kind))
    reference = f'<CatalogReference catalogName="Cars" entryName="{entry}">{assigned}</CatalogReference>'
    entities = vehicle("Ego") + f'<ScenarioObject name="Target">{reference}</ScenarioObject>'
    return compiled(folder, scenario(START, entities=entities, catalogs=locations)).scenario.actors[0]


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("car", "car"),
        ("truck", "car"),
        ("motorbike", "motorcycle"),
        ("bicycle", "bicycle"),
        ("trailer", "box"),
    ],
)
def test_entries_of_catalogs(tmp_path, kind, expected):
    actor = from_catalog(tmp_path, kind=kind)
    assert (actor.kind, actor.length) == (expected, 5.0)


def test_parameters_of_entries(tmp_path):
    assigned = '<ParameterAssignment parameterRef="length" value="6.5"/>'
    assigned = f"<ParameterAssignments>{assigned}</ParameterAssignments>"
    assert from_catalog(tmp_path, assigned=assigned).length == 6.5
    assert from_catalog(tmp_path, "Walker").kind == "pedestrian"
    with pytest.raises(ValueError, match="unknown parameter 'width'"):
        from_catalog(tmp_path, assigned=assigned.replace('"length"', '"width"'))
    with pytest.raises(ValueError, match="unknown entry of catalog 'Cars' 'Lang'; did you mean 'Long'"):
        from_catalog(tmp_path, "Lang")
    with pytest.raises(ValueError, match="the folder 'cats' does not exist; check CatalogLocations"):
        from_catalog(tmp_path, locations=LOCATIONS.replace("catalogs", "cats"))
    with pytest.raises(ValueError, match="vehicleCategory='ship' is not supported"):
        from_catalog(tmp_path, kind="ship")


WIDE = LANES.replace('a="3.5"', 'a="28"')
THREE = (
    '<lanes><laneSection s="0"><right>'
    + "".join(
        f'<lane id="-{n}" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>'
        for n in (1, 2, 3)
    )
    + '<lane id="-4" type="border"><width sOffset="0" a="2" b="0" c="0" d="0"/></lane></right>'
    + "</laneSection></lanes>"
)
CROSSING = road_file(road(0, 0, 0, 0, 1000), road(1, 200, -100, 1.5707963267948966, 200))


@pytest.mark.parametrize(
    ("roads", "lane", "plan"),
    [
        (STRAIGHT, -1, RoadPlan(kind="two-way")),
        (road_file(road(0, 0, 0, 0, 1000, lanes=WIDE)), -1, RoadPlan()),
        (road_file(road(0, 0, 0, 0, 1000, lanes=THREE)), -1, RoadPlan(lanes=3, ego_lane=0)),
        (road_file(road(0, 0, 0, 0, 1000, lanes=THREE)), -3, RoadPlan(lanes=3, ego_lane=2)),
        (CROSSING, -1, RoadPlan(kind="crossing", distance=94.0)),
    ],
)
def test_road_plans(tmp_path, roads, lane, plan):
    """The contact is after 5.6 s at 10 m/s: the ego begins 6 m after s = 100 m."""
    init = private("Ego", f"<TeleportAction><Position>{lane_position(100, lane)}</Position></TeleportAction>",
                   speed(10)) + teleport("Target", lane_position(160, lane))  # fmt: skip
    found = compiled(tmp_path, scenario(init), roads)
    assert found.scenario.road.kind == plan.kind
    assert (found.scenario.road.lanes, found.scenario.road.ego_lane) == (plan.lanes, plan.ego_lane)
    assert found.scenario.road.distance == pytest.approx(plan.distance)


def test_the_plan_of_a_curve(tmp_path):
    """The ego's lane is 1.75 m outside of the line, of which 900 m are left."""
    arc = road(0, 0, 0, 0, 1000, '<arc curvature="0.005"/>')
    start = private(
        "Ego", f"<TeleportAction><Position>{lane_position(100)}</Position></TeleportAction>", speed(10)
    )
    plan = compiled(tmp_path, scenario(start, entities=vehicle("Ego")), road_file(arc)).scenario.road
    assert plan.kind == "curve"
    (bend,) = plan.bends
    assert plan.distance == 0.0
    assert bend.length == pytest.approx(900.0 * (1 + 1.75 * 0.005))
    assert bend.curvature == pytest.approx(0.005 / (1 + 1.75 * 0.005))
    # A spiral is drawn as arcs of at most 5 m; over the 250 m from s = 100 m it turns by 0.15 rad.
    spiral = arc.replace('<arc curvature="0.005"/>', '<spiral curvStart="0" curvEnd="0.005"/>')
    plan = compiled(tmp_path, scenario(start, entities=vehicle("Ego")), road_file(spiral)).scenario.road
    assert max(bend.length for bend in plan.bends) <= 5.0
    drawn, turn = sum(bend.length for bend in plan.bends), sum(bend.turn for bend in plan.bends)
    assert turn == pytest.approx(0.005 / 1000 / 2 * ((100 + drawn) ** 2 - 100**2), rel=2e-2)


def test_the_touched_entity_is_the_first_actor(tmp_path):
    entities = vehicle("Ego") + vehicle("Beside") + vehicle("Target")
    init = teleport("Beside", lane_position(130, 1)) + START
    found = compiled(tmp_path, scenario(init, entities=entities))
    assert found.target.name == "Target"
    assert found.scenario.actors[1].lateral_offset == pytest.approx(3.5)


def test_an_episode_keeps_the_acceleration_of_the_target(tmp_path):
    """The target accelerates from 0 to 2 s: the episode begins 1 s before. 116 m close with 6 m/s."""
    init = START.replace('s="160"', 's="220"')
    accelerate = event("E", speed(4, "rate", "linear", 2), "")
    found = compiled(tmp_path, scenario(init, story("Target", accelerate)))
    assert found.contact == pytest.approx((116 - 4) / 6)
    assert found.start == -1.0
    assert found.scenario.actors[0].profile[0].start == 1.0
    assert found.scenario.duration == pytest.approx(found.contact + 1.0 + 6.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("<Story name", "<Monitor/><Story name"), "Monitor in Storyboard is not supported; remove it"),
        (
            ('name="G"', 'name="G" shuffle="1"'),
            "ManeuverGroup shuffle is not supported; remove the attribute",
        ),
        (
            ('maximumExecutionCount="1"', 'maximumExecutionCount="x"'),
            "maximumExecutionCount must be a num",
        ),
        (
            ('maximumExecutionCount="1"', 'maximumExecutionCount="0.5"'),
            "ManeuverGroup maximumExecutionCount must be a whole number, got '0.5'",
        ),
        (('name="Ego"', 'name="Car"'), r"unknown entity 'Ego'"),
        (('name="Target"', 'name="Ego"'), "ScenarioObject name 'Ego' is used twice; choose another"),
        (('revMinor="3"', 'revMinor="4"'), "OpenSCENARIO 1.4 is not supported; use 1.0 to 1.3"),
        (('<Center x="0.0" y="0"', '<Center x="0.0" y="0.1"'), "a bounding box beside the centreline"),
        (
            ("<OpenSCENARIO>", '<!DOCTYPE a [<!ENTITY b "c">]><OpenSCENARIO>'),
            "a document type is not supported",
        ),
        (("</OpenSCENARIO>", ""), "not XML: no element found"),
        (("</Storyboard>", "</Storyboard><Extra/>"), "Extra in OpenSCENARIO is not supported"),
        (("road.xodr", "roads.xodr"), r"roads\.xodr cannot be read: No such file"),
        (('value="$v"', 'value="$w"'), "unknown parameter 'w'"),
        (('selectTriggeringEntities="false"', 'selectTriggeringEntities="true"'), "is not supported"),
    ],
)
def test_errors_state_file_and_line(tmp_path, change, message):
    text = scenario(START.replace('value="10"', 'value="$v"'), story("Target", event("E", speed(0))),
                    parameters=parameter("v", 10))  # fmt: skip
    assert change[0] in text
    with pytest.raises(ValueError, match=rf"(case\.xosc:\d+: .*)?{message}") as caught:
        read(write(tmp_path, text.replace(*change)))
    assert "\n" not in str(caught.value)
    assert str(tmp_path) in str(caught.value)


def test_files_without_a_scenario(tmp_path):
    path = tmp_path / "a.xosc"
    path.write_text(CATALOG.format(kind="car"))
    with pytest.raises(
        ValueError, match="no Storyboard or ParameterValueDistribution, got FileHeader, Catalog"
    ):
        read(path)
    with pytest.raises(ValueError, match="cannot be read: No such file or directory"):
        read(tmp_path / "b.xosc")
    with pytest.raises(ValueError, match="contains no scenario"):
        read_all([tmp_path])
    path.write_text("<Other/>")
    with pytest.raises(ValueError, match="must begin with OpenSCENARIO, got Other"):
        read(path)


def test_known_elements_without_effect(tmp_path):
    text = scenario(START).replace("<StopTrigger/>", "<StopTrigger><Anything unknown='1'/></StopTrigger>")
    text = text.replace(
        "<CatalogLocations>", "<VariableDeclarations><X/></VariableDeclarations><CatalogLocations>"
    )
    assert len(read(write(tmp_path, text)).cases) == 1


def test_corner_roads_are_read(tmp_path):
    assert compiled(
        tmp_path, scenario(START.replace('s="160"', 's="95"').replace('s="100"', 's="20"')), CORNER
    )


def test_the_environment_of_a_case(tmp_path):
    (case,) = read(write(tmp_path, scenario(START))).cases
    env = gym.make("LGMD/Scenario-v0", camera=None, **dict(case.arguments))
    env.reset(seed=0)
    for _ in range(149):
        _, _, terminated, _, info = env.step([0.0])
        assert not terminated
    _, _, terminated, _, info = env.step([0.0])
    assert terminated
    assert info["impact_speed"] == 10.0
