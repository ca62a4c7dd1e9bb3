"""`PolicyVecEnv` equals a `DummyVecEnv` of `PolicyWrapper`s."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

from lgmd_gym.sensing.sensor_array import SensorArray
from lgmd_gym.training import TrainConfig
from lgmd_gym.training.online import make_envs

HOLD, BRAKE = 0, 1
INPUTS = {"discrete": ["spike_peak", "ego_speed", "speed_change"], "frame": ["frame", "ego_yaw_rate"]}
NUM_ENVS = 3


def make_config(name, **options):
    values = {"inputs": INPUTS.get(name, INPUTS["discrete"]), "camera": "fovea", "demands": (0.0, -1.0)}
    config = TrainConfig.from_hyperparams("ppo", **(values | options))
    return replace(config, n_envs=NUM_ENVS)


def make_pair(config):
    singles = VecMonitor(DummyVecEnv([lambda: config.make_policy_env("train")] * config.n_envs))
    return singles, make_envs(config, "train")


def assert_equal(first, second):
    assert set(first) == set(second)
    for name in first:
        np.testing.assert_array_equal(first[name], second[name])


@pytest.mark.parametrize("name", ["discrete", "continuous", "frame", "no latch", "zones"])
def test_steps_equal_those_of_single_environments(name):
    """Random braking ends most episodes early; some end by contact or in time."""
    options = {"continuous": {"demands": ()}, "zones": {"inputs": ["zones"], "camera": None}}.get(name, {})
    config = make_config(name, **options)
    features = replace(config.features, latch=name != "no latch", repeat=7, history=2, reward_scale=0.5)
    singles, envs = make_pair(replace(config, features=features))
    assert singles.observation_space == envs.observation_space
    assert singles.action_space == envs.action_space
    for vec_env in (singles, envs):
        vec_env.seed(5)
    assert_equal(singles.reset(), envs.reset())
    rng, ends = np.random.default_rng(0), 0
    for _ in range(40):
        braking = rng.random(NUM_ENVS) < 0.08
        actions = np.where(braking, BRAKE, HOLD) if config.demands else -0.6 * braking[:, None]
        expected, reward, done, infos = singles.step(actions)
        observations, rewards, dones, rows = envs.step(actions)
        assert_equal(expected, observations)
        np.testing.assert_array_equal(reward, rewards)
        np.testing.assert_array_equal(done, dones)
        for index in np.flatnonzero(done):
            assert_same_info(infos[index], rows[index])
            ends += 1
    assert ends >= 3
    assert not any(rows[index] for index in np.flatnonzero(~dones))


def assert_same_info(expected, row):
    assert set(expected) == set(row)
    assert_equal(expected.pop("terminal_observation"), row.pop("terminal_observation"))
    for info in (expected, row):
        info["episode"].pop("t")
    assert expected.pop("episode") == pytest.approx(row.pop("episode"))
    for key, value in expected.items():
        np.testing.assert_array_equal(value, row[key], key)


def test_no_frame_is_rendered_after_the_brake_latches(monkeypatch):
    selected, process = [], SensorArray.process

    def record(self, first, last, due):
        selected.append(due[first:last].copy())
        return process(self, first, last, due)

    monkeypatch.setattr(SensorArray, "process", record)
    config = make_config("discrete")
    envs = make_envs(replace(config, features=replace(config.features, latch=True, repeat=3)), "train")
    envs.envs.simulation._threads.count = 1
    envs.seed(1)
    envs.reset()
    selected.clear()
    envs.step(np.array([HOLD, BRAKE, HOLD]))
    rendered = np.array(selected)
    assert rendered[:, [0, 2]].sum() == 2 * 3
    assert rendered[:, 1].sum() == 1  # the first frame of the next episode


def test_a_latched_brake_at_the_time_limit_is_a_termination():
    """A policy with a latched brake decides nothing more, so its episode has no value beyond its end."""
    config = replace(make_config("discrete"), env_id="LGMD/EmptyRoad-v0", env_kwargs={})
    envs = make_envs(replace(config, features=replace(config.features, latch=True, repeat=3)), "train")
    truncated, decisions = [], 0
    for last in (HOLD, BRAKE):
        envs.seed(0)
        envs.reset()
        for _ in range(decisions - 1):
            envs.step(np.full(NUM_ENVS, HOLD))
        action, done = last, np.array([False])
        while not done.any():
            _, _, done, infos = envs.step(np.full(NUM_ENVS, action))
            decisions += last == HOLD
        truncated.append(infos[0]["TimeLimit.truncated"])
        assert not infos[0]["collision"]
        assert (infos[0]["ego_speed"] > 0.0).all()
    assert truncated == [True, False]


def test_a_reset_uses_a_seed_once_and_refuses_options():
    envs = make_envs(make_config("discrete"), "train")
    envs.seed(1)
    first, second = envs.reset()["ego_speed"], envs.reset()["ego_speed"]
    assert not np.array_equal(first, second)
    envs.seed(1)
    np.testing.assert_array_equal(envs.reset()["ego_speed"], first)
    envs.set_options({"level": 3})
    with pytest.raises(ValueError, match=r"the environments have no options, got .*level"):
        envs.reset()


def test_training_and_evaluation_rewards_have_their_scales():
    config = make_config("discrete", env_kwargs={"start_level": 3, "num_levels": 1})
    config = replace(config, features=replace(config.features, latch=True, reward_scale=0.25))
    rewards = []
    for split in ("train", "validation"):
        envs = make_envs(replace(config, env_kwargs=config.env_kwargs | {"split": "train"}), split)
        envs.seed(0)
        envs.reset()
        rewards.append(envs.step(np.full(NUM_ENVS, BRAKE))[1])
    np.testing.assert_allclose(rewards[0], 0.25 * rewards[1])


def test_other_autoreset_modes_are_refused():
    from lgmd_gym.training.policy_env import PolicyVecEnv

    envs = gym.make_vec("LGMD/CCRs-v0", num_envs=1)
    with pytest.raises(ValueError, match="autoreset_mode 'Disabled', got 'NextStep'"):
        PolicyVecEnv(envs.unwrapped, make_config("discrete").features)


def test_environments_without_engine_are_stepped_one_by_one():
    config = TrainConfig.from_hyperparams(
        "ppo", "LGMD/Traffic-Highway-v0", inputs=["spike_peak"], camera="fovea", demands=(0.0, -1.0)
    )
    envs = make_envs(replace(config, n_envs=2), "train")
    assert isinstance(envs, VecMonitor)
    assert envs.num_envs == 2
