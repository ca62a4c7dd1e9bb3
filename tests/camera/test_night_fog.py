"""Light of the own headlights that fog scatters back."""

import numpy as np
import pytest
from support.cameras import ego_camera, rig
from support.roads import add_car, lens_x, straight_env

from lgmd_gym.camera.effects import look_of
from lgmd_gym.camera.render.light import veil_at

NIGHT = {"light": "night", "roadside": 0.0}


def veil(slope, away, visibility_m=30.0, height=1.2, **fields):
    look = look_of(*rig(light="night", visibility_m=visibility_m, **fields))[()]
    return veil_at(look, height, slope, away)


def numeric_veil(slope, away, visibility_m, height, setback):
    """Return the sum over the droplets on a ray."""
    x = np.linspace(setback, max(away, setback), 400_001)
    extinction = np.log(20.0) / visibility_m
    share = np.where(height - slope * x < 0.65 - 0.01 * x, 1.0, 0.05)
    lit = 1.25 * np.exp(-x / 26.0 - 2.0 * extinction * x) * share * extinction
    return 105.0 * np.sum(0.5 * (lit[1:] + lit[:-1]) * np.diff(x))


@pytest.mark.parametrize("visibility_m", [200.0, 30.0, 5.0])
@pytest.mark.parametrize(
    ("slope", "away", "height"),
    [
        (0.3, 4.0, 1.2),  # the ground near the car
        (0.05, 24.0, 1.2),
        (0.05, 12.0, 1.2),  # a car in front of that ground
        (0.0, 300.0, 1.2),  # above the cut-off
        (-0.2, 300.0, 1.2),
        (0.0, 300.0, 0.4),  # below the headlights, out of the beam at 25 m
        (0.01, 300.0, 0.4),  # along the cut-off
        (0.1, 1.0, 1.2),  # nearer than the headlights
    ],
)
def test_the_closed_form_is_the_sum_over_the_droplets(visibility_m, slope, away, height):
    expected = numeric_veil(slope, away, visibility_m, height, 1.7)
    assert veil(slope, away, visibility_m, height) == pytest.approx(expected, rel=1e-4, abs=1e-4)


def test_the_veil_grows_with_distance_and_below_the_cut_off_with_extinction():
    distances = [veil(0.05, away) for away in (2.0, 8.0, 16.0, 24.0)]
    assert distances == sorted(distances)
    assert distances[0] < distances[-1]
    thick = [veil(0.3, 4.0, visibility_m) for visibility_m in (400.0, 100.0, 30.0)]
    assert thick == sorted(thick)
    assert thick[0] < 0.3 * thick[-1]
    assert veil(0.3, 4.0) > 3.0 * veil(-0.3, 300.0)


def test_the_veil_of_a_frame_falls_off_to_its_sides():
    env = straight_env()
    env.vehicle.position[1] = 100.0  # off the road
    params = {**NIGHT, "visibility_m": 0.5, "texture": 0.0, "setback_m": 0.0, "height_m": 0.5}
    light = ego_camera("wide", **params)
    light.render(env)
    row = light.light[70].astype(float) - 18.0  # all of the ground is behind fog
    assert row[80] > 20.0
    assert np.all(np.diff(row[80:]) <= 1e-4)
    assert np.allclose(row, row[::-1], atol=1e-3)
    assert row[159] < 0.05 * row[80]


def test_a_black_box_has_the_fog_in_front_of_it_only():
    env, visibility_m = straight_env(), 15.0
    add_car(env, lens_x(env) + 10.0, 3.5, shade=0.0)
    camera = ego_camera("wide", **NIGHT, visibility_m=visibility_m, vehicles="box")
    camera.render(env)
    u, v = np.floor(camera.project([lens_x(env) + 8.0, 3.5, 0.5])).astype(int)
    assert u == 80
    clear, slope = np.exp(-10.0 * np.log(20.0) / visibility_m), (v + 0.5 - 45.0) / camera.camera.focal_px
    expected = 18.0 * (1.0 - clear) + veil(slope, 10.0, visibility_m)
    assert camera.light[v, u] == pytest.approx(expected, abs=0.5)
    assert veil(slope, 10.0, visibility_m) < 0.9 * veil(slope, 1.2 / slope, visibility_m)


def test_fog_by_day_and_a_clear_night_have_no_veil():
    assert look_of(*rig(visibility_m=30.0))["veil"] == 0.0
    assert look_of(*rig(light="night"))["veil"] == 0.0
    assert look_of(*rig(light="night", visibility_m=30.0))["veil"] > 0.0
