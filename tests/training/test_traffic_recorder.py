"""Segments of traffic episodes: which are recorded, and their time to brake."""

from dataclasses import astuple
from functools import partial

import numpy as np
import pytest
from support.traffic import BlockedHighway, EmptyHighway, Following, Recorded, Standing

from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.envs.appearance import Appearance
from lgmd_gym.envs.traffic.emergencies import Emergencies
from lgmd_gym.training.offline import traffic
from lgmd_gym.training.offline.traffic import (
    TrafficRecorder,
    brake_to_standstill,
    last_timely,
    run_episode,
    segment_bounds,
    threat_episode,
)

HIGHWAY, INTERSECTION = 0, 3  # seeds of these kinds of traffic


def test_long_stretches_are_divided_evenly():
    assert segment_bounds([True] * 29, 30.0) == []
    assert segment_bounds([True] * 300, 30.0) == [(0, 300)]
    assert segment_bounds([True] * 301, 30.0) == [(0, 150), (150, 301)]
    stretches = [True] * 40 + [False] * 5 + [True] * 20 + [False] + [True] * 601
    assert segment_bounds(stretches, 30.0) == [(0, 40), (66, 266), (266, 467), (467, 667)]


@pytest.mark.parametrize(
    ("emergencies", "expected_starts"),
    [
        (Emergencies(None, ()), [0.0, 10.0, 20.0]),
        (Emergencies(33.1, ()), [0.0, 10.0, 20.0]),  # more than 3 s after the end
        (Emergencies(32.0, ()), [0.0, 9.67, 19.33]),
        (Emergencies(None, (15.0, 15.1)), [0.0, 6.0, 15.13, 22.57]),
        (Emergencies(None, (3.0, 25.0)), [3.03, 12.53, 25.03]),
    ],
)
def test_segments_exclude_the_three_seconds_before_an_emergency(monkeypatch, emergencies, expected_starts):
    observations = [{"ego_speed": np.array([decision / 30.0], np.float32)} for decision in range(900)]
    monkeypatch.setattr(traffic, "run_episode", lambda *_: (observations, emergencies))
    (segments,) = TrafficRecorder("train", "fovea").record(range(1))
    assert all(np.isinf(segment.time_to_brake).all() and not segment.threat for segment in segments)
    times = [segment.observations["ego_speed"][:, 0] for segment in segments]
    assert [float(part[0]) for part in times] == pytest.approx(expected_starts, abs=0.01)
    for time in np.concatenate(times):
        assert emergencies.time_until(float(round(time * 30) / 30)) is None


@pytest.mark.parametrize("seed", [HIGHWAY, pytest.param(INTERSECTION, marks=pytest.mark.slow)])
def test_observations_equal_those_of_the_benchmark(monkeypatch, seed):
    config = {"duration": 12}
    in_fog = partial(traffic.make_traffic, config=config, world="laboratory")
    monkeypatch.setattr(traffic, "make_traffic", in_fog)
    monkeypatch.setattr(traffic, "draw_weather", lambda *_: ("fog", 1.0))
    monkeypatch.setattr(traffic, "segment_bounds", lambda non_threat, policy_hz: [(0, len(non_threat))])
    ((whole,),) = TrafficRecorder("train", "fovea").record(range(seed, seed + 1))
    appearance, sensors = Appearance(world="laboratory", weather="fog"), SensorConfig(camera="fovea")
    steps = Recorded(list(traffic.TRAFFIC_KINDS)[seed], seed, sensors, config, appearance).steps
    assert len(whole) == len(steps) - 1  # no action follows the last observation
    for name, array in whole.observations.items():
        assert np.array_equal(array, np.stack([step.observation[name] for step in steps[:-1]]))


def test_successive_seeds_have_the_kinds_in_turn(monkeypatch):
    made = []
    make_traffic = traffic.make_traffic

    def record_kind(kind, camera, params, **arguments):
        made.append((kind, params))
        return make_traffic(kind, camera, params=params, config={"duration": 1}, **arguments)

    monkeypatch.setattr(traffic, "make_traffic", record_kind)
    params = {"t_sp": 0.6}
    TrafficRecorder("train", "fovea", ("two-way", "highway"), params=params).record(range(4, 7))
    assert made == [("two-way", params), ("highway", params), ("two-way", params)]


def test_emergencies_equal_those_of_the_benchmark():
    """The episode has emergencies before and after its end, and the brake of a world."""
    kind, seed, config, world = "intersection", 8, {"duration": 4.5}, 0
    recording = Recorded(kind, seed, config=config, appearance=Appearance(world=world)).recording
    assert recording.scaled_emergency < 4.3
    env = traffic.make_traffic(kind, camera="fovea", config=config, world=world)
    contact, times = astuple(run_episode(env, seed)[1])
    assert min(times) < 4.5 < max(times)
    assert contact is None
    assert recording.scaled_emergencies == Emergencies(
        None, tuple(time for time in times if time <= 7.5 + 1e-9)
    )


def observations_of(env, seed=0):
    """Return the observations of an episode without braking, the ego speed only."""
    _, info = env.reset(seed=seed)
    found, done = [], False
    while not done:
        found.append({"ego_speed": np.array([info["ego_speed"]], np.float32)})
        info, done = env.advance()
    return found


def test_segment_before_a_contact_has_its_time_to_brake():
    """The contact is after 4.57 s; full braking avoids it up to 3.3 s."""
    observations = observations_of(Following())
    episode = threat_episode(Following(), 0, observations)
    assert (episode.threat, episode.family, len(episode)) == (True, "traffic", 137)
    assert not episode.demands.any()
    last = int(np.argmax(episode.time_to_brake == 0.0))
    assert 95 <= last <= 101
    assert episode.time_to_brake == pytest.approx(np.maximum(last - np.arange(137), 0) / 30.0)
    for decision, avoided in ((last, True), (last + 1, False)):
        env = Following()
        env.reset(seed=0)
        for _ in range(decision):
            env.advance()
        assert brake_to_standstill(env) is avoided


def test_segment_before_a_contact_is_at_most_ten_seconds_long():
    class Late(Following):
        glances, brakings = ((9.0, 13.0),), ((9.5, 12.5, 8.0),)

    observations = observations_of(Late())
    assert len(observations) > 310
    episode = threat_episode(Late(), 0, observations)
    assert len(episode) == 300
    assert episode.observations["ego_speed"][0] == observations[-300]["ego_speed"]


def test_contacts_that_no_braking_avoids_are_left_out():
    class Close(BlockedHighway):
        stationary_car_at = 14.0

    observations = observations_of(Close())
    assert threat_episode(Close(), 0, observations) is None
    observations = observations_of(Standing())
    assert threat_episode(Standing(), 0, observations) is None


@pytest.mark.parametrize(("contact", "threats"), [(30.0, 1), (30.0 + 1 / 30, 0), (None, 0)])
def test_a_contact_after_the_end_of_the_drive_is_no_threat(monkeypatch, contact, threats):
    observations = [{"ego_speed": np.zeros(1, np.float32)}] * 900
    monkeypatch.setattr(traffic, "run_episode", lambda *_: (observations, Emergencies(contact, ())))
    monkeypatch.setattr(traffic, "threat_episode", lambda *_: "threat")
    (segments,) = TrafficRecorder("train", "fovea", ("inattentive-highway",)).record(range(1))
    assert segments.count("threat") == threats


@pytest.mark.parametrize(
    ("kind", "contact", "kept"),
    [
        ("inattentive-highway", 30.0, 600),
        ("inattentive-highway", 30.1, 813),  # after the end of the drive: 3 s are lost
        ("highway", 30.0, 810),
    ],
)
def test_segments_without_threat_end_ten_seconds_before_a_contact_of_drivers_who_err(
    monkeypatch, kind, contact, kept
):
    observations = [{"ego_speed": np.array([decision / 30.0], np.float32)} for decision in range(900)]
    monkeypatch.setattr(traffic, "run_episode", lambda *_: (observations, Emergencies(contact, ())))
    monkeypatch.setattr(traffic, "threat_episode", lambda *_: None)
    (segments,) = TrafficRecorder("train", "fovea", (kind,)).record(range(1))
    assert sum(map(len, segments)) == kept


def test_a_twin_that_does_not_repeat_the_contact_is_rejected():
    observations = observations_of(Following())
    with pytest.raises(RuntimeError, match="does not repeat its contact at decision 137"):
        threat_episode(EmptyHighway(), 0, observations)


@pytest.mark.parametrize("last", [None, 0, 3, 5, 6, 17, 18, 37, 58, 59])
def test_the_last_decision_in_time_is_found_with_few_replays(last):
    replayed = []

    def avoids(onset):
        replayed.append(onset)
        return last is not None and onset <= last

    assert last_timely(60, avoids) == last
    assert len(replayed) == len(set(replayed)) <= 11 + 3


def test_the_only_decision():
    assert last_timely(1, lambda onset: True) == 0
    assert last_timely(1, lambda onset: False) is None


def test_a_stop_on_an_empty_road_avoids_a_contact():
    env = EmptyHighway()
    env.reset(seed=0)
    assert brake_to_standstill(env)
    assert env.ego.speed == 0.0


def test_kinds_with_drivers_who_err_add_segments_before_contacts(monkeypatch):
    make_traffic, made = traffic.make_traffic, []

    def short(kind, **arguments):
        made.append((kind, arguments.get("attention"), arguments["camera"]))
        return make_traffic(kind, config={"duration": 12}, **arguments)

    monkeypatch.setattr(traffic, "make_traffic", short)
    camera = {"name": "wide", "shape": (8, 8)}
    kinds = ("inattentive-two-way", "two-way")
    erring, attentive = TrafficRecorder("validation", camera, kinds).record(range(20_000, 20_002))
    assert not any(episode.threat for episode in attentive)
    assert {kind for kind, *_ in made} == {"two-way"}
    assert {attention for _, attention, _ in made} == {"inattentive", None}
    assert any(camera is None for *_, camera in made) == any(episode.threat for episode in erring)
