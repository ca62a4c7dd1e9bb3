"""Night, fog, noise and dive."""

import numpy as np
import pytest
from support.cameras import ego_camera, rig
from support.roads import add_car, straight_env

from lgmd_gym.camera.effects import look_of
from lgmd_gym.camera.render.light import light_at


def test_fog_night_and_noise_change_contrast_light_and_deviation():
    env = straight_env()
    add_car(env, 60.0, 3.5, shade=20)
    env.steps = 10
    clear = ego_camera("tele").render(env).astype(float)
    fog = ego_camera("tele", visibility_m=60.0).render(env).astype(float)
    assert np.ptp(fog[30:55]) < 0.35 * np.ptp(clear[30:55])
    night = ego_camera("tele", light="night").render(env).astype(float)
    assert night[:30].mean() < 20 < clear[:30].mean()
    assert night.max() > 120  # tail lights
    noisy = ego_camera("tele", read_noise=4.0).render(env).astype(float)
    assert (noisy - clear).std() == pytest.approx(4.0, rel=0.1)
    env.steps = 11
    assert not np.array_equal(ego_camera("tele", read_noise=4.0).render(env), noisy)


def test_dive_pitches_the_camera():
    env = straight_env()
    env.steps = 7
    point = [1000.0, 3.5, 1.2]
    camera = ego_camera("fovea", dive_deg=0.1)
    camera.render(env)
    assert camera.project(point)[1] == pytest.approx(45.0, abs=1e-6)
    env.vehicle.action = {"acceleration": -9.0, "steering": 0.0}
    camera.render(env)
    # Nose-down pitch of 0.9°: the point moves up by 14.4 px.
    assert camera.project(point)[1] == pytest.approx(45.0 - 0.9 * camera.camera.pixels_per_degree, abs=0.1)


@pytest.mark.parametrize("light", ["day", "night"])
def test_fog_hides_the_ground_behind_a_lens_that_points_down(light):
    env = straight_env()
    camera = ego_camera(shape=(90, 40), hfov_deg=90.0, pitch_deg=-60.0, light=light, visibility_m=0.01)
    camera.render(env)
    haze = 18.0 if light == "night" else 200.0
    assert camera.light[-1] == pytest.approx(np.full(40, haze), abs=0.1)


def test_the_upper_beam_has_four_times_the_light_of_the_low_beam_at_50_m():
    low, upper = (look_of(*rig(weather=name))[()] for name in ("night", "night_upper_beam"))
    for ahead, across, ratio in ((50.0, 0.0, 4.0), (50.0, 10.0, 4.0), (10.0, 0.0, 1.3), (0.0, 0.0, 1.0)):
        lights = [light_at(ahead, across, look) - look["night_light"] for look in (low, upper)]
        assert lights[1] / lights[0] == pytest.approx(ratio, rel=0.03)
    env = straight_env()
    dark, lit = (ego_camera("wide", weather=name).render(env) for name in ("night", "night_upper_beam"))
    assert lit[47:60].mean() > 1.5 * dark[47:60].mean()


def test_the_upper_beam_needs_night():
    env = straight_env()
    assert np.array_equal(ego_camera("wide", upper_beam=True).render(env), ego_camera("wide").render(env))
