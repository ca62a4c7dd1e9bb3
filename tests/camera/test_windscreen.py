"""Reflections of the dashboard in the windscreen."""

import numpy as np
import pytest
from support.roads import add_car, straight_env

from lgmd_gym.camera import CameraParams, EgoCamera


def light_of(env, **fields):
    camera = EgoCamera(**{"params": "wide", **fields})
    camera.render(env)
    return camera.light.astype(float)


def test_a_share_of_zero_is_the_plain_frame_and_others_add_light_in_proportion():
    env = straight_env()
    add_car(env, 20.0, 3.5)
    plain = light_of(env)
    assert np.array_equal(light_of(env, windscreen=0.0), plain)
    little, much = light_of(env, windscreen=0.05) - plain, light_of(env, windscreen=0.2) - plain
    assert little.min() >= 0.0
    assert much == pytest.approx(4.0 * little, abs=1e-3)
    # The sky of the laboratory has the grey 172 at the zenith; straight ahead, 5 % of it on average.
    assert little[35:55].mean() == pytest.approx(0.05 * 172.0, rel=0.2)


def test_the_reflections_are_stronger_below_and_smooth():
    env = straight_env()
    pattern = light_of(env, windscreen=0.2) - light_of(env)
    assert pattern[60:].mean() > 1.5 * pattern[:30].mean()
    assert np.ptp(pattern, axis=1).min() > 1.0
    assert np.abs(np.diff(pattern, axis=0)).max() < 0.1 * pattern.max()
    assert np.abs(np.diff(pattern, axis=1)).max() < 0.1 * pattern.max()


def test_the_reflections_are_fixed_in_the_frame():
    patterns = []
    for steps in (0, 30):
        env = straight_env(x=float(steps), speed=30.0)
        env.steps = steps
        fields = {"road": "rough", "shutter_s": 0.02}
        patterns.append(light_of(env, windscreen=0.2, **fields) - light_of(env, **fields))
    assert patterns[0] == pytest.approx(patterns[1], abs=1e-3)


def test_the_reflections_are_dim_at_night_and_depend_on_seed_and_world():
    env = straight_env()
    day = light_of(env, windscreen=0.2) - light_of(env)
    night = light_of(env, windscreen=0.2, light="night") - light_of(env, light="night")
    assert 0.0 < night.max() < 0.05 * day.max()
    other = light_of(env, windscreen=0.2, seed=1) - light_of(env, seed=1)
    assert np.abs(other - day).max() > 5.0
    worlds = [light_of(env, windscreen=0.2, world=n) - light_of(env, world=n) for n in (1, 2)]
    assert not np.allclose(worlds[0] / worlds[0].mean(), worlds[1] / worlds[1].mean(), atol=0.1)


def test_lenses_show_parts_of_one_pattern():
    env = straight_env()
    wide = light_of(env, windscreen=0.2) - light_of(env)
    narrow = {"params": "fovea", "roadside": 0.0}
    fovea = light_of(env, **narrow, windscreen=0.2) - light_of(env, **narrow)
    assert fovea[40:50, 70:90].mean() == pytest.approx(wide[44:46, 79:81].mean(), rel=0.02)


def test_a_share_out_of_range_is_refused():
    for value in (-0.01, 0.21, float("nan")):
        with pytest.raises(ValueError, match="camera windscreen must be"):
            CameraParams(windscreen=value)
