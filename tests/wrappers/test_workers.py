"""`LGMDObservation` in vector environments, worker processes and `RecordVideo`."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from support.rollouts import HOLD, rollout


@pytest.mark.slow
def test_worker_processes_give_equal_observations():
    envs = AsyncVectorEnv([lambda: gym.make("lgmd_gym:LGMD/CCRs-v0")], context="spawn")
    try:
        env = gym.make("LGMD/CCRs-v0")
        observation, _ = env.reset(seed=5)
        batched, _ = envs.reset(seed=5)
        for _ in range(40):
            np.testing.assert_equal({key: value[0] for key, value in batched.items()}, observation)
            observation, *_ = env.step(HOLD)
            batched, *_ = envs.step(HOLD[None])
    finally:
        envs.close()


def test_forked_workers_run_after_a_step_in_the_parent():
    env = gym.make("LGMD/CCRs-v0")
    rollout(env, HOLD, 3)
    envs = AsyncVectorEnv([lambda: gym.make("LGMD/CCRs-v0")] * 2, context="fork")
    try:
        envs.reset(seed=0)
        observation, *_ = envs.step(np.zeros((2, 1), np.float32))
        assert observation["spike_frequency"].shape == (2, 1)
    finally:
        envs.close(terminate=False)


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_traces_of_unequal_episodes_in_a_vector_env(mode):
    envs = SyncVectorEnv(
        [lambda speed=speed: gym.make("LGMD/CCRs-v0", ego_speed=speed, trace=True) for speed in (4.0, 30.0)],
        autoreset_mode=mode,
    )
    envs.reset(seed=0)
    done, episodes = np.zeros(2, bool), np.zeros(2, int)
    for step in range(260):
        if mode == AutoresetMode.DISABLED and done.any():
            envs.reset(options={"reset_mask": done})
        action = np.array([[-1.0 if step < 200 else 0.0], [0.0]], np.float32)
        observation, _, terminated, truncated, infos = envs.step(action)
        done = terminated | truncated
        episodes += done
        assert observation["spike_frequency"].shape == (2, 1)
        assert {len(trace) for trace in infos["lgmd/trace"] if trace is not None} == {1}
    assert (episodes > 0).all()
    assert episodes[0] != episodes[1]


@pytest.mark.usefixtures("moviepy")
def test_record_video_keeps_every_camera_frame(tmp_path):
    env = gym.make("LGMD/CCRs-v0", render_mode="rgb_array", config={"policy_frequency": 10}, trace=True)
    env = gym.wrappers.RecordVideo(env, str(tmp_path), episode_trigger=lambda _: True)
    infos = [info for *_, info in rollout(env, HOLD, 12)]
    env.close()
    assert [len(info["lgmd/trace"]) for info in infos] == [1] + [3] * 12
    assert len(list(tmp_path.glob("*.mp4"))) == 1
