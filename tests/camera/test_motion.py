"""Motion blur, and vibration of the mount."""

import itertools

import numpy as np
import pytest
from support.roads import add_car, lens_x, straight_env

from lgmd_gym.camera import EgoCamera


def test_still_scene_has_no_motion_blur():
    env = straight_env(speed=0.0)
    add_car(env, 20.0, 3.5)
    sharp, blurred = EgoCamera("wide"), EgoCamera("wide", shutter_s=0.02)
    assert np.array_equal(sharp.render(env), blurred.render(env))


def test_motion_blur_is_the_mean_over_the_exposure():
    env = straight_env(speed=20.0)
    car = add_car(env, lens_x(env) + 12.0, 3.5, shade=30, heading=np.pi / 2)
    car.speed = 8.0
    blurred = EgoCamera("wide", shutter_s=0.02)
    blurred.render(env)
    sharp, total, n = EgoCamera("wide"), 0.0, 40
    at, there = env.vehicle.position.copy(), car.position.copy()
    for k in range(n):
        ago = (k + 0.5) / n * 0.02
        env.vehicle.position[0] = at[0] - 20.0 * ago
        car.position[1] = there[1] - 8.0 * ago
        sharp.render(env)
        total = total + sharp.light.astype(float) / n
    env.vehicle.position[:], car.position[:] = at, there
    frozen = sharp.render(env).astype(float)
    assert np.abs(blurred.light - total).mean() < 0.15 * np.abs(frozen - total).mean() + 0.1


def test_turning_blurs_the_horizon():
    env = straight_env(speed=15.0)
    env.vehicle.action = {"steering": 0.15, "acceleration": 0.0}
    sharp = EgoCamera("fovea").render(env).astype(float)
    blurred = EgoCamera("fovea", shutter_s=0.03).render(env).astype(float)
    assert np.abs(np.diff(blurred[:40], axis=1)).mean() < 0.8 * np.abs(np.diff(sharp[:40], axis=1)).mean()


def test_heave_has_its_rms_and_stops_at_standstill():
    env = straight_env()
    camera = EgoCamera("fovea", heave_m=0.01)
    heights = []
    for env.steps in range(300):
        camera.render(env)
        heights.append(camera._lens["z"])
    assert np.mean(heights) == pytest.approx(1.2, abs=1e-3)
    assert np.std(heights) == pytest.approx(0.01 * np.sqrt(13.89 / 14.0), rel=0.15)
    assert max(abs(b - a) for a, b in itertools.pairwise(heights)) < 0.02
    env.vehicle.speed = 0.0
    camera.render(env)
    assert camera._lens["z"] == 1.2
