"""Frames against the slow reference; `tests/fuzz/camera_reference.py` draws random scenes."""

import numpy as np
import pytest
from reference.camera import separate_boxes, worst_error
from support.cameras import ego_camera, rig
from support.roads import add_car, add_mark, add_obstacle, box_record, lens_x, set_roadside, straight_env

pytestmark = pytest.mark.slow
SMALL = {"shape": (21, 34), "hfov_deg": 70.0}


def scene(**road):
    """Return a road with an oncoming car, a car ahead, a truck, a barrier and marks."""
    env = straight_env(heading=0.03, **road)
    x = lens_x(env)
    add_car(env, x + 7.0, 6.5, 190.0, heading=np.pi)
    add_car(env, x + 14.0, 3.0, 60.0)
    add_car(env, x + 30.0, 0.0, 120.0, size=(12.0, 2.5, 3.4))
    add_obstacle(env, x + 9.0, -1.0)
    add_mark(env, x + 6.0, 3.0)
    add_mark(env, x + 12.0, 11.0, 160.0)  # paint on the verge
    return env


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"light": "night", "vehicles": "box"},
        {"visibility_m": 30.0, "guard_rail": True},
        {"visibility_m": 20.0, "light": "night", "vehicles": "box"},
        {
            "visibility_m": 20.0,
            "light": "night",
            "vehicles": "box",
            "height_m": 0.4,
            "setback_m": 0.0,
        },
        {"pitch_deg": 0.4},  # the horizon is within a row
        {"pitch_deg": 20.0, "yaw_deg": 30.0},
        {"height_m": 0.4},  # below the cabins
        {"height_m": 4.0, "setback_m": -4.0, "pitch_deg": -35.0},
    ],
)
def test_light_is_that_of_many_rays(fields):
    params = rig({**SMALL, "roadside": 0.0, **fields})
    assert worst_error(params, scene()) <= 1.0


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"pitch_deg": 0.4, "visibility_m": 30.0, "guard_rail": True},  # the horizon crosses rows
        {"pitch_deg": 20.0, "yaw_deg": 30.0, "light": "night", "vehicles": "box"},
        {"visibility_m": 20.0, "light": "night", "vehicles": "box"},
        {"shape": (31, 140), "hfov_deg": 20.0},
    ],
)
def test_light_of_a_rolling_camera_is_that_of_many_rays(fields):
    params = rig({**SMALL, "roadside": 0.0, "road": "rough", "seed": 1, **fields})
    env = scene()
    env.vehicle.speed, env.steps = 60.0, 24
    camera = ego_camera(params)
    camera.render(env)
    assert camera._lens["roll"] < np.radians(-0.85)
    assert worst_error(params, env) <= 1.0


def test_lens_that_points_down_shows_what_is_behind_it():
    env = straight_env()
    x = lens_x(env)
    add_car(env, x - 4.0, 0.0, 230.0)
    add_mark(env, x - 3.0, 6.5, 200.0)
    params = rig(shape=(60, 20), hfov_deg=100.0, pitch_deg=-60.0, height_m=5.0, roadside=0.0)
    assert worst_error(params, env) <= 1.0


def cross_traffic(seed):
    """Return a road with trailers, walls and cars in any direction that do not touch."""
    rng = np.random.default_rng(seed)
    env = straight_env(lanes=1, y=0.0)
    x = lens_x(env)
    for size in [
        (16.0, 2.5, 4.0),
        (50.0, 0.3, 3.0),
        *3 * [(22.0, 2.5, 3.0), (4.0, 1.8, 1.5), (8.0, 2.5, 3.0)],
    ]:
        heading = float(rng.uniform(-3.0, 3.0))
        add_car(env, x + rng.uniform(3.0, 45.0), rng.uniform(-16.0, 16.0), heading=heading, size=size)
    return env


@pytest.mark.parametrize("seed", [0, 8, 16, 33, 74, 233, 299])
def test_long_boxes_hide_each_other_as_along_the_rays(seed):
    env, params = cross_traffic(seed), rig({**SMALL, "roadside": 0.0, "vehicles": "box"})
    separate_boxes(env)
    assert worst_error(params, env) <= 1.0


@pytest.mark.parametrize("ahead", [-3.0, 4.0, 14.0])
@pytest.mark.parametrize("pitch_deg", [0.0, 25.0])
def test_bridge_is_above_what_is_below_it(ahead, pitch_deg):
    env = scene()
    x = lens_x(env)
    params = rig({**SMALL, "pitch_deg": pitch_deg})
    deck = box_record(x + ahead, 3.5, (10.0, 30.0, 7.0), base=5.0)
    wall = box_record(x + 20.0, 14.0, (50.0, 0.3, 3.0))
    set_roadside(env, params, np.concatenate((deck, wall)))
    assert worst_error(params, env) <= 1.0
