"""Resets, seeds, copies, rendering, statistics and specifications of the engine."""

import copy

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import RecordEpisodeStatistics
from support.vectors import differences, digest, make_pair

from lgmd_gym.engine import BrakingVectorEnv

LEVELS = "LGMD/RandomBraking-v0"
FAST = {"ego_speed": 3.0, "config": {"follow_up": 0.0}}  # a second of braking ends the episode


def hold(envs):
    return np.zeros(envs.action_space.shape, np.float32)


def brake(envs):
    return np.full(envs.action_space.shape, -1.0, np.float32)


def equal(one, other):
    return differences(digest(list(one)), digest(list(other))) == []


def test_make_vec_returns_the_engine():
    envs = gym.make_vec("LGMD/CCRs-v0", num_envs=2)
    assert isinstance(envs.unwrapped, BrakingVectorEnv)
    assert envs.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    observations, infos = envs.reset(seed=0)
    assert envs.observation_space.contains(observations)
    assert infos["_gap"].tolist() == [True, True]


@pytest.mark.parametrize("threads", [1, 2])
def test_resets_of_selected_environments(threads):
    reference, engine = make_pair(LEVELS, 4, "Disabled", threads)
    assert equal(reference.reset(seed=[3, 1, 4, 1]), engine.reset(seed=[3, 1, 4, 1]))
    rng = np.random.default_rng(0)
    for step in range(12):
        mask = rng.random(4) < 0.4
        if mask.any():
            seed = [7, None, 9 + step, None] if step % 3 == 0 else None
            resets = [
                envs.reset(seed=seed, options={"reset_mask": mask.copy()}) for envs in (reference, engine)
            ]
            assert equal(*resets), step
        assert equal(reference.step(hold(engine)), engine.step(hold(engine)))


@pytest.mark.parametrize("threads", [1, 2])
def test_reset_without_seed_continues_the_random_generators(threads):
    reference, engine = make_pair(LEVELS, 2, threads=threads)
    for seed in (5, None, None, 5, None):
        assert equal(reference.reset(seed=seed), engine.reset(seed=seed))
    assert engine.np_random_seed == reference.np_random_seed == (5, 6)


def test_first_reset_without_seed_draws_seeds():
    engine = gym.make_vec(LEVELS, num_envs=3)
    _, infos = engine.reset()
    assert len(set(infos["level"].tolist())) == 3
    assert all(isinstance(seed, int) for seed in engine.np_random_seed)


def test_copy_false_overwrites_the_observations():
    copied, shared = (gym.make_vec("LGMD/CCRs-v0", num_envs=2, copy=flag, **FAST) for flag in (True, False))
    (first, _), (again, _) = copied.reset(seed=0), shared.reset(seed=0)
    for _ in range(5):
        one, *_ = copied.step(hold(copied))
        other, *_ = shared.step(hold(shared))
        assert digest(one) == digest(other)
        assert other["ego_speed"] is again["ego_speed"]
        assert one["ego_speed"] is not first["ego_speed"]


def test_final_observations_are_no_views():
    envs = gym.make_vec("LGMD/CCRs-v0", num_envs=1, autoreset_mode="SameStep", copy=False, **FAST)
    envs.reset(seed=0)
    done = False
    while not done:
        _, _, terminated, truncated, infos = envs.step(brake(envs))
        done = terminated[0] or truncated[0]
    final = infos["final_obs"][0]
    before = digest(final)
    for _ in range(30):
        envs.step(hold(envs))
    assert digest(final) == before


def test_results_of_a_step_do_not_change_later():
    envs = gym.make_vec(LEVELS, num_envs=2, include_frame=True, include_base=True)
    envs.reset(seed=0)
    results = envs.step(hold(envs))
    before = digest(list(results))
    for _ in range(3):
        envs.step(hold(envs))
    assert digest(list(results)) == before


@pytest.mark.parametrize("family", ["CCRs", "CurveGuardRail", "CCCscp", "RandomBraking"])
def test_render_equals_the_single_environments(family):
    reference, engine = make_pair(f"LGMD/{family}-v0", 2, "SameStep", render_mode="rgb_array", camera=None)
    reference.reset(seed=1)
    engine.reset(seed=1)
    for _ in range(3):
        for _ in range(7):
            reference.step(hold(engine))
            engine.step(hold(engine))
        for one, other in zip(reference.render(), engine.render(), strict=True):
            np.testing.assert_array_equal(one, other)
    engine.close()
    reference.close()


def test_no_render_without_render_mode():
    envs = gym.make_vec("LGMD/CCRs-v0", num_envs=1)
    envs.reset(seed=0)
    assert envs.render() is None


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_episode_statistics_of_gymnasium(mode):
    reference, engine = make_pair("LGMD/CCRs-v0", 2, mode, **FAST)
    statistics = []
    for envs in (reference, engine):
        recorder = RecordEpisodeStatistics(envs)
        recorder.reset(seed=0)
        for _ in range(150):
            recorder.step(brake(envs))
        statistics.append((list(recorder.return_queue), list(recorder.length_queue)))
    assert len(statistics[0][0]) >= 4
    assert str(statistics[0]) == str(statistics[1])


def test_specification_to_json():
    envs = gym.make_vec("LGMD/CCRs-v0", num_envs=2, threads=2, autoreset_mode="SameStep", ego_speed=12.0)
    spec = EnvSpec.from_json(envs.spec.to_json())
    again = gym.make_vec(spec, num_envs=2)
    assert equal(envs.reset(seed=0), again.reset(seed=0))
    assert again.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP


def test_close_twice_and_without_reset():
    envs = gym.make_vec("LGMD/CCRs-v0", num_envs=2, threads=2)
    envs.close()
    envs.close()


def test_a_copy_continues_with_the_same_episodes():
    envs = gym.make_vec("LGMD/RandomBraking-v0", num_envs=2, threads=2)
    envs.reset(seed=0)
    again = copy.deepcopy(envs)
    demands = np.full((2, 1), -1.0, np.float32)
    for _ in range(150):
        (observed, rewards, *_), (copied, others, *_) = envs.step(demands), again.step(demands)
        np.testing.assert_array_equal(rewards, others)
        assert all(np.array_equal(observed[name], copied[name]) for name in observed)
    envs.close()
    again.close()
