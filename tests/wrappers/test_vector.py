"""The vector `LGMDObservation` equals single wrappers in every autoreset mode."""

import gymnasium as gym
import highway_env  # noqa: F401  (registers the stock environments)
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import RecordEpisodeStatistics

from lgmd_gym import LGMDObservation as Single
from lgmd_gym.wrappers.vector import LGMDObservation

SPEEDS = (4.0, 30.0, 12.0)
ZONE = {"name": "zone", "shape": [20, 80], "gaze": "stopping", "brake_known": True}
SENSORS = {"camera": ["wide", {"name": "fovea", "shape": [60, 100]}, ZONE], "include_base": True}
KEYS = {
    *("spike_frequency", "membrane_potential", "ffi", "ego_speed", "ego_yaw_rate", "known_deceleration"),
    "base",
}


def bare(speed):
    return lambda: gym.make("LGMD/CCRs-v0", ego_speed=speed, camera=None, config={"policy_frequency": 15})


def single(speed):
    return lambda: gym.make("LGMD/CCRs-v0", ego_speed=speed, config={"policy_frequency": 15}, **SENSORS)


def assert_infos_equal(got, expected):
    """Compare the keys of `expected`; Gymnasium omits some masks."""
    for key, value in expected.items():
        if isinstance(value, dict):
            assert_infos_equal(got[key], value)
        elif key != "final_obs":
            np.testing.assert_allclose(
                np.asarray(got[key], float), np.asarray(value, float), atol=1e-6, equal_nan=True, err_msg=key
            )


@pytest.mark.parametrize(
    ("mode", "threads"),
    [
        (AutoresetMode.NEXT_STEP, None),
        (AutoresetMode.SAME_STEP, 2),
        (AutoresetMode.DISABLED, 2),
        pytest.param(AutoresetMode.NEXT_STEP, 2, marks=pytest.mark.slow),
        pytest.param(AutoresetMode.SAME_STEP, None, marks=pytest.mark.slow),
        pytest.param(AutoresetMode.DISABLED, None, marks=pytest.mark.slow),
    ],
)
def test_vector_wrapper_equals_wrapped_single_environments(mode, threads):
    wrapped = LGMDObservation(
        SyncVectorEnv([bare(v) for v in SPEEDS], autoreset_mode=mode), threads=threads, **SENSORS
    )
    reference = SyncVectorEnv([single(v) for v in SPEEDS], autoreset_mode=mode)
    assert wrapped.observation_space == reference.observation_space
    assert wrapped.single_observation_space == reference.single_observation_space
    got, expected = wrapped.reset(seed=3), reference.reset(seed=3)
    done = np.zeros(3, bool)
    ends = 0
    for step in range(220):
        assert set(got[0]) == KEYS
        np.testing.assert_equal(got[0], expected[0])
        assert_infos_equal(got[-1], expected[-1])
        if mode == AutoresetMode.SAME_STEP and done.any():
            for index in np.flatnonzero(done):
                np.testing.assert_equal(got[-1]["final_obs"][index], expected[-1]["final_obs"][index])
        if mode == AutoresetMode.DISABLED and done.any():
            got, expected = (envs.reset(options={"reset_mask": done.copy()}) for envs in (wrapped, reference))
            np.testing.assert_equal(got[0], expected[0])
        action = np.array([[0.0], [-1.0 if step > 40 else 0.0], [0.0]], np.float32)
        got, expected = wrapped.step(action), reference.step(action)
        for part in (1, 2, 3):
            np.testing.assert_array_equal(got[part], expected[part])
        done = got[2] | got[3]
        ends += done.sum()
    assert ends > 5


def test_frames_of_stock_environments():
    def make():
        config = {"vehicles_count": 3, "simulation_frequency": 30, "policy_frequency": 5}
        return gym.make("highway-v0", config=config)

    wrapped = LGMDObservation(SyncVectorEnv([make] * 2), camera="wide", include_frame=True)
    reference = SyncVectorEnv([lambda: Single(make(), camera="wide", include_frame=True)] * 2)
    got, expected = wrapped.reset(seed=1)[0], reference.reset(seed=1)[0]
    for _ in range(8):
        np.testing.assert_equal(got, expected)
        assert wrapped.observation_space.contains(got)
        got, expected = wrapped.step(np.array([1, 3]))[0], reference.step(np.array([1, 3]))[0]
    assert got["frame"].shape == (2, 90, 160, 1)


def test_other_vector_wrappers_can_be_applied():
    arguments = {"camera": None, "world": "laboratory"}
    envs = gym.make_vec("LGMD/CCRs-v0", num_envs=2, vectorization_mode="sync", **arguments)
    envs = RecordEpisodeStatistics(LGMDObservation(envs))
    envs.reset(seed=0)
    for _ in range(60):
        *_, infos = envs.step(np.full((2, 1), -1.0, np.float32))
        if "episode" in infos:
            break
    assert (infos["episode"]["l"] == 54).all()
    envs.close()


def test_unsupported_environments_raise():
    envs = AsyncVectorEnv([bare(5.0)])
    try:
        with pytest.raises(
            ValueError, match=r"must be a SyncVectorEnv, got AsyncVectorEnv; for worker processes, wrap each"
        ):
            LGMDObservation(envs)
    finally:
        envs.close()
    with pytest.raises(ValueError, match="must have no cameras, got LGMDObservation; use camera=None"):
        LGMDObservation(SyncVectorEnv([single(5.0)]))
    with pytest.raises(ValueError, match="must be a highway-env environment"):
        LGMDObservation(SyncVectorEnv([lambda: gym.make("CartPole-v1")]))
    rates = [
        lambda hz=hz: gym.make("LGMD/CCRs-v0", camera=None, config={"simulation_frequency": hz})
        for hz in (60, 30)
    ]
    with pytest.raises(ValueError, match=r"must have one simulation_frequency, got \[30, 60\] Hz"):
        LGMDObservation(SyncVectorEnv(rates))
