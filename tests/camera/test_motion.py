"""Motion blur."""

import numpy as np
import pytest
from support.cameras import ego_camera
from support.records import lens_of
from support.roads import add_car, lens_x, straight_env

from lgmd_gym.camera.objects import OBJECT
from lgmd_gym.camera.render.sensor import blur_steps, lens_before


def test_still_scene_has_no_motion_blur():
    env = straight_env(speed=0.0)
    add_car(env, 20.0, 3.5)
    sharp, blurred = ego_camera("wide"), ego_camera("wide", shutter_s=0.02)
    assert np.array_equal(sharp.render(env), blurred.render(env))


def test_motion_blur_is_the_mean_over_the_exposure():
    env = straight_env(speed=20.0)
    car = add_car(env, lens_x(env) + 12.0, 3.5, shade=30, heading=np.pi / 2)
    car.speed = 8.0
    blurred = ego_camera("wide", shutter_s=0.02)
    blurred.render(env)
    sharp, total, n = ego_camera("wide"), 0.0, 40
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
    sharp = ego_camera("fovea").render(env).astype(float)
    blurred = ego_camera("fovea", shutter_s=0.03).render(env).astype(float)
    assert np.abs(np.diff(blurred[:40], axis=1)).mean() < 0.8 * np.abs(np.diff(sharp[:40], axis=1)).mean()


def test_roll_blurs_the_corners():
    """A roll of 0.1 rad is 7.2 px at the corners of this frame: an image per two pixels."""
    lens, rolled, none = lens_of(), lens_of(roll=0.1), np.zeros(0, OBJECT)
    assert blur_steps(lens, lens, 0.01, none, 0) == 1
    assert blur_steps(rolled, lens, 0.01, none, 0) == 4
    middle = lens_of()
    lens_before(rolled, lens, 0.75, middle)
    assert (middle.roll, middle.cos_roll, middle.sin_roll) == pytest.approx(
        (0.025, np.cos(0.025), np.sin(0.025))
    )
