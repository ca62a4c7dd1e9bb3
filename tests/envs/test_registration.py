"""Registered ids: entry points, specs, Gymnasium's checks."""

import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

import lgmd_gym  # noqa: F401  (registers the ids)
from lgmd_gym import LGMDObservation
from lgmd_gym.envs import FAMILIES, env_id
from lgmd_gym.envs.families.family import family
from lgmd_gym.envs.registration import TRAFFIC_KINDS, find_kind, traffic_id

TRAFFIC_IDS = {
    "LGMD/Traffic-Highway-v0",
    "LGMD/Traffic-Merge-v0",
    "LGMD/Traffic-TwoWay-v0",
    "LGMD/Traffic-Intersection-v0",
    "LGMD/Traffic-Roundabout-v0",
}


def test_registered_ids():
    ids = {name for name in gym.registry if name.startswith("LGMD/")}
    random = {"LGMD/RandomBraking-v0", "LGMD/RandomBrakingEasy-v0"}
    assert ids == {*map(env_id, FAMILIES), "LGMD/Scenario-v0"} | random | TRAFFIC_IDS
    assert {traffic_id(kind) for kind in TRAFFIC_KINDS} == TRAFFIC_IDS


def test_registration_does_not_import_highway_env():
    code = (
        "import sys, lgmd_gym, gymnasium; assert 'LGMD/Traffic-Merge-v0' in gymnasium.registry; "
        "print([name for name in ('highway_env', 'pygame', 'numba') if name in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout == b"[]\n"


def test_family_names_are_unique():
    with pytest.raises(ValueError, match="scenario family 'CCRs' is defined twice"):
        family("CCRs")(FAMILIES["CCRm"])


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("LGMD/CCRs-v0", {"ego_speed": 8.0, "camera": None}),
        ("LGMD/Traffic-Merge-v0", {"camera": None, "config": {"vehicles_count": 4}}),
        ("LGMD/Traffic-TwoWay-v0", {"camera": ["fovea", {"name": "wide"}], "params": {"t_sf": 20.0}}),
    ],
)
def test_spec_survives_json(name, arguments):
    env = gym.make(name, **arguments)
    copy = gym.make(EnvSpec.from_json(env.spec.to_json()))
    for one, other in ((env.reset(seed=1), copy.reset(seed=1)), (env.step([-0.5]), copy.step([-0.5]))):
        np.testing.assert_equal(one, other)


def test_traffic_ids_take_the_arguments_of_the_observation_wrapper():
    env = gym.make("LGMD/Traffic-Highway-v0", camera="wide", include_frame=True, config={"duration": 5})
    assert isinstance(env.unwrapped, find_kind("highway"))
    (channel,) = env.get_wrapper_attr("channels")
    assert channel.camera.name == "wide"
    observation, _ = env.reset(seed=0)
    assert observation["frame"].shape == env.observation_space["frame"].shape
    assert env.unwrapped.config["duration"] == 5
    bare = gym.make("LGMD/Traffic-Highway-v0", camera=None)
    while isinstance(bare, gym.Wrapper):
        assert not isinstance(bare, LGMDObservation)
        bare = bare.env


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", ["LGMD/EmptyRoad-v0", "LGMD/RandomBraking-v0", "LGMD/Traffic-Merge-v0"])
def test_gymnasium_env_checker(name):
    """The checker compares infos with ==, so undefined values must equal themselves."""
    check_env(gym.make(name, camera=None).unwrapped, skip_render_check=True)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", sorted(TRAFFIC_IDS - {"LGMD/Traffic-Merge-v0"}))
def test_gymnasium_env_checker_on_all_traffic(name):
    test_gymnasium_env_checker(name)
