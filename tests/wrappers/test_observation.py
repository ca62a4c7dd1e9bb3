"""`LGMDObservation`: observations, infos, cameras and arguments."""

import copy
import pickle

import gymnasium as gym
import highway_env  # noqa: F401  (registers the stock environments)
import numpy as np
import pytest
from support.rollouts import BRAKE, HOLD, rollout

from lgmd_gym import LGMD, BirdsEye, LGMDObservation
from lgmd_gym.camera import Camera, EgoCamera, Scene, ToStoppingPoint
from lgmd_gym.camera.pose import ESTIMATE_ERROR, known_deceleration

SMALL = {"vehicles_count": 3, "simulation_frequency": 30}


def test_outputs_equal_those_of_camera_and_neuron_alone():
    env = gym.make("LGMD/CCRs-v0", camera="standard", ego_speed=12.0, trace=True, world="laboratory")
    bare = env.unwrapped.__class__(env.unwrapped.scenario)
    camera = EgoCamera("standard")
    neuron = LGMD(camera.shape, fps=30.0)
    bare.reset(seed=2)
    response = neuron.step(camera.render(bare))
    _, info = env.reset(seed=2)
    for _ in range(140):
        assert [float(field[0]) for field in info["lgmd/trace"][0].response] == list(response)
        *_, info = env.step(HOLD)
        bare.step(HOLD)
        response = neuron.step(camera.render(bare))
    assert info["lgmd/standard/spike_frequency"] > 0.0


@pytest.mark.parametrize("identity", ["highway-v0", "merge-v0", "roundabout-v0"])
def test_stock_environments_are_supported(identity):
    env = LGMDObservation(gym.make(identity, config=SMALL), camera="wide", include_frame=True)
    camera = EgoCamera("wide")
    assert env.fps == 30.0
    observation, info = env.reset(seed=0)
    for _ in range(3):
        assert env.observation_space.contains(observation)
        assert set(info) >= {f"lgmd/wide/{name}" for name in ("spike_frequency", "membrane_potential", "ffi")}
        assert info["lgmd/alert"] is (info["lgmd/wide/spike_frequency"] >= 30.0)
        np.testing.assert_array_equal(observation["frame"][:, :, 0], camera.render(env))
        observation, _, terminated, truncated, info = env.step(1)
        if terminated or truncated:
            break
    assert info["lgmd/wide/ffi"] > 0


def test_multiple_cameras_equal_single_cameras():
    names = ["fovea", "paper", "wide"]
    together = rollout(gym.make("LGMD/CCRs-v0", camera=names, ego_speed=10.0), HOLD, 60)
    for index, name in enumerate(names):
        single = rollout(gym.make("LGMD/CCRs-v0", camera=name, ego_speed=10.0), HOLD, 60)
        for key in ("spike_frequency", "membrane_potential", "ffi"):
            got = [result[0][key][index] for result in together]
            np.testing.assert_allclose(got, [result[0][key][0] for result in single], atol=1e-6, err_msg=key)


def test_birdseye_is_a_camera():
    env = gym.make("LGMD/CCRs-v0", camera="birdseye", include_frame=True)
    observation, info = env.reset(seed=0)
    np.testing.assert_array_equal(observation["frame"][:, :, 0], BirdsEye().render(env))
    assert info["lgmd/birdseye/ffi"] == 0.0
    *_, info = env.step(HOLD)
    assert info["lgmd/birdseye/ffi"] > 0.0


def test_camera_params_are_a_camera():
    env = gym.make(
        "LGMD/CCRs-v0",
        camera=Camera(name="custom-20", hfov_deg=20.0),
        include_frame=True,
        world="laboratory",
    )
    observation, info = env.reset(seed=0)
    assert "lgmd/custom-20/ffi" in info
    np.testing.assert_array_equal(observation["frame"][:, :, 0], EgoCamera(hfov_deg=20.0).render(env))


def test_include_base_and_frame():
    env = gym.make("LGMD/CCRs-v0", include_base=True, include_frame=True, camera=["wide", "fovea"])
    observation, _ = env.reset(seed=0)
    assert env.observation_space.contains(observation)
    assert observation["frame"].shape == (90, 160, 2)
    assert observation["base"][0] == observation["ego_speed"][0]
    frame = observation["frame"].copy()
    env.step(HOLD)
    np.testing.assert_array_equal(observation["frame"], frame)  # later steps do not overwrite it


def test_paused_rendering_keeps_the_outputs_until_reset():
    env = gym.make("LGMD/CCRs-v0", ego_speed=15.0)
    before = rollout(env, HOLD, 20)[-1][0]
    env.set_wrapper_attr("rendering_paused", True)
    paused = [env.step(HOLD)[0] for _ in range(3)]
    assert [float(observation["ffi"][0]) for observation in paused] == [float(before["ffi"][0])] * 3
    np.testing.assert_equal(rollout(env, HOLD, 20)[-1][0], before)


def test_equal_seeds_give_equal_episodes():
    env = gym.make("LGMD/CCRs-v0", ego_speed=15.0)
    np.testing.assert_equal(rollout(env, HOLD, 40, seed=1), rollout(env, HOLD, 40, seed=1))


def test_deep_copy_is_independent():
    env = gym.make("LGMD/CCRs-v0", ego_speed=15.0)
    rollout(env, HOLD, 100)
    clone = copy.deepcopy(env)
    potential = env.get_wrapper_attr("response").membrane_potential.copy()
    for _ in range(10):
        of_clone, *_ = clone.step(BRAKE)
    np.testing.assert_array_equal(env.get_wrapper_attr("response").membrane_potential, potential)
    for _ in range(10):
        of_original, *_ = env.step(BRAKE)
    np.testing.assert_equal(of_clone, of_original)


def test_trace_can_be_pickled():
    env = gym.make("LGMD/CCRs-v0", trace=True)
    _, info = env.reset(seed=0)
    np.testing.assert_equal(pickle.loads(pickle.dumps(info["lgmd/trace"])), info["lgmd/trace"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"camera": "fova"}, "unknown camera 'fova'; did you mean 'fovea'"),
        ({"camera": []}, r"camera must have at least one element, got \[\]"),
        ({"camera": ["wide", "wide"]}, "channel names must be unique, got 'wide' twice"),
        ({"params": {"tsp": 0.7}}, "unknown LGMD field 'tsp'; did you mean 't_sp'"),
        ({"speed": 3.0}, "did you mean 'ego_speed'"),
        ({"ego_speed": 50}, "180 km/h"),
        ({"camera": ["wide", "paper"], "include_frame": True}, "cameras must have the same shape"),
    ],
)
def test_invalid_arguments_raise(arguments, message):
    with pytest.raises(ValueError, match=message):
        gym.make("LGMD/CCRs-v0", **arguments)


def test_other_environments_raise():
    with pytest.raises(ValueError, match=r"env must be a highway-env environment, got <.*CartPole"):
        LGMDObservation(gym.make("CartPole-v1"))


def test_step_before_reset_raises():
    env = LGMDObservation(gym.make("highway-v0", config=SMALL).unwrapped)
    with pytest.raises(RuntimeError, match="reset must be called before step"):
        env.step(1)


@pytest.mark.parametrize("env_id", ["LGMD/CCRs-v0", "LGMD/Traffic-Highway-v0"])
def test_known_deceleration_is_the_estimate_of_the_brake(env_id):
    zone = Camera(name="zone", gaze=ToStoppingPoint(brake_known=True))
    env = gym.make(env_id, camera=["wide", zone], world=8003)
    observation, _ = env.reset(seed=1)
    brake = env.unwrapped.brake.max_deceleration
    expected = known_deceleration(Scene(world=8003), brake)
    assert observation["known_deceleration"] == np.float32(expected)
    assert abs(observation["known_deceleration"] / brake - 1.0) < 2.01 * ESTIMATE_ERROR
    assert observation in env.observation_space
    env.close()
    plain = gym.make(env_id)
    assert "known_deceleration" not in plain.observation_space.spaces
    plain.close()


def test_a_trace_that_is_switched_off_during_an_episode_ends():
    env = gym.make("LGMD/CCRs-v0", world="laboratory", trace=True)
    env.reset(seed=0)
    wrapper = env
    while not isinstance(wrapper, LGMDObservation):
        wrapper = wrapper.env
    wrapper.trace = False
    *_, info = env.step(np.zeros(1, np.float32))
    assert "lgmd/trace" not in info


def test_a_new_configuration_during_an_episode_needs_a_reset():
    env = gym.make("LGMD/CCRs-v0", world="laboratory")
    env.reset(seed=0)
    env.unwrapped.configure({"policy_frequency": 15})
    with pytest.raises(RuntimeError, match="call reset"):
        env.step(np.zeros(1, np.float32))
    env.reset(seed=0)
    assert np.isfinite(env.step(np.zeros(1, np.float32))[1])
