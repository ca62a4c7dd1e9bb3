"""The rules' parameters, latches and gates on made-up answers, and whose eye is used."""

import numpy as np
import pytest

from lgmd_gym.agents import AGENTS, Rule, make_agent
from lgmd_gym.agents.rule import SensorReading, SteeringGate
from lgmd_gym.agents.stopping_zone import (
    GROUND_PITCH,
    LENS_HEIGHT,
    LENS_SETBACK,
    SPEEDS_KMH,
    excitation,
    stopping_distance,
    zone_of,
)
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import find_case
from lgmd_gym.benchmark.task import NO_BRAKE, Task, run_task

ZONES = len(SPEEDS_KMH)
RULES = [name for name, cls in AGENTS.items() if issubclass(cls, Rule)]


def potential(excited):
    return 1.0 / (1.0 + np.exp(-np.asarray(excited, float)))


def zone_sight(speed=13.0, yaw_rate=0.0, ground=None, upright=None):
    """Ground and upright excitation of the zone of `speed` (or of the zones in a dict)."""
    told = np.zeros(2 * ZONES)
    for offset, value in ((0, ground), (ZONES, upright)):
        for zone, level in ({zone_of(speed): value} if np.isscalar(value) else value or {}).items():
            told[offset + zone] = level
    return SensorReading(np.zeros(2 * ZONES), potential(told), speed, yaw_rate)


def brakes(agent, *many):
    judged = [agent.should_brake(one) for one in many]  # all of them, it counts frames
    return any(judged)


def test_excitation_is_equation_10_solved():
    assert excitation(potential([0.0, 1.3, 6.0])) == pytest.approx([0.0, 1.3, 6.0], abs=1e-9)
    assert excitation(np.float32(1.0)) == pytest.approx(15.0, abs=0.1)


def test_ground_and_upright_together_brake():
    both = zone_sight(ground=5.0, upright=1.0)
    agent = make_agent("stopping-zone:frames=2")
    assert not agent.should_brake(both)
    assert agent.should_brake(both)
    for alone in (zone_sight(ground=9.0), zone_sight(upright=9.0)):
        agent.reset(0)
        assert not brakes(agent, *[alone] * 30)


def test_an_upright_answer_counts_for_a_while():
    for pause, expected in ((3, True), (6, False)):
        agent = make_agent("stopping-zone:memory=6,frames=2,near_upright=5")
        seen = [zone_sight(upright=1.0), *[zone_sight()] * pause, *[zone_sight(ground=5.0)] * 2]
        assert brakes(agent, *seen) == expected


def test_other_zones_do_not_brake_but_nearer_ones_at_higher_levels():
    here = zone_of(13.0)
    for zone, upright, expected in ((here + 1, 9.0, False), (here - 1, 1.0, False), (here - 1, 2.0, True)):
        agent = make_agent("stopping-zone")
        sight = zone_sight(ground={zone: 5.0}, upright={zone: upright})
        assert brakes(agent, *[sight] * 10) == expected
        agent.reset(0)
        assert not brakes(agent, *[sight] * 3)  # a nearer zone needs four frames


@pytest.mark.parametrize(("zone_kmh", "expected"), [(10, False), (30, False), (40, True), (70, True)])
def test_at_speed_zones_for_less_than_half_of_it_do_not_count(zone_kmh, expected):
    """At 80 km/h the roadside is enough to excite upright fields made for 10 to 30."""
    zone = SPEEDS_KMH.index(zone_kmh)
    sight = zone_sight(speed=79.9 / 3.6, ground={zone: 9.0}, upright={zone: 9.0})
    assert brakes(make_agent("stopping-zone"), *[sight] * 10) == expected


def test_it_does_not_judge_while_turning_nor_crawling():
    agent = make_agent("stopping-zone:settle=5")
    threat = {"ground": 5.0, "upright": 2.0}
    assert not brakes(agent, *[zone_sight(yaw_rate=-0.1, **threat)] * 10, *[zone_sight(**threat)] * 4)
    assert brakes(agent, zone_sight(**threat), zone_sight(**threat))
    agent.reset(0)
    assert not brakes(agent, *[zone_sight(speed=1.0, **threat)] * 10)


def test_steering_gate_opens_after_its_frames():
    gate = SteeringGate(0.03, 2)
    yaw_rates = (0.0, 0.05, 0.0, 0.0, 0.0)
    assert [gate.open(rate) for rate in yaw_rates] == [True, False, False, True, True]


def test_zones_end_where_the_car_stops():
    agent = make_agent("stopping-zone:deceleration=8,reaction=0.5")
    ends = stopping_distance(np.array(SPEEDS_KMH) / 3.6, 8.0, 0.5)
    assert agent.zones == pytest.approx(ends)
    assert [zone_of(speed / 3.6) for speed in (0, 10, 10.1, 53, 90, 130)] == [0, 0, 1, 6, 9, 9]
    # The far end's ground lies on the upper edge of the ground field.
    for camera, end in zip(agent.camera, ends, strict=False):
        down = np.degrees(np.arctan(LENS_HEIGHT / (end + LENS_SETBACK)))
        height, width = camera["shape"]
        upper = camera["pitch_deg"] + camera["hfov_deg"] * height / width / 2
        assert camera["pitch_deg"] == pytest.approx(GROUND_PITCH * down, abs=1e-3)
        assert upper == pytest.approx(-down, rel=0.02)


def test_another_eye_is_refused_with_the_mend():
    one = SensorReading(np.zeros(1), np.full(1, 0.5), 8.0, 0.0)
    with pytest.raises(ValueError, match="needs its own eye of 20 cameras, got 1; leave --camera out"):
        make_agent("stopping-zone").should_brake(one)


def at(frequency, speed=8.0, yaw_rate=0.0):
    return SensorReading(np.array([frequency]), np.full(1, 0.5), speed, yaw_rate)


def test_adaptive_threshold_follows_the_scene():
    text = "adaptive-threshold:threshold=30,gain=3,memory=10,frames=1"
    agent = make_agent(text)
    for frequency in np.linspace(0.0, 60.0, 120):  # rises more slowly than the scene's mean forgets
        assert not agent.should_brake(at(frequency)) or frequency < 30
    assert not agent.should_brake(at(100.0))
    assert agent.should_brake(at(250.0))
    assert make_agent(text).should_brake(at(31.0))


def test_speed_gated_asks_for_more_at_speed():
    text = "speed-gated:threshold=30,per_speed=2,frames=1"
    assert make_agent(text).should_brake(at(50.0, speed=8.0))
    assert not make_agent(text).should_brake(at(50.0, speed=12.0))
    assert not make_agent(text).should_brake(at(50.0, speed=8.0, yaw_rate=0.2))


def test_options_come_from_toml_and_strings_go_over_them(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("ground = 2.5\nframes = 4\n")
    agent = make_agent(f"stopping-zone:toml={file},frames=5")
    assert (agent.params.ground, agent.params.frames, agent.params.upright) == (2.5, 5, 0.5)
    file.write_text("grund = 2.5\n")
    with pytest.raises(ValueError, match="did you mean 'ground'"):
        make_agent(f"stopping-zone:toml={file}")
    with pytest.raises(ValueError, match="cannot be read"):
        make_agent(f"stopping-zone:toml={tmp_path / 'none.toml'}")


@pytest.mark.parametrize("name", RULES)
def test_defaults_lie_in_what_tuning_searches(name):
    for item in AGENTS[name].Params.__dataclass_fields__.values():
        low, high = item.metadata["range"]
        assert low <= item.default <= high, f"{name}: {item.name}"


def test_the_agents_eye_is_used_where_the_user_names_none():
    agent = make_agent("stopping-zone")
    own = SensorConfig().for_agent(agent)
    assert own.camera == agent.camera
    assert own.label.startswith("ground10+ground20+")
    assert SensorConfig("tele").for_agent(agent).camera == "tele"
    assert SensorConfig().for_agent(make_agent("no-brake")).camera == "fovea"
    assert SensorConfig().for_agent(make_agent("frame-difference")).include_frame


def test_a_condition_is_laid_over_every_camera():
    eye = SensorConfig(["fovea", {"name": "x", "hfov_deg": 20.0}], condition="night")
    assert [item["condition"] for item in eye.arguments["camera"]] == ["night", "night"]
    assert eye.label == "fovea+x"
    with pytest.raises(ValueError, match="view from above"):
        _ = SensorConfig("birdseye", condition="fog").arguments


@pytest.mark.parametrize(
    ("name", "brakes"),
    [
        ("r152/CCRs/v42", True),
        # Followed nearer than the zone.
        pytest.param("fmvss127/CCRb/v80/brake0.5g-gap12", True, marks=pytest.mark.slow),
        ("false-reaction/SteelPlate/v60", False),
        pytest.param("false-reaction/CutOut/v50", False, marks=pytest.mark.slow),
    ],
)
def test_the_stopping_zone_in_closed_loop(name, brakes):
    case = find_case(name)
    truth = run_task(Task(NO_BRAKE, case, 0, SensorConfig())).counterfactual
    row = run_task(Task("stopping-zone", case, 0, SensorConfig(), truth)).row
    assert row["error"] is None
    assert row["camera"].startswith("ground10+")
    assert row["threat"] == brakes
    assert row["avoided"] if brakes else not row["false_activation"]


@pytest.mark.slow
def test_danger_zone_brakes_for_a_steel_plate():
    """What the upright fields are for: the ground fields alone brake for what lies flat."""
    case = find_case("false-reaction/SteelPlate/v60")
    truth = run_task(Task(NO_BRAKE, case, 0, SensorConfig())).counterfactual
    assert run_task(Task("danger-zone", case, 0, SensorConfig(), truth)).row["false_activation"]
