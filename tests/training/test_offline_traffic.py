"""Segments of traffic episodes: which are recorded, and the return of braking in them."""

from dataclasses import astuple
from functools import partial

import numpy as np
import pytest
from support.recordings import offline_config
from support.traffic import Recorded

from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.envs.appearance import Appearance
from lgmd_gym.envs.traffic.emergencies import Emergencies
from lgmd_gym.training.offline import traffic
from lgmd_gym.training.offline.recorder import EpisodeRecorder
from lgmd_gym.training.offline.traffic import (
    TrafficRecorder,
    non_threat_episode,
    run_episode,
    segment_bounds,
)

HIGHWAY, INTERSECTION = 0, 3  # seeds of these kinds of traffic


@pytest.mark.parametrize(("env_id", "speed"), [("LGMD/EmptyRoad-v0", 12.0), ("LGMD/Following-v0", 20.0)])
def test_computed_returns_equal_replays_in_braking_env(tmp_path, env_id, speed):
    config = offline_config(tmp_path, env_id, env_kwargs={"ego_speed": speed, "world": "laboratory"})
    ((replayed,),) = EpisodeRecorder(partial(config.make_env, "train"), hold=0, brake=1).record(range(1))
    computed = non_threat_episode(replayed.observations, 30.0)
    assert not replayed.threat
    assert replayed.observations["ego_speed"] == pytest.approx(speed)
    assert computed.rewards == pytest.approx(replayed.rewards, abs=1e-3)
    # The jerk costs 0.05 at the start and 0.05 at the standstill and is neglected.
    assert computed.braking_returns[:-30] == pytest.approx(replayed.braking_returns[:-30], abs=0.2)


def test_braking_at_standstill_costs_nothing():
    episode = non_threat_episode({"ego_speed": np.zeros((60, 1), np.float32)}, 30.0)
    assert not episode.rewards.any()
    assert not episode.braking_returns.any()


def test_braking_near_the_end_costs_the_remaining_time():
    episode = non_threat_episode({"ego_speed": np.full((60, 1), 20.0, np.float32)}, 30.0)
    assert episode.braking_returns[-1] == pytest.approx(episode.rewards[-1])  # within the brake's dead time
    # With 1 s left: 0.233 s dead time and build-up, 0.767 s at 9 m/s², which cost 2 per second, over 17.36 m.
    assert episode.braking_returns[-30] == pytest.approx(17.355 / 20.0 - 2.0 * 0.7667, abs=1e-3)


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
        (Emergencies(41.0, ()), [0.0, 10.0, 20.0]),  # more than 10 s after the end
        (Emergencies(39.0, ()), [0.0, 9.67, 19.33]),
        (Emergencies(None, (15.0, 15.1)), [0.0, 15.13, 22.57]),
        (Emergencies(None, (5.0, 25.0)), [5.03, 25.03]),
    ],
)
def test_segments_exclude_the_ten_seconds_before_an_emergency(monkeypatch, emergencies, expected_starts):
    observations = [{"ego_speed": np.array([decision / 30.0], np.float32)} for decision in range(900)]
    monkeypatch.setattr(traffic, "run_episode", lambda *_: (observations, emergencies))
    (segments,) = TrafficRecorder("train", "fovea").record(range(1))
    times = [segment.observations["ego_speed"][:, 0] for segment in segments]
    assert [float(part[0]) for part in times] == pytest.approx(expected_starts, abs=0.01)
    for time in np.concatenate(times):
        assert emergencies.time_until(float(round(time * 30) / 30), 10.0) is None


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
    """The episode has emergencies before and after its end."""
    kind, seed, config = "intersection", 8, {"duration": 4.5}
    recording = Recorded(kind, seed, config=config).recording
    env = traffic.make_traffic(kind, camera="fovea", config=config)
    contact, times = astuple(run_episode(env, seed)[1])
    assert min(times) < 4.5 < max(times)
    assert contact is None
    assert recording.emergencies == Emergencies(None, tuple(time for time in times if time <= 7.5 + 1e-9))
