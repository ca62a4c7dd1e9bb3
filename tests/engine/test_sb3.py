"""`SB3VecEnv` equals `VecMonitor(DummyVecEnv([…]))` of single environments, and algorithms train on it."""

import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest
from support.vectors import differences, digest

import lgmd_gym  # noqa: F401

pytest.importorskip("stable_baselines3")

from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor, VecNormalize, VecVideoRecorder

from lgmd_gym.engine import SB3VecEnv

LEVELS = "LGMD/RandomBraking-v0"
FAST = {"ego_speed": 3.0, "config": {"follow_up": 0.0}}  # a second of braking ends the episode


def make_single_and_engine(env_id, num_envs, threads=1, **arguments):
    singles = VecMonitor(DummyVecEnv([lambda: gym.make(env_id, **arguments)] * num_envs))
    return singles, SB3VecEnv(env_id, num_envs, threads=threads, **arguments)


def without_time(infos):
    """Return copies of infos without the time of `episode`, and its time."""
    return [info | ({"episode": info["episode"] | {"t": 0.0}} if "episode" in info else {}) for info in infos]


def assert_equal_rollouts(singles, engine, steps, draw):
    singles.seed(4)
    engine.seed(4)
    assert differences(digest(singles.reset()), digest(engine.reset())) == []
    rng, infos = np.random.default_rng(0), []
    for _ in range(steps):
        actions = draw(rng)
        one, other = singles.step(actions), engine.step(actions)
        for a, b in zip(one[:3], other[:3], strict=True):
            assert differences(digest(a), digest(b)) == []
        for a, b in zip(without_time(one[3]), without_time(other[3]), strict=True):
            assert differences(digest(a), digest(b)) == []
        for a, b in zip(singles.unwrapped.reset_infos, engine.reset_infos, strict=True):
            assert differences(digest(a), digest(b)) == []
        infos += [info for info in other[3] if "episode" in info]
    return infos


def test_rollout_equals_dummy_vec_env():
    singles, engine = make_single_and_engine(LEVELS, 3, threads=2, include_frame=True)
    demands = np.array([0.0, 0.0, 0.0, -0.4, -1.0], np.float32)
    ended = assert_equal_rollouts(singles, engine, 300, lambda rng: rng.choice(demands, (3, 1)))
    assert len(ended) >= 2
    assert all(0 < info["episode"]["t"] < 600 for info in ended)


def test_rollout_of_discrete_actions_without_camera():
    config = {"action": {"type": "DiscreteDemand", "demands": [0.0, -1.0]}, "follow_up": 0.0}
    arguments = {"ego_speed": 3.0, "config": config}
    singles, engine = make_single_and_engine("LGMD/CCRs-v0", 2, camera=None, **arguments)
    ended = assert_equal_rollouts(singles, engine, 60, lambda rng: rng.choice(2, 2, p=[0.1, 0.9]))
    assert len(ended) >= 3


def test_truncation_is_marked():
    engine = SB3VecEnv("LGMD/EmptyRoad-v0", camera=None)
    engine.reset()
    done = [False]
    while not done[0]:
        _, _, done, infos = engine.step(np.zeros((1, 1)))
        assert infos[0]["TimeLimit.truncated"] == done[0]


def test_ppo_trains_on_the_engine():
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.evaluation import evaluate_policy

    torch.set_num_threads(1)
    engine = SB3VecEnv("LGMD/CCRs-v0", 4, **FAST)
    envs = VecNormalize(engine, norm_reward=False)
    model = PPO("MultiInputPolicy", envs, n_steps=64, batch_size=64, n_epochs=2, seed=0, device="cpu")
    model.learn(512)
    assert model.num_timesteps == 512
    assert len(model.ep_info_buffer) > 0
    assert all(bool(torch.isfinite(weight).all()) for weight in model.policy.parameters())
    rewards, lengths = evaluate_policy(model, envs, n_eval_episodes=4, return_episode_rewards=True)
    assert len(rewards) == 4
    assert max(lengths) <= 331


@pytest.mark.filterwarnings("error")
@pytest.mark.usefixtures("moviepy")
def test_what_the_library_calls(tmp_path):
    engine = SB3VecEnv("LGMD/CCRs-v0", 2, render_mode="rgb_array", camera=None)
    engine.seed(1)
    engine.reset()
    assert engine.get_attr("render_mode") == ["rgb_array"] * 2
    assert engine.get_attr("action_space", [0])[0].shape == (1,)
    assert engine.get_attr("np_random_seed", 1) == [2]
    assert engine.get_attr("spec")[0].id == "LGMD/CCRs-v0"
    assert not engine.has_attr("level")
    assert engine.env_is_wrapped(Monitor) == [True, True]
    assert engine.env_is_wrapped(gym.wrappers.TimeLimit, indices=0) == [False]
    first, second = engine.env_method("render")
    assert first.shape == second.shape
    tiled = engine.render("rgb_array")
    assert tiled.shape[0] == 2 * first.shape[0] or tiled.shape[1] == 2 * first.shape[1]
    with pytest.raises(AttributeError, match="no attribute 'scenario' to set"):
        engine.set_attr("scenario", None)
    with pytest.raises(AttributeError, match="no method 'jump'; known: render"):
        engine.env_method("jump")
    assert VecVideoRecorder(engine, str(tmp_path), lambda _: False).frames_per_sec == 30
    engine.close()


def test_wrong_arguments():
    mode = gym.make_vec("LGMD/CCRs-v0", num_envs=2, camera=None)
    with pytest.raises(ValueError, match=r"autoreset_mode 'SameStep', got 'NextStep'; use gym\.make_vec"):
        SB3VecEnv(mode)
    with pytest.raises(ValueError, match="'SameStep' for stable-baselines3, got 'Disabled'; omit it"):
        SB3VecEnv("LGMD/CCRs-v0", autoreset_mode="Disabled")
    same = gym.make_vec("LGMD/CCRs-v0", num_envs=2, camera=None, autoreset_mode="SameStep")
    with pytest.raises(ValueError, match="got num_envs, threads; pass an id instead"):
        SB3VecEnv(same, num_envs=2, threads=2)
    with pytest.raises(ValueError, match="copy=True, got False"):
        SB3VecEnv("LGMD/CCRs-v0", copy=False)
    with pytest.raises(ValueError, match="got OrderEnforcing"):
        SB3VecEnv(gym.make("LGMD/CCRs-v0", camera=None))
    engine = SB3VecEnv(same)
    engine.set_options({"level": 3})
    with pytest.raises(ValueError, match="the environments have no options, got"):
        engine.reset()


def test_a_vector_of_single_environments_is_accepted():
    arguments = {"num_envs": 2, "camera": None, "world": "laboratory", **FAST}
    vector = {"autoreset_mode": "SameStep"}
    sync = gym.make_vec("LGMD/CCRs-v0", vectorization_mode="sync", vector_kwargs=vector, **arguments)
    engine = gym.make_vec("LGMD/CCRs-v0", autoreset_mode="SameStep", **arguments)
    brake = lambda rng: np.full((2, 1), -1.0, np.float32)  # noqa: E731
    assert len(assert_equal_rollouts(SB3VecEnv(sync), SB3VecEnv(engine), 40, brake)) == 4


@pytest.mark.slow
def test_torch_is_loaded_with_the_adapter_only():
    code = (
        "import sys, gymnasium, lgmd_gym, lgmd_gym.engine\n"
        "gymnasium.make_vec('LGMD/CCRs-v0', num_envs=1, camera=None).reset(seed=0)\n"
        "print('torch' in sys.modules)\n"
        "from lgmd_gym.engine import SB3VecEnv\n"
        "print('torch' in sys.modules)\n"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.split() == ["False", "True"]
