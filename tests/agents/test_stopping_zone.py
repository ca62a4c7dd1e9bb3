"""The rule `stopping-zone`: geometry of its fields, its condition, and closed-loop episodes."""

import numpy as np
import pytest
from support.agents import any_brake, reading, should_brake, zone_reading
from support.roads import straight_env

from lgmd_gym.agents import make_agent
from lgmd_gym.agents.zones import CAMERA_SETBACK, FIELDS, REACHES, SPAN_M, stopping_distance, zone_cameras
from lgmd_gym.benchmark.player import run_task
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import find_case
from lgmd_gym.benchmark.task import NO_BRAKE, Task
from lgmd_gym.camera import EgoCamera

BOTH = {"upright": 1.0, "low": 2.0}
THREAT = {"ground": 5.0, **BOTH}


def test_stopping_distance_by_hand():
    """At 36 km/h: 10² / (2 · 8) + 0.5 · 10 = 11.25 m."""
    assert stopping_distance(10.0, 8.0, 0.5) == 11.25


@pytest.mark.parametrize("speed", [8.0, 20.0, 33.0])
def test_fields_cover_the_rows_of_their_zones(speed):
    """Rows of the lane ahead in units of the angle down to the far end: the far end itself is at -1."""
    env, checked = straight_env(speed=speed), 0
    for camera in zone_cameras(8.0, 0.5):
        ego_camera = EgoCamera(camera)
        ego_camera.render(env)
        height, width = camera["shape"]
        distance = camera["gaze"]["reach"] * stopping_distance(speed, 8.0, 0.5)
        x, y = distance + env.vehicle.LENGTH / 2, env.vehicle.position[1]
        (left, far), (right, _) = ego_camera.project([(x, y - SPAN_M / 2, 0.0), (x, y + SPAN_M / 2, 0.0)])
        # A unit is the angle 1.2 m / depth: half of the width in pixels.
        lowest, highest = (-1.0 + (far - row) * 2.0 / width for row in (height, 0))
        expected = {"ground": (-1.43, -0.98), "low": (-0.9, -0.3), "upright": (-0.15, 0.35)}
        kind = next(kind for kind in FIELDS if camera["name"].startswith(kind))
        if distance + CAMERA_SETBACK > 8.0:  # nearer, angles are not proportional to rows
            assert (left, right) == pytest.approx((0.0, width), abs=0.7)
            assert (lowest, highest) == pytest.approx(expected[kind], abs=0.02)
            checked += 1
    assert checked >= 6


def test_a_ground_field_with_an_upright_and_a_low_field_brakes():
    agent = make_agent("stopping-zone:frames=2,upright_frames=2,low_frames=2")
    both = zone_reading(**THREAT)
    assert not should_brake(agent, both)
    assert should_brake(agent, both)
    for missing in THREAT:
        agent.reset(0)
        others = zone_reading(**{name: level for name, level in THREAT.items() if name != missing})
        assert not any_brake(agent, [others] * 30)


@pytest.mark.parametrize("name", ["ground", "upright", "low"])
def test_thresholds_and_numbers_of_frames(name):
    frames = {"ground": "frames", "upright": "upright_frames", "low": "low_frames"}[name]
    agent = make_agent(f"stopping-zone:ground=3,upright=0.5,low=1.5,{frames}=5,memory=1")
    limit = {"ground": 3.0, "upright": 0.5, "low": 1.5}[name]
    for level, count, expected in ((limit, 5, True), (limit, 4, False), (limit - 0.01, 9, False)):
        agent.reset(0)
        others = [zone_reading(**THREAT | {name: 0.0})] * 9
        assert any_brake(agent, [*others, *[zone_reading(**THREAT | {name: level})] * count]) == expected


@pytest.mark.parametrize(("pause", "expected"), [(3, True), (5, False)])
def test_upright_and_low_excitations_count_for_the_frames_of_memory(pause, expected):
    agent = make_agent("stopping-zone:memory=6,frames=2,upright_frames=3")
    readings = [*[zone_reading(**BOTH)] * 3, *[zone_reading()] * pause, *[zone_reading(ground=5.0)] * 2]
    assert any_brake(agent, readings) == expected


@pytest.mark.parametrize("reach", REACHES)
def test_every_zone_brakes_on_its_own_fields_and_the_nearest_low_field(reach):
    low = {0.28: 0.75, 0.4: 0.75, 0.55: 0.75, 1.8: 1.35}.get(reach, reach)
    zone = zone_reading(ground={reach: 5.0}, upright={reach: 1.0}, low={low: 2.0})
    assert any_brake(make_agent("stopping-zone:reach=1.8"), [zone] * 10)
    assert any_brake(make_agent("stopping-zone:reach=0.75"), [zone] * 10) == (reach <= 0.75)
    for other in REACHES:
        mixed = zone_reading(ground={reach: 5.0}, upright={other: 1.0}, low={low: 2.0})
        assert any_brake(make_agent("stopping-zone:reach=1.8"), [mixed] * 10) == (other == reach)


def test_the_rule_is_inactive_in_turns_and_at_a_crawl():
    agent = make_agent("stopping-zone:yaw_rate=0.05,crawl=1")
    assert not any_brake(agent, [zone_reading(yaw_rate=-0.06, **THREAT)] * 10)
    assert should_brake(agent, zone_reading(yaw_rate=0.04, **THREAT))  # the streaks are kept
    agent.reset(0)
    assert not any_brake(agent, [zone_reading(speed=1.0, **THREAT)] * 10)
    assert any_brake(agent, [zone_reading(speed=1.01, **THREAT)] * 2)


@pytest.mark.parametrize(("name", "cameras"), [("stopping-zone", 17), ("danger-zone", 1)])
def test_other_cameras_are_rejected(name, cameras):
    three = reading(0.0, np.full(3, 0.5), 8.0, 0.0)
    with pytest.raises(ValueError, match=f"{name} requires its own {cameras} cameras, got 3; leave --camera"):
        should_brake(make_agent(name), three)


def play(agent, case):
    counterfactual = run_task(Task(NO_BRAKE, case, 0, SensorConfig())).counterfactual
    return run_task(Task(agent, case, 0, SensorConfig(), counterfactual)).row


@pytest.mark.parametrize(
    ("name", "threat"),
    [
        ("r152/CCRs/v42", True),
        # A lead car nearer than the stopping distance from the start.
        pytest.param("fmvss127/CCRb/v80/brake0.3g-gap12", True, marks=pytest.mark.slow),
        ("false-reaction/SteelPlate/v60", False),
        pytest.param("false-reaction/CutOut/v50", False, marks=pytest.mark.slow),
    ],
)
def test_the_rule_brakes_exactly_for_the_threat(name, threat):
    row = play("stopping-zone", find_case(name))
    assert row["error"] is None
    assert row["camera"].startswith("ground0.28+")
    assert row["threat"] == threat
    assert row["avoided"] if threat else not row["false_activation"]


@pytest.mark.slow
def test_danger_zone_brakes_for_a_steel_plate():
    """Without upright fields, a flat object is a false activation."""
    assert play("danger-zone", find_case("false-reaction/SteelPlate/v60"))["false_activation"]
