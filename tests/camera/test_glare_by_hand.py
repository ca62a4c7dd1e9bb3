"""Glare of headlights: every expected value is computed by hand."""

from math import cos, pi, radians, sin, sqrt

import numpy as np
import pytest
from support.records import lens_of, record

from lgmd_gym.camera.objects import MODEL_CAR, MODEL_TRUCK, OBJECT
from lgmd_gym.camera.render.glare import add_glare


def halos(obj, lens=None, clear=1.0, budget=1e9, shape=(80, 120)):
    """Return the light added by one object, and the rest of the budget."""
    image = np.zeros(shape, np.float32)
    size = {"length": 4.0, "width": 2.0, "height": 2.0, "model": MODEL_CAR}
    heading = obj.pop("heading", pi)
    obj = record(OBJECT, **(size | {"cos": cos(heading), "sin": sin(heading)} | obj))
    return image, add_glare(image, lens or lens_of(focal=200.0), obj, clear, budget)


def centre(image):
    """Return the mean position of the light."""
    v, u = np.indices(image.shape) + 0.5
    return (image * u).sum() / image.sum(), (image * v).sum() / image.sum()


@pytest.mark.parametrize("heading", [pi, pi - 0.4, pi + 0.4])
@pytest.mark.parametrize(("model", "height"), [(MODEL_CAR, 0.9), (MODEL_TRUCK, 0.44)])
def test_lamps_are_at_the_front_corners_of_the_car(heading, model, height):
    """Lamps are 2 m ahead of the middle and 0.75 m beside it; each halo has a radius of 6 px · √(50/away)."""
    image, _ = halos({"x": 32.0, "y": 1.0, "heading": heading, "model": model})
    for side in (-0.75, 0.75):
        x = 32 + 2 * cos(heading) - side * sin(heading)
        y = 1 + 2 * sin(heading) + side * cos(heading)
        u, v = 60 + 200 * y / x, 40 + 200 * (1 - height) / x
        near = np.zeros_like(image)
        rows, columns = np.indices(image.shape) + 0.5
        near[hypot_of(columns - u, rows - v) < 2.0] = 1.0
        assert centre(image * near) == pytest.approx((u, v), abs=0.25)
        assert image[int(v), int(u)] > 150


def hypot_of(a, b):
    return np.sqrt(a * a + b * b)


def single(away, heading=pi, y=0.0, focal=200.0, **options):
    """Return the light of two lamps that coincide, straight ahead."""
    obj = {"x": away + 2.0 if heading == pi else away, "y": y, "width": 0.0, "heading": heading}
    obj["length"] = 4.0 if heading == pi else 0.0
    lens = lens_of(focal=focal, z=0.9, shape=(81, 121))
    return halos(obj, lens, shape=(81, 121), **options)[0]


@pytest.mark.parametrize(("away", "near"), [(25.0, 1.0), (50.0, 1.0), (100.0, 0.5), (200.0, 0.25)])
def test_peak_of_a_halo_falls_with_the_distance(away, near):
    image = single(away)
    assert image[40, 60] == pytest.approx(2 * 200 * near, rel=1e-5)
    # At a distance d from the centre the light is (1 - d²/r²)³ of the peak.
    radius = max(200 * 0.03 * sqrt(near), 1.5)
    assert image[40, 61] == pytest.approx(400 * near * (1 - 1 / radius**2) ** 3, rel=1e-4)
    assert image[42, 60] == pytest.approx(400 * near * max(1 - 4 / radius**2, 0.0) ** 3, rel=1e-4)
    assert image[40, 60 + int(radius) + 1] == 0.0
    assert single(away, clear=0.5)[40, 60] == pytest.approx(200 * near, rel=1e-5)


@pytest.mark.parametrize(
    ("turn", "share"),
    [(0.0, 1.0), (29.0, 1.0), (40.0, (cos(radians(40)) - 0.5) / 0.366), (59.0, None), (61.0, 0.0)],
)
def test_lamps_shine_forwards(turn, share):
    for side in (-1, 1):
        image = single(50.0, heading=pi + side * radians(turn) + 1e-12)
        share = (cos(radians(turn)) - 0.5) / 0.366 if share is None else share
        assert image[40, 60] == pytest.approx(400 * share, rel=1e-4, abs=1e-6)


def test_which_objects_have_glare():
    for model in range(12):
        image, _ = halos({"x": 20.0, "model": model})
        assert image.any() == (model in (MODEL_CAR, MODEL_TRUCK))
    assert not halos({"x": 20.0, "heading": 0.0})[0].any()
    assert not halos({"x": -20.0, "heading": 0.0})[0].any()  # behind
    assert not halos({"x": 20.0}, budget=0.0)[0].any()


def test_halos_use_up_the_budget():
    # A radius of 6 px around (60.5, 40.5): a box from 54 to 67 along both axes, for each lamp.
    obj = {"x": 42.0, "width": 0.0}
    lens = lens_of(focal=200.0, z=0.9, shape=(81, 121))
    assert halos(dict(obj), lens, shape=(81, 121), budget=1000.0)[1] == pytest.approx(1000 - 2 * 13**2)
    # The area π·r² of a halo is at most the budget.
    image, _ = halos(dict(obj), lens, shape=(81, 121), budget=pi * 4.0)
    assert image[40, 62] == 0.0
    assert image[40, 61] > 0.0
    assert halos({"x": 42.0, "y": 60.0}, budget=500.0)[1] == 500.0  # outside the frame
