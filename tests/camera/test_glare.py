"""Glare of oncoming headlights at night."""

import numpy as np
from support.cameras import ego_camera
from support.roads import add_car, lens_x, straight_env

from lgmd_gym.camera.render.light import BUDGET_PX


def test_oncoming_headlights_glare_at_night():
    env = straight_env()
    car = add_car(env, lens_x(env) + 25.0, 0.0, heading=np.pi, shade=40)
    camera = ego_camera("standard", light="night", roadside=0.0)
    glare = camera.render(env).astype(int)
    u, v = np.floor(camera.project([car.position[0] - 2.0, -0.64, 0.64])).astype(int)
    assert glare[v, u] == 255
    assert glare[v - 3, u] > 60  # beyond the lamp
    car.heading = 0.0
    assert camera.render(env)[v - 3, u] < 30
    car.heading = np.pi
    day = ego_camera("standard", roadside=0.0)
    assert day.render(env)[:20].mean() > 150
    assert glare[:25].max() < 40  # the sky stays dark


def test_area_of_glare_is_bounded():
    env = straight_env(lanes=20)
    for k in range(200):
        add_car(env, lens_x(env) + 8.0 + 0.5 * k, 3.5 * (k % 20), heading=np.pi)
    camera = ego_camera("fovea", light="night", roadside=0.0)
    with_glare = camera.render(env)
    assert with_glare.max() == 255
    assert 0.25 * with_glare.size > BUDGET_PX
