"""The rule `stopping-zone`: geometry of its zones, its condition, and closed-loop episodes."""

import numpy as np
import pytest
from support.agents import any_brake, frequency_reading, zone_reading

from lgmd_gym.agents import make_agent
from lgmd_gym.agents.rule import SensorReading
from lgmd_gym.agents.zones import FIELDS, LENS_HEIGHT, LENS_SETBACK, SPEEDS_KMH, zone_ends, zone_index
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import find_case
from lgmd_gym.benchmark.task import NO_BRAKE, Task, run_task


def test_zones_end_at_the_stopping_distance():
    """At 36 km/h: 10² / (2 · 8) + 0.5 · 10 = 11.25 m."""
    ends = zone_ends(8.0, 0.5)
    assert np.interp(40, SPEEDS_KMH, ends) == pytest.approx((40 / 3.6) ** 2 / 16 + 0.5 * 40 / 3.6)
    assert [zone_index(speed / 3.6) for speed in (0, 10, 10.1, 53, 90, 130)] == [0, 0, 1, 6, 9, 9]


def test_the_upper_edge_of_each_ground_field_is_the_far_end_of_its_zone():
    ends = zone_ends(8.0, 0.5)
    cameras = make_agent("stopping-zone:deceleration=8,reaction=0.5").camera
    for camera, end in zip(cameras, ends, strict=False):
        down = np.degrees(np.arctan(LENS_HEIGHT / (end + LENS_SETBACK)))
        height, width = camera["shape"]
        upper_edge = camera["pitch_deg"] + camera["hfov_deg"] * height / width / 2
        assert camera["pitch_deg"] == pytest.approx(FIELDS["ground"][1] * down, abs=1e-3)
        assert upper_edge == pytest.approx(-down, rel=0.02)


def test_ground_and_upright_fields_together_brake():
    both = zone_reading(ground=5.0, upright=1.0)
    agent = make_agent("stopping-zone:frames=2")
    assert not agent.should_brake(both)
    assert agent.should_brake(both)
    for alone in (zone_reading(ground=9.0), zone_reading(upright=9.0)):
        agent.reset(0)
        assert not any_brake(agent, [alone] * 30)


def test_an_upright_excitation_counts_for_the_frames_of_memory():
    for pause, expected in ((3, True), (6, False)):
        agent = make_agent("stopping-zone:memory=6,frames=2,near_upright=5")
        readings = [zone_reading(upright=1.0), *[zone_reading()] * pause, *[zone_reading(ground=5.0)] * 2]
        assert any_brake(agent, readings) == expected


def test_nearer_zones_brake_at_higher_thresholds_and_farther_zones_never():
    zone = zone_index(13.0)
    for other, upright, expected in ((zone + 1, 9.0, False), (zone - 1, 1.0, False), (zone - 1, 2.0, True)):
        agent = make_agent("stopping-zone")
        reading = zone_reading(ground={other: 5.0}, upright={other: upright})
        assert any_brake(agent, [reading] * 10) == expected
        agent.reset(0)
        assert not any_brake(agent, [reading] * 3)  # nearer zones require four frames


@pytest.mark.parametrize(("zone_kmh", "expected"), [(10, False), (30, False), (40, True), (70, True)])
def test_zones_for_less_than_half_the_ego_speed_are_ignored(zone_kmh, expected):
    zone = SPEEDS_KMH.index(zone_kmh)
    reading = zone_reading(speed=79.9 / 3.6, ground={zone: 9.0}, upright={zone: 9.0})
    assert any_brake(make_agent("stopping-zone"), [reading] * 10) == expected


def test_the_rule_is_inactive_in_turns_and_at_a_crawl():
    agent = make_agent("stopping-zone:settle=5")
    threat = {"ground": 5.0, "upright": 2.0}
    turn = [zone_reading(yaw_rate=-0.1, **threat)] * 10
    assert not any_brake(agent, [*turn, *[zone_reading(**threat)] * 4])
    assert any_brake(agent, [zone_reading(**threat)] * 2)
    agent.reset(0)
    assert not any_brake(agent, [zone_reading(speed=2.5, **threat)] * 10)
    assert any_brake(agent, [zone_reading(speed=2.51, **threat)] * 10)


def first_brake(agent, potential, speed, yaw_rate):
    """Return the index of the first reading at which the rule brakes, or None."""
    agent.reset(0)
    for index, values in enumerate(zip(potential, potential, speed, yaw_rate, strict=True)):
        if agent.should_brake(SensorReading(*values)):
            return index
    return None


@pytest.mark.parametrize("options", ["", ":frames=4,memory=5,near_frames=2,settle=4,near_share=0.3"])
def test_readings_of_cameras_that_are_not_in_use_have_no_effect(options):
    rng, agent = np.random.default_rng(7), make_agent(f"stopping-zone{options}")
    braked = 0
    for _ in range(60):
        speed = np.clip(10 + np.cumsum(rng.normal(0.0, 0.6, 150)), 0.0, 28.0)
        yaw_rate = np.where(rng.uniform(size=150) < 0.02, 0.1, 0.0)
        # Levels that persist for some frames, mostly below the thresholds.
        levels = np.repeat(rng.exponential(rng.uniform(0.3, 1.5), (30, 20)), 5, axis=0)
        potential, arbitrary = 1 / (1 + np.exp(-levels)), rng.uniform(0.5, 1.0, levels.shape)
        first = agent.cameras_in_use(speed, yaw_rate)
        assert not first[:, 10:].any()
        partial = np.where(first, potential, arbitrary)
        read = agent.cameras_in_use(speed, yaw_rate, partial)
        assert (read >= first).all()
        expected = first_brake(agent, potential, speed, yaw_rate)
        assert first_brake(agent, np.where(read, potential, arbitrary), speed, yaw_rate) == expected
        braked += expected is not None
    assert 10 < braked < 60


@pytest.mark.parametrize(("name", "cameras"), [("stopping-zone", 20), ("danger-zone", 10)])
def test_other_cameras_are_rejected(name, cameras):
    with pytest.raises(ValueError, match=f"{name} requires its own {cameras} cameras, got 1; leave --camera"):
        make_agent(name).should_brake(frequency_reading(0.0))


def play(agent, case):
    counterfactual = run_task(Task(NO_BRAKE, case, 0, SensorConfig())).counterfactual
    return run_task(Task(agent, case, 0, SensorConfig(), counterfactual)).row


@pytest.mark.parametrize(
    ("name", "threat"),
    [
        ("r152/CCRs/v42", True),
        # A lead car nearer than the zone from the start.
        pytest.param("fmvss127/CCRb/v80/brake0.5g-gap12", True, marks=pytest.mark.slow),
        ("false-reaction/SteelPlate/v60", False),
        pytest.param("false-reaction/CutOut/v50", False, marks=pytest.mark.slow),
    ],
)
def test_the_rule_brakes_exactly_for_the_threat(name, threat):
    row = play("stopping-zone", find_case(name))
    assert row["error"] is None
    assert row["camera"].startswith("ground10+")
    assert row["threat"] == threat
    assert row["avoided"] if threat else not row["false_activation"]


@pytest.mark.slow
def test_danger_zone_brakes_for_a_steel_plate():
    """Without upright fields, a flat object is a false activation."""
    assert play("danger-zone", find_case("false-reaction/SteelPlate/v60"))["false_activation"]
