"""`PolicyWrapper`: spaces, repeated actions, latching."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from lgmd_gym.sensing.sensor_array import SensorArray
from lgmd_gym.training import PolicyWrapper, TrainConfig

HOLD = np.array([0.0], np.float32)
BRAKE = np.array([-1.0], np.float32)


@pytest.mark.filterwarnings("ignore")
def test_wrapper_passes_the_environment_checkers():
    from stable_baselines3.common.env_checker import check_env as check_sb3_env

    env = PolicyWrapper(gym.make("LGMD/CCRs-v0", include_frame=True), inputs=["spike_frequency", "frame"])
    assert env.observation_space["frame"].shape == (45, 80, 6)
    check_env(env, skip_render_check=True)
    check_sb3_env(env)
    env.close()


def test_actions_are_repeated_and_rewards_summed():
    env, wrapped = gym.make("LGMD/CCRs-v0"), PolicyWrapper(gym.make("LGMD/CCRs-v0"), repeat=5, history=1)
    env.reset(seed=4)
    wrapped.reset(seed=4)
    action = np.array([-0.3], np.float32)
    for _ in range(4):
        steps = [env.step(action) for _ in range(5)]
        observation, reward, *_ = wrapped.step(action)
        assert reward == pytest.approx(sum(step[1] for step in steps))
        assert observation["ego_speed"][0] == pytest.approx(steps[-1][0]["ego_speed"][0] / 20.0)


def test_hard_braking_latches_until_the_episode_ends():
    config = {"action": {"type": "DiscreteDemand", "demands": [0.0, -0.4, -1.0]}}
    env, inner = (gym.make("LGMD/CCRs-v0", config=config) for _ in range(2))
    wrapped = PolicyWrapper(inner, inputs=["ego_speed"], latch=True, reward_scale=0.5)
    env.reset(seed=4)
    wrapped.reset(seed=4)
    for action in (0, 1):  # a demand of -0.4 does not latch
        reward_sum = sum(float(env.step(action)[1]) for _ in range(3))
        _, reward, terminated, truncated, _ = wrapped.step(action)
        assert reward == pytest.approx(0.5 * reward_sum)
        assert (terminated, truncated) == (False, False)
    reward_sum, done = 0.0, False
    while not done:
        _, reward, terminated, truncated, _ = env.step(2)
        reward_sum, done = reward_sum + float(reward), terminated or truncated
    _, reward, terminated, truncated, info = wrapped.step(2)
    assert reward == pytest.approx(0.5 * reward_sum)
    assert (terminated, truncated) == (True, False)
    assert not info["collision"]


def test_no_frame_is_rendered_after_the_brake_latches(monkeypatch):
    calls, process = [], SensorArray.process
    monkeypatch.setattr(SensorArray, "process", lambda *arguments: (calls.append(1), process(*arguments)))
    env = PolicyWrapper(gym.make("LGMD/CCRs-v0"), inputs=["ego_speed"], latch=True)
    for _ in range(2):
        calls.clear()
        env.reset(seed=4)
        env.step(HOLD)
        assert len(calls) == 1 + 3
        env.step(BRAKE)
        assert len(calls) == 1 + 3


def test_rewards_are_scaled_on_the_train_split_only():
    config = TrainConfig.from_hyperparams("dqn", "LGMD/CCRs-v0", demands=(0.0, -1.0))
    assert config.features.reward_scale == 0.1
    rewards = []
    for split in ("train", "validation"):
        env = config.make_policy_env(split)
        env.reset(seed=1)
        rewards.append(env.step(1)[1])
    assert rewards[0] == pytest.approx(0.1 * rewards[1])
    assert abs(rewards[1]) > 1.0


def test_missing_frame_raises_with_a_suggested_fix():
    with pytest.raises(ValueError, match="'known_deceleration' is not in the observation; use cameras with"):
        PolicyWrapper(gym.make("LGMD/CCRs-v0"), inputs=["known_deceleration"])
    with pytest.raises(ValueError, match=r"'frame' is not in the observation; .* include_frame=True"):
        PolicyWrapper(gym.make("LGMD/CCRs-v0"), inputs=["frame"])
