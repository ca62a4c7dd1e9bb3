"""What is left out because it is outside the frame does not change the frame."""

import math

import numpy as np
import pytest
from support.cameras import ego_camera
from support.roads import add_car, straight_env

SHAPE = (48, 80)
MARGIN = (96, 160)


def _crop_and_frame(env, hfov_deg, **fields):
    """Return the middle of a large frame, and a frame with the same focal length and the size of the crop."""
    height, width = (SHAPE[0] + 2 * MARGIN[0], SHAPE[1] + 2 * MARGIN[1])
    tan = math.tan(math.radians(hfov_deg / 2)) * width / SHAPE[1]
    large = ego_camera(
        "wide", shape=(height, width), hfov_deg=2 * math.degrees(math.atan(tan)), **fields
    ).render(env)
    small = ego_camera("wide", shape=SHAPE, hfov_deg=hfov_deg, **fields).render(env)
    crop = large[MARGIN[0] : height - MARGIN[0], MARGIN[1] : width - MARGIN[1]]
    return crop.astype(int), small.astype(int)


@pytest.mark.parametrize("pitch_deg", [0.0, -12.0, 9.0])
@pytest.mark.parametrize("hfov_deg", [5.0, 20.0, 40.0])
def test_frame_is_the_middle_of_a_larger_frame(hfov_deg, pitch_deg):
    rng = np.random.default_rng(4)
    for _ in range(12):
        env = straight_env(x=0.3)
        env.vehicle.heading = rng.uniform(-0.15, 0.15)
        for k in range(4):
            add_car(env, 9.0 + 9.0 * k, rng.uniform(-5.0, 9.0), 40 + 40 * k, heading=rng.uniform(-3.0, 3.0))
        add_car(env, 50.0, rng.uniform(-9.0, 9.0), 150, size=(16.0, 2.5, 3.5))
        crop, frame = _crop_and_frame(env, hfov_deg, pitch_deg=pitch_deg, roadside=2.0)
        assert np.abs(crop - frame).max() <= 1
        assert frame.std() > 1.0


@pytest.mark.parametrize("hfov_deg", [20.0, 40.0])
def test_frame_of_a_rolling_camera_is_the_middle_of_a_larger_frame(hfov_deg):
    """The level of the texture, which is left out, follows the middle of the visible part of a row."""
    rng = np.random.default_rng(5)
    for env_steps in range(0, 240, 24):
        env = straight_env(x=0.3, speed=60.0)
        env.steps = env_steps
        for k in range(5):
            add_car(env, 9.0 + 6.0 * k, rng.uniform(-9.0, 13.0), 40 + 40 * k, heading=rng.uniform(-3.0, 3.0))
        crop, frame = _crop_and_frame(env, hfov_deg, road="rough", seed=1, roadside=2.0, texture=0.0)
        assert np.mean(np.abs(crop - frame) > 1) < 0.002


@pytest.mark.parametrize("world", [2, 3, 5, 8])
@pytest.mark.parametrize(("rows", "lift"), [(18, -1.2), (20, 0.1), (24, -0.6)])
def test_field_of_a_stopping_zone_is_the_middle_of_a_larger_frame(world, rows, lift):
    """Most of the roadside is above a field of the ground, and close shadows are below one at the horizon."""
    margin = (64, 120)
    large_shape = rows + 2 * margin[0], 80 + 2 * margin[1]
    env = straight_env(x=0.3, speed=14.0)
    add_car(env, 18.0, 0.5, 40)
    for x in range(0, 60, 6):
        env.vehicle.position[0] = float(x)
        large = _light(env, large_shape, 2.4 * large_shape[1] / 80, lift, world)
        small = _light(env, (rows, 80), 2.4, lift, world)
        crop = large[margin[0] : -margin[0], margin[1] : -margin[1]]
        # The order of objects that hide each other in turn depends on their number.
        assert np.mean(np.abs(crop - small) > 1.0) < 0.01
        assert small.std() > 0.1


def _light(env, shape, span_m, lift, world):
    """Return the light of a frame without noise: that of the sensor depends on the size of the frame."""
    camera = ego_camera(shape=shape, span_m=span_m, gaze="stopping", lift=lift, world=world)
    camera.render(env)
    return camera.light.copy()
