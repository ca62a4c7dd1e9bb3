"""Scenarios as plain data, and the environment that takes them."""

import json
import tomllib
import warnings

import gymnasium as gym
import numpy as np
import pytest
import tomli_w
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env
from support.rollouts import HOLD, rollout

import lgmd_gym  # noqa: F401  (registers the ids)
from lgmd_gym.envs import FAMILIES, Actor, Bend, BrakingEnv, RoadPlan, Scenario, Segment, make_scenario
from lgmd_gym.envs.families.data import scenario_from_data, scenario_to_data

DATA = {
    "family": "mine",
    "ego_speed": 12.0,
    "duration": 6.0,
    "ego_profile": [{"start": 1.0, "acceleration": -2.0, "final_speed": 8.0}],
    "ego_path": [{"length": 20.0, "curvature": 0.01, "end_curvature": 0.02}],
    "road": {"kind": "curve", "distance": 5.0, "bends": [{"length": 9.0, "curvature": 0.02}]},
    "actors": [{"gap": 40.0, "shade": 50, "kind": "box"}, {"gap": 60.0, "profile": [], "path": []}],
}
MINE = Scenario(
    family="mine",
    ego_speed=12.0,
    duration=6.0,
    ego_profile=(Segment(start=1.0, acceleration=-2.0, final_speed=8.0),),
    ego_path=(Bend(20.0, 0.01, 0.02),),
    road=RoadPlan(kind="curve", distance=5.0, bends=(Bend(9.0, 0.02),)),
    actors=(Actor(gap=40.0, shade=50, kind="box"), Actor(gap=60.0)),
)
SMALL = {"family": "mine", "ego_speed": 12.0, "duration": 6.0, "actors": [{"gap": 30.0}]}


def test_data_are_scenarios():
    assert scenario_from_data(DATA) == MINE
    assert scenario_from_data(MINE) is MINE
    assert scenario_to_data(make_scenario("CCRs", ego_speed=10.0)) == {
        "family": "CCRs", "ego_speed": 10.0, "duration": 11.0, "actors": [{"gap": 50.0}]
    }  # fmt: skip


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_survives_toml_and_json(family):
    scenario = make_scenario(family)
    data = scenario_to_data(scenario)
    assert scenario_from_data(tomllib.loads(tomli_w.dumps(data))) == scenario
    assert scenario_from_data(json.loads(json.dumps(data))) == scenario


def changed(**values):
    return DATA | values


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (changed(ego_sped=3.0), "unknown key of scenario 'ego_sped'; did you mean 'ego_speed'"),
        (changed(actors=[{"gaps": 3.0}]), r"unknown key of scenario.actors\[0\] 'gaps'; did you mean 'gap'"),
        (changed(actors=[{"gap": 3.0}, {}]), r"scenario.actors\[1\] must have the key 'gap'; add it"),
        (
            changed(actors=[{"gap": 3.0, "profile": [{"strat": 1.0}]}]),
            r"unknown key of scenario.actors\[0\].profile\[0\] 'strat'; did you mean 'start'",
        ),
        (
            changed(ego_path=[{"length": -1.0}]),
            r"scenario.ego_path\[0\]: length of a Bend must be > 0 m, got -1",
        ),
        (changed(road={"kind": "curved"}), "scenario.road: unknown road kind 'curved'; did you mean 'curve'"),
        (changed(actors={"gap": 3.0}), "scenario.actors must be list or tuple, got"),
        (changed(road=3), "scenario.road must be dict, got 3"),
        (changed(duration=-1.0), "scenario: duration must be > 0 s, got -1"),
        ([1], r"scenario must be dict, got \[1\]"),
    ],
)
def test_errors_state_the_place(data, message):
    with pytest.raises(ValueError, match=message):
        scenario_from_data(data)


def test_the_environment_equals_that_of_the_family():
    scenario = make_scenario("CCRb")
    given = gym.make("LGMD/Scenario-v0", scenario=scenario_to_data(scenario), world=7)
    np.testing.assert_equal(rollout(given, HOLD, 20), rollout(gym.make("LGMD/CCRb-v0", world=7), HOLD, 20))


def test_the_environment_passes_the_checker_and_json():
    env = gym.make("LGMD/Scenario-v0", scenario=SMALL)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)
    restored = gym.make(EnvSpec.from_json(env.spec.to_json()))
    np.testing.assert_equal(rollout(restored, HOLD, 10), rollout(env, HOLD, 10))


def test_vector_environments_take_data():
    envs = gym.make_vec("LGMD/Scenario-v0", num_envs=2, scenario=SMALL, camera=None)
    single = BrakingEnv(scenario_from_data(SMALL))
    assert envs.reset(seed=3)[0].shape == (2, *single.observation_space.shape)
    envs.close()


def test_the_argument_is_required():
    with pytest.raises(ValueError, match="LGMD/Scenario-v0 needs the argument scenario"):
        gym.make("LGMD/Scenario-v0")
    with pytest.raises(ValueError, match="unknown argument of Scenario 'scenari'; did you mean 'scenario'"):
        gym.make("LGMD/Scenario-v0", scenari=SMALL)
