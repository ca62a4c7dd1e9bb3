"""Vehicles, obstacles and marks in the frame."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from support.cameras import ego_camera
from support.roads import add_car, add_mark, add_obstacle, lens_x, straight_env

from lgmd_gym.camera.objects import index_shade


def test_obstacles_are_upright_and_landmarks_are_flat():
    env = straight_env()
    camera = ego_camera("wide", roadside=0.0)
    bare = camera.render(env).astype(int)
    add_obstacle(env, 20.0, 3.5)
    assert np.abs(camera.render(env) - bare).max() > 30
    env.road.objects.clear()
    add_mark(env, 20.0, 3.5)
    marked = np.abs(camera.render(env) - bare)
    assert marked.max() > 20
    assert marked[:45].max() == 0  # flat on the ground


def test_nearer_car_hides_the_farther_one_in_any_list_order():
    for order in (1, -1):
        env = straight_env()
        cars = [(20.0, 10), (30.0, 250)][::order]
        for x, shade in cars:
            add_car(env, x, 3.5, shade=shade, size=(4, 1.8, 1.5))
        frame = ego_camera("wide", vehicles="box").render(env)
        assert frame[46, 80] < 40


def test_truck_does_not_hide_the_car_next_to_its_rear():
    env = straight_env()
    add_car(env, lens_x(env) + 28.0, 7.0, shade=120, size=(16.0, 2.5, 3.5))
    add_car(env, lens_x(env) + 14.0, 3.5, shade=20, size=(4.0, 1.8, 1.5))
    camera = ego_camera("wide", vehicles="box")
    frame = camera.render(env)
    u, v = camera.project([lens_x(env) + 12.0, 3.5 + 0.5, 0.8])
    assert frame[int(v), int(u)] < 40


def test_missing_road_or_ego_is_an_error():
    with pytest.raises(ValueError, match="no road"):
        ego_camera("wide").render(SimpleNamespace(road=None, vehicle=None))
    env = straight_env()
    env.vehicle = None
    with pytest.raises(ValueError, match="no ego"):
        ego_camera("wide").render(env)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_pose_that_is_not_finite_is_an_error(value):
    env = straight_env()
    env.vehicle.position[0] = value
    with pytest.raises(ValueError, match=r"ego vehicle has position \((nan|inf)"):
        ego_camera("wide").render(env)
    env = straight_env()
    car = add_car(env, 10.0, 3.5)
    car.position[1] = value
    with pytest.raises(ValueError, match="Vehicle 1 of the road has position"):
        ego_camera("wide").render(env)
    env = straight_env()
    add_car(env, 10.0, 3.5, heading=value)
    with pytest.raises(ValueError, match="Vehicle 1 of the road has heading"):
        ego_camera("wide").render(env)


def test_default_shades_cover_dark_to_light():
    shades = [index_shade(0, i) for i in range(8)]
    assert min(shades) < 60
    assert max(shades) > 195
    assert min(abs(a - b) for a, b in itertools.pairwise(shades)) > 40
    assert index_shade(1, 3) != index_shade(0, 3)


def test_shade_of_a_vehicle_sets_its_grey():
    env = straight_env()
    car = add_car(env, 12.0, 3.5)
    greys = []
    for shade in (20, 120, 220):
        car.shade = shade
        greys.append(ego_camera("wide", vehicles="box").render(env)[50, 80])
    assert greys == sorted(greys)
    assert greys[2] - greys[0] > 120


def test_tail_lights_brighten_when_braking():
    env = straight_env()
    car = add_car(env, 12.0, 3.5, shade=60)
    camera = ego_camera("tele")
    unbraked = camera.render(env).astype(int)
    car.action = {"acceleration": -3.0, "steering": 0.0}
    braking = camera.render(env).astype(int)
    assert (braking - unbraked).max() > 120
    assert (braking - unbraked).min() == 0


def test_mark_with_a_shade_is_filled_with_it():
    """A mark lighter or darker than the asphalt has its own grey; an outline is faint in the middle."""
    greys = {}
    for shade in (None, 40, 180):
        env = straight_env()
        mark = add_mark(env, 22.0, 3.5, shade, size=(8.0, 3.0))
        camera = ego_camera("standard", texture=0.0, roadside=0.0)
        frame = camera.render(env)
        column, row = np.floor(camera.project([*mark.position, 0.0])).astype(int)
        greys[shade] = float(frame[row, column])
    assert 104 < greys[None] < 150
    assert greys[40] == pytest.approx(40, abs=3)
    assert greys[180] == pytest.approx(180, abs=3)


@pytest.mark.parametrize(("shade", "striped"), [(120, False), (None, True)])
def test_only_an_obstacle_without_a_shade_has_stripes(shade, striped):
    env = straight_env()
    x, y = add_obstacle(env, 22.0, 3.5, shade).position
    camera = ego_camera("standard", texture=0.0, roadside=0.0)
    frame = camera.render(env)
    corners = camera.project([[x - 1.0, y + side * 0.8, z] for side in (-1, 1) for z in (0.2, 0.8)])
    (u0, v0), (u1, v1) = np.ceil(corners.min(0)).astype(int), np.floor(corners.max(0)).astype(int)
    spread = np.ptp(frame[v0:v1, u0:u1].astype(float))
    assert spread > 50 if striped else spread < 10
