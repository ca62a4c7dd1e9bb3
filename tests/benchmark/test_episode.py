"""Cases, cameras and the episodes that they define."""

import json

import numpy as np
import pytest

from lgmd_gym.agents import AGENTS, BatchAgent, make_agent
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.episode import make_env
from lgmd_gym.benchmark.metrics import Counterfactual
from lgmd_gym.benchmark.player import play_agent, run_task
from lgmd_gym.benchmark.recorder import SERIES
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import SUITES, find_case, find_suite
from lgmd_gym.benchmark.task import Task
from lgmd_gym.camera import Camera
from lgmd_gym.envs.families import LEVELS
from lgmd_gym.sensing.channel import Channel

SLOW_APPROACH = Case("test", "CCRs", "v20", (("ego_speed", 5.556),))
THREAT = Counterfactual(True, 5.0, 10.0)


def test_night_case_renders_dark_frames():
    means = {}
    for name in ("CPNA/v30/location50", "CPNA/v30/location50-night"):
        env = make_env(find_case(f"ncap2026/{name}"), SensorConfig("wide"))
        env.reset(seed=0)
        means[name] = env.get_wrapper_attr("frames")["wide"].mean()
        env.close()
    day, night = means.values()
    assert night < 0.5 * day


@pytest.mark.parametrize("channel", [Camera(hfov_deg=7.0), Channel(camera="tele", neuron="dsn", columns=5)])
def test_plain_cameras_give_the_same_channels(channel):
    config = SensorConfig(["fovea", channel])
    assert config.plain.channels == config.channels
    assert json.loads(json.dumps(config.plain.camera)) == config.plain.camera


def test_the_top_view_shows_no_weather():
    with pytest.raises(ValueError, match="'birdseye' does not support condition 'fog'; use 'clear'"):
        RunConfig(camera="birdseye").sensors("fog")
    assert RunConfig(camera="birdseye").sensors("mixed").has_top_view


def test_suite_cases_have_distinct_names_and_valid_scenarios():
    offenders = []
    for suite in SUITES.values():
        names = [case.name for case in suite.cases]
        offenders += [name for name in set(names) if names.count(name) > 1]
        for case in suite.cases:
            family = LEVELS[case.family].family if case.family in LEVELS else case.family
            valid = case.suite == suite.name and f"/{case.family}/" in case.name
            valid = valid and family == case.scenario.family
            if f"/{case.family}/v" in case.name:
                valid = valid and f"/v{case.scenario.ego_speed * 3.6:.0f}" in case.name
            if not valid or find_case(case.name) != case:
                offenders.append(case.name)
    assert offenders == []


def test_unknown_suite_and_case_suggest_the_nearest_name():
    with pytest.raises(ValueError, match="unknown suite 'quik'; did you mean 'quick'"):
        find_suite("quik")
    with pytest.raises(ValueError, match="did you mean 'quick/CCRs/v30'"):
        find_case("quick/CCRs/v3")


def test_played_episode_has_contact_at_the_expected_time_and_speed():
    played = play_agent(Task("no-brake", SLOW_APPROACH, 0, SensorConfig()), make_agent("no-brake").agent)
    assert played.collision
    assert played.relative_impact_speed == pytest.approx(5.556)
    assert Counterfactual.of(played).contact_time == pytest.approx(5.0, abs=0.05)
    assert played.series["spike_frequency"].max() > 30
    assert tuple(played.series) == SERIES
    assert {len(values) for values in played.series.values()} == {len(played.series["time"])}


class Broken(BatchAgent):
    """Raises an exception in the middle of an episode."""

    name = "broken"

    def demands(self, observations, infos, active):
        if infos["ttc"] < 4:
            raise RuntimeError("internal failure")
        return np.zeros(1)


def test_exception_of_an_agent_becomes_an_error_row(monkeypatch):
    monkeypatch.setitem(AGENTS, "broken", Broken)
    result = run_task(Task("broken", SLOW_APPROACH, 0, SensorConfig(), THREAT))
    assert "internal failure" in result.row["error"]
    assert result.row["collision"] is None
