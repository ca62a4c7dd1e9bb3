"""The batched `LGMDObservation`: the same numbers as single ones, in every autoreset mode."""

import gymnasium as gym
import highway_env  # noqa: F401  (registers the stock environments)
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import RecordEpisodeStatistics

from lgmd_gym import LGMDObservation as Single
from lgmd_gym.wrappers.vector import LGMDObservation

SPEEDS = (4.0, 30.0, 12.0)
EYE = {"camera": ["wide", {"name": "fovea", "shape": [60, 100]}], "include_base": True}
KEYS = {"spike_frequency", "membrane_potential", "ffi", "ego_speed", "ego_yaw_rate", "base"}


def bare(speed):
    return lambda: gym.make("LGMD/CCRs-v0", ego_speed=speed, camera=None, config={"policy_frequency": 15})


def single(speed):
    return lambda: gym.make("LGMD/CCRs-v0", ego_speed=speed, config={"policy_frequency": 15}, **EYE)


def equal_infos(one, other):
    """Every key but the masks of keys that single environments leave out."""
    for key, value in other.items():
        if isinstance(value, dict):
            equal_infos(one[key], value)
        elif key != "final_obs":
            np.testing.assert_allclose(
                np.asarray(one[key], float), np.asarray(value, float), atol=1e-6, equal_nan=True, err_msg=key
            )


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("threads", [None, 2])
def test_vector_of_eyes_is_an_eye_on_the_vector(mode, threads):
    ours = LGMDObservation(
        SyncVectorEnv([bare(v) for v in SPEEDS], autoreset_mode=mode), threads=threads, **EYE
    )
    theirs = SyncVectorEnv([single(v) for v in SPEEDS], autoreset_mode=mode)
    assert ours.observation_space == theirs.observation_space
    assert ours.single_observation_space == theirs.single_observation_space
    one, other = ours.reset(seed=3), theirs.reset(seed=3)
    done = np.zeros(3, bool)
    ends = 0
    for step in range(220):
        assert set(one[0]) == KEYS
        np.testing.assert_equal(one[0], other[0])
        equal_infos(one[-1], other[-1])
        if mode == AutoresetMode.SAME_STEP and done.any():
            for index in np.flatnonzero(done):
                np.testing.assert_equal(one[-1]["final_obs"][index], other[-1]["final_obs"][index])
        if mode == AutoresetMode.DISABLED and done.any():
            one, other = (envs.reset(options={"reset_mask": done.copy()}) for envs in (ours, theirs))
            np.testing.assert_equal(one[0], other[0])
        action = np.array([[0.0], [-1.0 if step > 40 else 0.0], [0.0]], np.float32)
        one, other = ours.step(action), theirs.step(action)
        for part in (1, 2, 3):
            np.testing.assert_array_equal(one[part], other[part])
        done = one[2] | one[3]
        ends += done.sum()
    assert ends > 5


def test_frames_and_foreign_environments():
    def make():
        config = {"vehicles_count": 3, "simulation_frequency": 30, "policy_frequency": 5}
        return gym.make("highway-v0", config=config)

    ours = LGMDObservation(SyncVectorEnv([make] * 2), camera="wide", include_frame=True)
    theirs = SyncVectorEnv([lambda: Single(make(), camera="wide", include_frame=True)] * 2)
    one, other = ours.reset(seed=1)[0], theirs.reset(seed=1)[0]
    for _ in range(8):
        np.testing.assert_equal(one, other)
        assert ours.observation_space.contains(one)
        one, other = ours.step(np.array([1, 3]))[0], theirs.step(np.array([1, 3]))[0]
    assert one["frame"].shape == (2, 90, 160, 1)


def test_other_vector_wrappers_go_on_top():
    envs = gym.make_vec("LGMD/CCRs-v0", num_envs=2, vectorization_mode="sync", camera=None)
    envs = RecordEpisodeStatistics(LGMDObservation(envs))
    envs.reset(seed=0)
    for _ in range(60):
        *_, infos = envs.step(np.full((2, 1), -1.0, np.float32))
        if "episode" in infos:
            break
    assert (infos["episode"]["l"] == 54).all()
    envs.close()


def test_what_cannot_work_is_refused_with_the_mend():
    envs = AsyncVectorEnv([bare(5.0)])
    try:
        with pytest.raises(
            ValueError, match=r"needs a SyncVectorEnv, got AsyncVectorEnv.*wrap inside the worker"
        ):
            LGMDObservation(envs)
    finally:
        envs.close()
    with pytest.raises(ValueError, match="have an eye already; make them with camera=None"):
        LGMDObservation(SyncVectorEnv([single(5.0)]))
    with pytest.raises(ValueError, match="needs a highway-env environment"):
        LGMDObservation(SyncVectorEnv([lambda: gym.make("CartPole-v1")]))
    rates = [
        lambda hz=hz: gym.make("LGMD/CCRs-v0", camera=None, config={"simulation_frequency": hz})
        for hz in (60, 30)
    ]
    with pytest.raises(ValueError, match=r"need one simulation_frequency, got \[30, 60\] Hz"):
        LGMDObservation(SyncVectorEnv(rates))
