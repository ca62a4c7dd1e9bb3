"""highway-env's top view as a camera."""

import copy
from types import SimpleNamespace

import gymnasium as gym
import highway_env  # noqa: F401
import numpy as np
import pytest

from lgmd_gym.camera import BirdsEye


@pytest.fixture
def env():
    config = {"vehicles_count": 2, "lanes_count": 3, "observation": {"type": "TimeToCollision"}}
    env = gym.make("highway-v0", config=config)
    env.reset(seed=0)
    yield env
    env.close()


def test_world_x_runs_along_the_columns(env):
    frame = BirdsEye((60, 200)).render(env)
    assert frame.shape == (60, 200)
    assert frame.dtype == np.uint8
    # The solid line at the edge of the road along +x is a bright row, not a bright column.
    assert frame.mean(axis=1).max() > 140
    assert frame.mean(axis=0).max() < 130


def test_a_car_ahead_is_to_the_right_and_larger_y_is_lower(env):
    ego = env.unwrapped.vehicle
    other = next(v for v in env.unwrapped.road.vehicles if v is not ego)
    camera = BirdsEye((90, 160), scaling=5.0)
    other.position[:] = ego.position + np.array([-500.0, 0.0])
    bare = camera.render(env).astype(int)
    centre = env.unwrapped.config["centering_position"]
    other.position[:] = ego.position + np.array([9.0, 4.0])
    other.heading = 0.0
    rows, cols = np.nonzero(np.abs(camera.render(env) - bare) > 20)
    assert cols.mean() == pytest.approx(160 * centre[0] + 45, abs=3)
    assert rows.mean() == pytest.approx(90 * centre[1] + 20, abs=3)


def test_environment_stays_unchanged(env):
    base = env.unwrapped
    config, metadata = copy.deepcopy(base.config), dict(base.metadata)
    camera = BirdsEye((45, 80))
    camera.render(env)
    assert base.config == config
    assert base.metadata == metadata
    assert base.viewer is None
    camera.close()


def test_equal_states_give_equal_frames_and_out_is_filled(env):
    camera = BirdsEye((45, 80))
    first = camera.render(env)
    out = np.zeros((45, 80), np.uint8)
    assert camera.render(env, out) is out
    assert np.array_equal(first, out)
    with pytest.raises(ValueError, match="out must be"):
        camera.render(env, np.zeros((80, 45), np.uint8))


def test_frame_is_that_of_the_given_environment_after_its_last_reset(env):
    camera = BirdsEye((45, 80))
    camera.render(env)
    env.reset(seed=5)
    after = camera.render(env)
    assert np.array_equal(after, BirdsEye((45, 80)).render(env))
    other = gym.make("roundabout-v0")
    other.reset(seed=1)
    assert not np.array_equal(camera.render(other), after)
    other.close()


def test_viewer_of_the_environment_survives_close():
    env = gym.make("highway-v0", render_mode="rgb_array", config={"vehicles_count": 2})
    env.reset(seed=0)
    picture = env.render()
    camera = BirdsEye((45, 80))
    camera.render(env)
    camera.close()
    assert np.array_equal(env.render(), picture)
    env.close()


def test_errors_name_the_argument():
    with pytest.raises(ValueError, match="shape"):
        BirdsEye((0, 10))
    with pytest.raises(ValueError, match="scaling"):
        BirdsEye(scaling=0.0)
    with pytest.raises(ValueError, match="reset"):
        BirdsEye().render(SimpleNamespace(road=None))
