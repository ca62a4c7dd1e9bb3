"""The eye on every family of highway-env: camera and neuron together for a hundred frames."""

import gymnasium as gym
import highway_env  # noqa: F401  (registers the environments)
import numpy as np
import pytest

from lgmd_gym import LGMDObservation
from lgmd_gym.camera import EgoCamera

FAMILIES = {
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


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("env_id", FAMILIES)
def test_a_hundred_frames_on_every_family(env_id):
    config = {"simulation_frequency": 30, **FAMILIES[env_id]}
    env = LGMDObservation(
        gym.make(env_id, config=config), camera=["fovea", "wide"], include_frame=True, trace=True
    )
    frames, seed, moving = 0, 0, 0.0
    while frames < 100:
        obs, info = env.reset(seed=seed)
        assert len(env.unwrapped.road.vehicles) <= 10
        env.action_space.seed(seed)
        seed, done = seed + 1, False
        while frames < 100 and not done:
            obs, _, terminated, truncated, info = env.step(env.action_space.sample())
            done = terminated or truncated
            frames += len(info["lgmd/trace"])
            assert env.observation_space.contains(obs)
            assert np.isfinite(obs["ffi"]).all()
            assert obs["frame"].shape == (90, 160, 2)
            assert (obs["frame"].std(axis=(0, 1)) > 3).all()
            moving = max(moving, float(obs["ffi"].max()))
        assert seed < 40
    assert moving > 0.3  # something flows
    env.close()


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("env_id", ["highway-v0", "intersection-v0", "roundabout-v0", "two-way-v0"])
@pytest.mark.parametrize("preset", ["wide", "fovea"])
def test_a_frame_owes_nothing_to_the_frames_before_it(env_id, preset):
    """Whatever a camera has drawn before, the next frame is that of a new one."""
    env = gym.make(env_id, config=FAMILIES[env_id])
    env.reset(seed=3)
    old = EgoCamera(preset)
    for _ in range(12):
        env.step(1)
        for yaw in (-120.0, -35.0, 0.0, 35.0, 120.0):
            old.render(env, gaze=(yaw, 0.0))
        # Sums of coverage that are not cleared would reach every later frame.
        ground, solids = old.stage._scratch[0], old.stage._scratch[9]
        assert not ground.any()
        assert not solids.any()
        np.testing.assert_array_equal(old.render(env), EgoCamera(preset).render(env))
    env.close()
