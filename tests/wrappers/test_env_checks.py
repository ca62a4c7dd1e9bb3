"""Environment checkers and the JSON round trip of specs, for registered ids."""

import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env
from support.rollouts import HOLD, rollout

from lgmd_gym import LGMDParams
from lgmd_gym.envs import FAMILIES, env_id
from lgmd_gym.envs.registration import RANDOM

# One id for each kind of road, of target and of path, and levels; the others differ by their scenario only.
QUICK = (
    "CCRs",
    "CPNA",
    "CurveGuardRail",
    "EmptyRoad",
    "LaneClosure",
    "Oncoming",
    "TurnBeforeOncoming",
    RANDOM,
)
QUICK_IDS = [env_id(family) for family in QUICK]
OTHER_IDS = [env_id(family) for family in FAMILIES if family not in QUICK]
ALL_IDS = [*QUICK_IDS, *(pytest.param(identity, marks=pytest.mark.slow) for identity in OTHER_IDS)]


@pytest.mark.parametrize("identity", ALL_IDS)
def test_gymnasium_checker_accepts_every_id(identity):
    env = gym.make(identity)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)
    with warnings.catch_warnings(record=True) as recorded:
        warnings.simplefilter("always")
        check_env(env, skip_render_check=True)
    assert [str(w.message) for w in recorded if "wrapped" not in str(w.message)] == []


@pytest.mark.parametrize("identity", QUICK_IDS)
def test_stable_baselines3_checker_accepts_every_id(identity):
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(gym.make(identity))
        checker.check_env(gym.make(identity).unwrapped)


@pytest.mark.parametrize("identity", QUICK_IDS)
def test_spec_survives_a_json_round_trip(identity):
    env = gym.make(
        f"lgmd_gym:{identity}",
        camera=["wide", {"name": "fovea", "hfov_deg": 8.0}],
        params=LGMDParams(t_sp=0.78).to_dict(),
        config={"policy_frequency": 15},
    )
    restored = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert str(restored) == str(env)
    np.testing.assert_equal(rollout(restored, HOLD, 20), rollout(env, HOLD, 20))
