"""Bodies of vehicles: their choice by a hash, and their pictures."""

from collections import Counter

import numpy as np
import pytest
from reference.camera import worst_error
from support.cameras import ego_camera, rig
from support.roads import box_record, lens_x, set_roadside, straight_env

from lgmd_gym.camera.objects import BODY_MODELS, MODEL_CAR, MODEL_TRUCK, body_of
from lgmd_gym.camera.render.models import all_models

CARS, TRUCKS = {"small", "saloon", "suv"}, {"truck", "trailer", "bus"}
NAMES = {body.model: name for name, body in BODY_MODELS.items()}
SHOWN = [name for name, body in BODY_MODELS.items() if body.model not in (MODEL_CAR, MODEL_TRUCK)]


@pytest.mark.parametrize(
    ("length", "width", "names"),
    [
        (5.19, 1.8, CARS),
        (5.19, 2.4, CARS),
        (5.2, 2.3, {"van"}),
        (7.49, 2.0, {"van"}),
        (7.49, 2.31, {"truck", "bus"}),
        (7.5, 2.0, {"truck", "bus"}),
        (9.99, 2.5, {"truck", "bus"}),
        (10.0, 2.5, TRUCKS),
    ],
)
def test_length_and_width_limit_the_bodies(length, width, names):
    drawn = Counter(NAMES[body_of(7, index, length, width, 1.5)[0]] for index in range(400))
    assert set(drawn) == names
    assert min(drawn.values()) > 60


@pytest.mark.parametrize("height", [1.5, 1.427])
def test_default_height_is_replaced_by_a_usual_one(height):
    heights = {}
    for world in range(20):
        for index in range(20):
            model, drawn = body_of(world, index, 4.0, 1.8, height)
            heights.setdefault(NAMES[model], []).append(drawn)
    for name, drawn in heights.items():
        body = BODY_MODELS[name]
        span = body.highest - body.lowest
        assert body.lowest <= min(drawn) < body.lowest + 0.1 * span
        assert body.highest - 0.1 * span < max(drawn) <= body.highest


def test_other_heights_are_kept():
    assert {body_of(3, index, 4.0, 1.8, 1.7)[1] for index in range(9)} == {1.7}


def test_choice_is_a_function_of_world_and_index():
    first = [body_of(11, index, 4.0, 1.8, 1.5) for index in range(50)]
    assert first == [body_of(11, index, 4.0, 1.8, 1.5) for index in range(50)]
    others = [body_of(12, index, 4.0, 1.8, 1.5) for index in range(50)]
    assert sum(a[0] == b[0] for a, b in zip(first, others, strict=True)) < 30


@pytest.mark.parametrize("world", [0, -1, 2**31, 2**62 + 5])
def test_any_integer_is_a_world(world):
    assert body_of(world, 3, 4.0, 1.8, 1.5)[0] in NAMES


def posed(name, heading, shape=(24, 32), **fields):
    """Return a scene with one body, and the parameters of a camera."""
    env = straight_env(lanes=1, y=0.0)
    params = rig({"shape": shape, "hfov_deg": 50.0, "texture": 0.0, "roadside": 0.0, **fields})
    body = BODY_MODELS[name]
    size = (4.0 * body.highest, 2.0, body.highest)
    record = box_record(lens_x(env) + 12.0, 0.5, size, heading=heading, model=body.model)
    set_roadside(env, params, record)
    return env, params


@pytest.mark.parametrize("name", SHOWN)
@pytest.mark.parametrize("heading", [0.2, 2.5])
def test_body_is_drawn_as_along_the_rays(name, heading):
    env, params = posed(name, heading)
    assert worst_error(params, env) <= 1.0


@pytest.mark.parametrize("name", SHOWN)
def test_lamps_of_a_body_are_on_at_night(name):
    """Rear lamps are at 170, and headlights dazzle."""
    env, params = posed(name, 0.0, shape=(96, 128), hfov_deg=20.0, light="night")
    rear = ego_camera(params).render(env)
    assert np.sum(np.abs(rear.astype(int) - 170) < 3) > 10
    env, params = posed(name, np.pi, shape=(96, 128), light="night")
    assert np.sum(ego_camera(params).render(env) == 255) > 20


@pytest.mark.parametrize("name", SHOWN)
def test_details_have_the_corners_of_convex_polygons_inside_their_face(name):
    models = all_models(linear=False)
    for solid in range(*models.models[BODY_MODELS[name].model]):
        for polygon in range(*models.solids[solid]):
            assert np.abs(models.corners[polygon, :2]).max() <= 0.5 + 1e-9
            assert models.corners[polygon, 2].min() >= 0.0
            assert models.corners[polygon, 2].max() <= 1.0 + 1e-9
