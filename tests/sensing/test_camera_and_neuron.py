"""Cameras and neurons on all stock highway-env environments."""

import gymnasium as gym
import highway_env  # noqa: F401  (registers the environments)
import numpy as np
import pytest
from support.cameras import ego_camera

from lgmd_gym import LGMDObservation

CONFIGS = {
    "highway-v0": {"vehicles_count": 9},
    "merge-v0": {},
    "roundabout-v0": {},
    "intersection-v0": {"initial_vehicle_count": 5},
    "racetrack-v0": {"other_vehicles": 1},
    "exit-v0": {"vehicles_count": 9},
    "two-way-v0": {},
    "lane-keeping-v0": {},
    "u-turn-v0": {},
    "parking-v0": {},
}
CAMERAS = ["fovea", "wide"]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("env_id", CONFIGS)
def test_a_hundred_frames_on_every_stock_environment(env_id):
    env = gym.make(env_id, config={"simulation_frequency": 30, **CONFIGS[env_id]})
    env = LGMDObservation(env, camera=CAMERAS, include_frame=True, trace=True)
    cameras = [ego_camera(name) for name in CAMERAS]
    frames, seed, max_ffi = 0, 0, 0.0
    while frames < 100:
        observation, info = env.reset(seed=seed)
        env.action_space.seed(seed)
        seed, done = seed + 1, False
        while frames < 100 and not done:
            observation, _, terminated, truncated, info = env.step(env.action_space.sample())
            done = terminated or truncated
            frames += len(info["lgmd/trace"])
            assert env.observation_space.contains(observation)
            for index, camera in enumerate(cameras):
                np.testing.assert_array_equal(observation["frame"][:, :, index], camera.render(env))
            max_ffi = max(max_ffi, float(observation["ffi"].max()))
        assert seed < 40  # episodes
    assert max_ffi > 0.3  # the frames change
    env.close()


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("env_id", ["highway-v0", "intersection-v0", "roundabout-v0", "two-way-v0"])
@pytest.mark.parametrize("preset", ["wide", "fovea"])
def test_frame_does_not_depend_on_earlier_frames(env_id, preset):
    env = gym.make(env_id, config=CONFIGS[env_id])
    env.reset(seed=3)
    camera = ego_camera(preset)
    for _ in range(12):
        env.step(1)
        for yaw_deg in (-120.0, -35.0, 0.0, 35.0, 120.0):
            camera.render(env, gaze=(yaw_deg, 0.0))
        np.testing.assert_array_equal(camera.render(env), ego_camera(preset).render(env))
    env.close()
