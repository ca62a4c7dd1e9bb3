"""Comparison with the intent of files, by hand."""

import os
from math import nan

import pytest
from support.openscenario import (
    START,
    at,
    compiled,
    entity_condition,
    event,
    lane_position,
    parameter,
    pedestrian,
    private,
    scenario,
    speed,
    story,
    teleport,
    vehicle,
    write,
)

from lgmd_gym.cli.main import run as run_command
from lgmd_gym.openscenario.check import check_file, check_files, intent_of, play

FILES = os.environ.get("LGMD_OPENSCENARIO_FILES")  # a copy of the Euro NCAP scenarios by Vector Informatik
EGO = private("Ego", f"<TeleportAction><Position>{lane_position(100)}</Position></TeleportAction>", speed(10))


def parameters(**values):
    return "".join(parameter(name, value, "string") for name, value in values.items())


def relative(offset, ahead=60):
    return teleport("Target", f'<RelativeObjectPosition entityRef="Ego" dx="{ahead}" dy="{offset}"/>')


REAR = {"Ego_speed_kph": 36, "Target_init_speed_kph": 0, "Ego_initTimeHeadway": 6}


def deviations(folder, init, stories="", entities="", **values):
    text = scenario(init, stories, entities, parameters(**values))
    result = check_file(write(folder, text))
    assert (result.cells, result.contacts) == (1, 1)
    return result.location, result.speed, result.time


@pytest.mark.parametrize(
    ("offset", "values", "expected"),
    [
        (0.5, {"ImpactLocation": 75}, 0.0),  # a quarter of 2 m to the left of the middle
        (0.5, {"ImpactLocation": 25}, 1.0),
        (-1.5, {"Overlap": -25}, 0.0),  # cars of 2 m with 0.5 m of overlap, to the right
        (0.0, {"Overlap": 100}, 0.0),
        (0.1, {}, 0.1),  # aligned without these parameters
    ],
)
def test_rear_scenarios(tmp_path, offset, values, expected):
    found = deviations(tmp_path, EGO + relative(offset), **REAR, **values)
    assert found == pytest.approx((expected, 0.0, 0.0), abs=1e-6)


def test_deviations_are_found(tmp_path):
    """The target is 1 m further away than 6 s at 10 m/s, which is 0.1 s later."""
    found = deviations(tmp_path, EGO + relative(0.0, 61), **REAR)
    assert found == pytest.approx((0.0, 0.0, 0.1), abs=1e-6)


@pytest.mark.parametrize("headway", [1.2, 2, 4])
def test_a_braking_target(tmp_path, headway):
    """After 2 s the target brakes from 10 to 1 m/s with 2 m/s², in 4.5 s, which closes a gap of 20.25 m."""
    brake = story("Target", event("E", speed(1, "rate", "linear", 2), at(2)))
    init = EGO + relative(0, 4 + 10 * headway) + private("Target", speed(10))
    values = {"Ego_speed_kph": 36, "Target_init_speed_kph": 36, "Target_final_speed_kph": 3.6}
    values |= {"isTargetbraking": "true", "Target_time_headway": headway, "Target_braking_delay": 2}
    found = deviations(tmp_path, init, brake, **values, Target_deceleration=2)
    assert found == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)


def test_a_target_that_starts(tmp_path):
    """The target starts when the gap is 16 m. It needs 0.8 s for 2 m until it has 5 m/s, and 2 s for 10 m: in
    these 2.8 s the ego drives 28 m."""
    near = (
        '<RelativeDistanceCondition entityRef="Target" relativeDistanceType="longitudinal" value="16" '
        'freespace="true" rule="lessOrEqual"/>'
    )
    start = story("Target", event("E", speed(5, "time", "linear", 0.8), entity_condition(near)))
    values = {"Ego_speed_kph": 36, "Target_final_speed_kph": 18, "Ego_initTTC": 6, "ImpactLocation": 50}
    values |= {"Target_accelerationDist": 2, "Target_steadyStateDist": 10}
    found = deviations(tmp_path, EGO + relative(0, 60 + 16), start, **values)
    assert found == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)


WALK = """<RoutingAction><FollowTrajectoryAction><TimeReference><None/></TimeReference>
<TrajectoryFollowingMode followingMode="position"/><TrajectoryRef><Trajectory name="t" closed="false"><Shape>
<Polyline><Vertex><Position><RoadPosition roadId="0" s="160" t="{0}"/></Position></Vertex>
<Vertex><Position><RoadPosition roadId="0" s="160" t="{1}"/></Position></Vertex></Polyline></Shape>
</Trajectory></TrajectoryRef></FollowTrajectoryAction></RoutingAction>"""
# The ego's front reaches the pedestrian's near side, 0.25 m before s = 160 m, at s = 157.75 m.
SYNC = """<SynchronizeAction masterEntityRef="Ego"><TargetPositionMaster><LanePosition roadId="0" laneId="-1"
s="{0}"/></TargetPositionMaster><TargetPosition><RoadPosition roadId="0" s="160" t="{1}"/></TargetPosition>
<FinalSpeed><AbsoluteSpeed value="1.5"><TargetDistanceSteadyState distance="2"/></AbsoluteSpeed></FinalSpeed>
</SynchronizeAction>"""


@pytest.mark.parametrize(("share", "t"), [(50, -1.75), (75, -1.25), (25, -2.25)])
@pytest.mark.parametrize("late", [0.0, 0.3])
def test_crossing_pedestrians(tmp_path, share, t, late):
    """The pedestrian walks to the left; the point 0.1 m ahead of its centre is at the share of the width."""
    entities = vehicle("Ego") + pedestrian("Target")
    init = EGO + private("Target", WALK.format(-6, 3))
    walk = story("Target", event("E", SYNC.format(157.75 + 10 * late, t - 0.1)))
    values = {"VRU_collisionPointOffset": 0.1, "ImpactLocation": share}
    found = deviations(tmp_path, init, walk, entities, **values)
    assert found == pytest.approx((1.5 * late, 0.0, late), abs=1e-3)


@pytest.mark.parametrize("reference", [0.0, 1.3])
def test_crossing_cars_are_compared_with_the_synchronisation(tmp_path, reference):
    """The front's middle is at t = -1.75 m when the ego's front reaches the target's side."""
    init = EGO + private("Target", WALK.format(-60, 30))
    drive = story("Target", event("E", SYNC.format(157, -3.75 - reference).replace('"1.5"', '"12"')))
    entities = vehicle("Ego") + vehicle("Target", x=reference)
    assert deviations(tmp_path, init, drive, entities) == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)


def test_files_without_an_intent(tmp_path):
    text = scenario(START)
    found = compiled(tmp_path, text)
    assert intent_of(found) is None
    assert play(found, 0.0).time == pytest.approx(5.6)
    result = check_file(write(tmp_path, text))
    assert (result.contacts, str(result.location), str(result.time)) == (1, str(nan), str(nan))


def test_cells_without_contact_are_counted(tmp_path):
    path = write(tmp_path, scenario(EGO + relative(3.5), parameters=parameters(**REAR)))
    assert (check_file(path).cells, check_file(path).contacts) == (1, 0)


def test_the_command_prints_one_row_per_file(tmp_path, capsys):
    for name, offset in (("one", 0.1), ("two", 0.25)):
        write(tmp_path, scenario(EGO + relative(offset), parameters=parameters(**REAR)), f"{name}.xosc")
    assert run_command(["scenario", "check", str(tmp_path), "--jobs", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    rows = [line.split()[1:] for line in lines if "/one " in line or "/two " in line]
    assert rows == [
        ["1", "1", "10.00", "0.000", "0.0000"],
        ["1", "1", "25.00", "0.000", "0.0000"],
    ]
    assert "2 files, 2 cells, 2 contacts with the target" in lines[-1]


@pytest.mark.slow
@pytest.mark.skipif(FILES is None, reason="LGMD_OPENSCENARIO_FILES names no folder of Euro NCAP scenarios")
def test_euro_ncap_files():
    """Every cell has contact; straight scenarios meet their intent within 1 cm, 0.01 km/h and 1 ms."""
    results = list(check_files([FILES], jobs=2))
    assert sum(item.cells for item in results) == 1183
    assert all(item.contacts == item.cells for item in results)
    for item in results:
        if not any(name in item.path.stem for name in ("tap", "CPTA", "CCFhol")):
            assert item.location < 0.01, item
            assert item.time < 1e-3, item
        assert item.speed < 0.003, item
