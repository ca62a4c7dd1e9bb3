"""`LGMDObservation` on our environments and on highway-env's own."""

import copy
import pickle
import warnings

import gymnasium as gym
import highway_env  # noqa: F401  (registers the stock environments)
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv

import lgmd_gym
from lgmd_gym import LGMD, CameraParams, EgoCamera, LGMDObservation, LGMDParams
from lgmd_gym.envs import env_id
from lgmd_gym.envs.registration import IDS, RANDOM

ALL_IDS = [env_id(family) for family in (*IDS, RANDOM)]
HOLD, BRAKE = np.array([0.0], np.float32), np.array([-1.0], np.float32)
SMALL = {"vehicles_count": 3, "simulation_frequency": 30}


def rollout(env, action, steps, seed=0):
    out = [env.reset(seed=seed)]
    for _ in range(steps):
        observation, reward, terminated, truncated, info = env.step(action)
        out.append((observation, reward, info))
        if terminated or truncated:
            break
    return out


def plain(info):
    """Info without the trace, whose arrays assert_equal compares badly."""
    return {key: value for key, value in info.items() if key != "lgmd/trace"}


@pytest.mark.parametrize("identity", ALL_IDS)
def test_gymnasium_checks_every_id(identity):
    env = gym.make(identity)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        check_env(env, skip_render_check=True)
    assert all("wrapped" in str(warning.message) for warning in heard)


@pytest.mark.parametrize("identity", ALL_IDS)
def test_stable_baselines3_checks_every_id(identity):
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(gym.make(identity))
        checker.check_env(gym.make(identity).unwrapped)


@pytest.mark.parametrize("identity", ALL_IDS)
def test_spec_survives_json(identity):
    env = gym.make(
        f"lgmd_gym:{identity}",
        camera=["wide", {"name": "fovea", "hfov_deg": 8.0}],
        params=LGMDParams(t_sp=0.78).to_dict(),
        config={"policy_frequency": 15},
    )
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert str(again) == str(env)
    for one, other in zip(rollout(env, HOLD, 20), rollout(again, HOLD, 20), strict=True):
        np.testing.assert_equal(one, other)


def test_bits_are_the_same_in_another_process():
    """The numbers of a worker process are those of this one."""
    envs = AsyncVectorEnv([lambda: gym.make("lgmd_gym:LGMD/CCRs-v0")], context="spawn")
    try:
        here = gym.make("LGMD/CCRs-v0")
        observation, _ = here.reset(seed=5)
        there, _ = envs.reset(seed=5)
        for _ in range(40):
            np.testing.assert_equal({key: value[0] for key, value in there.items()}, observation)
            observation, *_ = here.step(HOLD)
            there, *_ = envs.step(HOLD[None])
    finally:
        envs.close()


def test_forked_workers_live_after_a_step_in_the_parent():
    env = gym.make("LGMD/CCRs-v0")
    rollout(env, HOLD, 3)
    envs = AsyncVectorEnv([lambda: gym.make("LGMD/CCRs-v0")] * 2, context="fork")
    try:
        envs.reset(seed=0)
        observation, *_ = envs.step(np.zeros((2, 1), np.float32))
        assert observation["spike_frequency"].shape == (2, 1)
    finally:
        envs.close(terminate=False)


def test_the_neuron_sees_what_the_camera_renders():
    """The wrapper adds nothing: camera and neuron by hand give the same numbers."""
    env = gym.make("LGMD/CCRs-v0", camera="standard", ego_speed=12.0, trace=True)
    bare = env.unwrapped.__class__(env.unwrapped.scenario)
    camera = EgoCamera("standard")
    neuron = LGMD(camera.shape, fps=30.0)
    bare.reset(seed=2)
    response = neuron.step(camera.render(bare))
    _, info = env.reset(seed=2)
    for _ in range(140):
        np.testing.assert_array_equal(
            info["lgmd/trace"][0].response.membrane_potential[0], response.membrane_potential
        )
        *_, info = env.step(HOLD)
        bare.step(HOLD)
        response = neuron.step(camera.render(bare))
    assert info["lgmd/standard/spike_frequency"] > 0.0


@pytest.mark.parametrize(
    ("policy", "frames"), [(30, [1, 1, 1]), (60, [0, 1, 0]), (15, [2, 2, 2]), (20, [1, 2, 1])]
)
def test_the_eye_keeps_its_own_clock(policy, frames):
    env = gym.make("LGMD/CCRs-v0", config={"policy_frequency": policy}, trace=True)
    trace = [info["lgmd/trace"] for *_, info in rollout(env, HOLD, 6)]
    assert [len(part) for part in trace[:4]] == [1, *frames]
    times = [frame.time for part in trace for frame in part]
    np.testing.assert_allclose(np.diff(times), 1 / 30)


def test_a_decision_without_a_frame_holds_the_last_values():
    env = gym.make("LGMD/CCRs-v0", config={"policy_frequency": 60}, ego_speed=20.0)
    steps = rollout(env, HOLD, 260)[1:]
    potentials = [float(observation["membrane_potential"][0]) for observation, *_ in steps]
    changed = np.diff(potentials) != 0
    assert not changed[1::2].any() or not changed[::2].any()
    assert changed.any()


@pytest.mark.parametrize("identity", ["highway-v0", "merge-v0", "roundabout-v0"])
def test_foreign_environments(identity):
    env = LGMDObservation(gym.make(identity, config=SMALL), camera="wide", include_frame=True)
    assert env.fps == 30.0
    observation, info = env.reset(seed=0)
    for _ in range(3):
        assert env.observation_space.contains(observation)
        assert set(info) >= {"lgmd/wide/ffi", "lgmd/alert"}
        observation, _, terminated, truncated, info = env.step(1)
        if terminated or truncated:
            break
    assert observation["frame"].shape == (90, 160, 1)
    assert observation["frame"].std() > 5
    assert info["lgmd/wide/ffi"] > 0


def test_stock_highway_with_defaults_steps_and_says_its_rate():
    with pytest.warns(UserWarning, match="simulation_frequency 15 Hz, not 30"):
        env = LGMDObservation(gym.make("highway-v0"))
    assert env.fps == 15.0
    env.reset(seed=0)
    observation, *_ = env.step(1)
    assert env.observation_space.contains(observation)


def test_too_slow_a_simulation_is_refused_with_the_mend():
    with pytest.raises(ValueError, match=r"5 Hz is too slow for an eye.*'simulation_frequency': 30"):
        LGMDObservation(gym.make("highway-fast-v0"))


def test_an_fps_that_does_not_divide_is_refused():
    with pytest.raises(ValueError, match="fps 25 Hz does not divide simulation_frequency 60 Hz"):
        gym.make("LGMD/CCRs-v0", fps=25)


def test_changed_simulation_frequency_at_reset_is_followed():
    env = LGMDObservation(gym.make("highway-v0", config=SMALL), camera="wide", trace=True)
    assert env.fps == 30.0
    env.reset(seed=0, options={"config": {"simulation_frequency": 60}})
    *_, info = env.step(1)
    assert len(info["lgmd/trace"]) == 30
    assert env.fps == 30.0


def test_cameras_side_by_side_are_each_as_alone():
    together = gym.make("LGMD/CCRs-v0", camera=["fovea", "paper", "wide"], ego_speed=10.0)
    alone = {
        name: gym.make("LGMD/CCRs-v0", camera=name, ego_speed=10.0) for name in ("fovea", "paper", "wide")
    }
    both = rollout(together, HOLD, 60)
    for index, env in enumerate(alone.values()):
        for step, single in zip(both, rollout(env, HOLD, 60), strict=True):
            for key in ("spike_frequency", "membrane_potential", "ffi"):
                np.testing.assert_allclose(step[0][key][index], single[0][key][0], atol=1e-6)


def test_include_base_and_frame():
    env = gym.make("LGMD/CCRs-v0", include_base=True, include_frame=True, camera=["wide", "fovea"])
    observation, _ = env.reset(seed=0)
    assert env.observation_space.contains(observation)
    assert observation["frame"].shape == (90, 160, 2)
    assert observation["base"][0] == observation["ego_speed"][0]
    kept = observation["frame"].copy()
    env.step(HOLD)
    np.testing.assert_array_equal(observation["frame"], kept)  # an observation is not overwritten later


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_vector_of_unequal_episodes_with_trace(mode):
    speeds = (4.0, 30.0)
    envs = SyncVectorEnv(
        [lambda speed=speed: gym.make("LGMD/CCRs-v0", ego_speed=speed, trace=True) for speed in speeds],
        autoreset_mode=mode,
    )
    envs.reset(seed=0)
    done = np.zeros(2, bool)
    for step in range(200):
        if mode == AutoresetMode.DISABLED and done.any():
            envs.reset(options={"reset_mask": done})
        action = np.array([[-1.0 if step < 60 else 0.0], [0.0]], np.float32)
        observation, _, terminated, truncated, _ = envs.step(action)
        done = terminated | truncated
        assert observation["spike_frequency"].shape == (2, 1)


def test_record_video_and_the_eye_together(tmp_path):
    pytest.importorskip("moviepy")
    env = gym.make("LGMD/CCRs-v0", render_mode="rgb_array", config={"policy_frequency": 10}, trace=True)
    env = gym.wrappers.RecordVideo(env, str(tmp_path), episode_trigger=lambda _: True)
    infos = [info for *_, info in rollout(env, HOLD, 12)]
    env.close()
    assert [len(info["lgmd/trace"]) for info in infos] == [1] + [3] * 12
    assert list(tmp_path.glob("*.mp4"))


def test_deep_copy_sees_its_own_road():
    env = gym.make("LGMD/CCRs-v0", ego_speed=15.0)
    rollout(env, HOLD, 100)
    fork = copy.deepcopy(env)
    seen = env.get_wrapper_attr("response").membrane_potential.copy()
    for _ in range(10):
        forked, *_ = fork.step(BRAKE)
    np.testing.assert_array_equal(env.get_wrapper_attr("response").membrane_potential, seen)
    for _ in range(10):
        straight, *_ = env.step(BRAKE)
    np.testing.assert_equal(forked, straight)


def test_reset_forgets():
    env = gym.make("LGMD/CCRs-v0", ego_speed=15.0)
    first = rollout(env, HOLD, 40, seed=1)
    second = rollout(env, HOLD, 40, seed=1)
    for one, other in zip(first, second, strict=True):
        np.testing.assert_equal(one, other)


def test_birdseye_through_the_same_wrapper():
    env = gym.make("LGMD/CCRs-v0", camera="birdseye", include_frame=True)
    observation, info = env.reset(seed=0)
    assert observation["frame"].shape == (90, 160, 1)
    assert observation["frame"].std() > 5
    observation, *_, info = env.step(HOLD)
    assert "lgmd/birdseye/ffi" in info


def test_trace_pickles():
    env = gym.make("LGMD/CCRs-v0", trace=True)
    _, info = env.reset(seed=0)
    assert pickle.loads(pickle.dumps(info["lgmd/trace"]))[0].time == 0.0


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: gym.make("LGMD/CCRs-v0", camera="fova"),
            "unknown camera preset 'fova'; did you mean 'fovea'",
        ),
        (lambda: gym.make("LGMD/CCRs-v0", camera=[]), "empty list"),
        (lambda: gym.make("LGMD/CCRs-v0", camera=["wide", "wide"]), "two cameras are named 'wide'"),
        (
            lambda: gym.make("LGMD/CCRs-v0", params={"tsp": 0.7}),
            "unknown LGMD parameter 'tsp'; did you mean 't_sp'",
        ),
        (lambda: gym.make("LGMD/CCRs-v0", speed=3.0), "did you mean 'ego_speed'"),
        (lambda: gym.make("LGMD/CCRs-v0", ego_speed=50), "180 km/h"),
        (lambda: LGMDObservation(gym.make("CartPole-v1")), "needs a highway-env environment"),
        (lambda: gym.make("LGMD/CCRs-v0", camera=["wide", "paper"], include_frame=True), "one shape"),
    ],
)
def test_bad_input_names_the_value_and_the_mend(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_camera_params_objects_are_taken():
    env = gym.make("LGMD/CCRs-v0", camera=CameraParams(name="mine", hfov_deg=20.0))
    _, info = env.reset(seed=0)
    assert "lgmd/mine/ffi" in info
    assert lgmd_gym.__version__


def test_step_before_reset_says_so():
    env = LGMDObservation(gym.make("highway-v0", config=SMALL).unwrapped)
    with pytest.raises(RuntimeError, match="call reset first"):
        env.step(1)
