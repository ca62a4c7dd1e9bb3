"""Glare of headlights: every expected value is computed by hand."""

from math import atan, cos, hypot, pi, radians, sin, sqrt, tan

import numpy as np
import pytest
from support.records import lens_of, record

from lgmd_gym.camera.objects import BODY_MODELS, MODEL_CAR, MODEL_LAMP, MODEL_MOTORCYCLE, MODEL_TRUCK, OBJECT
from lgmd_gym.camera.pinhole import project
from lgmd_gym.camera.render.light import BUDGET_PX, add_glare
from lgmd_gym.camera.render.models import all_models


def halos(obj, lens=None, clear=1.0, budget=1e9, shape=(80, 120)):
    """Return the light added by one object, and the rest of the budget."""
    image = np.zeros(shape, np.float32)
    size = {"length": 4.0, "width": 2.0, "height": 2.0, "model": MODEL_CAR}
    heading = obj.get("heading", pi)
    obj = {name: value for name, value in obj.items() if name != "heading"}
    obj = record(OBJECT, **(size | {"cos": cos(heading), "sin": sin(heading)} | obj))
    lamps = all_models(linear=False).lamps[obj.model]
    return image, float(add_glare(image, lens or lens_of(focal=200.0), obj, lamps, clear, budget))


def light(distance, radius, peak):
    """Return the light at a distance from the centre of a halo [px]."""
    return peak * max(1 - (distance / radius) ** 2, 0.0) ** 3


@pytest.mark.parametrize("pitch", [0.0, 0.06, -0.06])
@pytest.mark.parametrize("heading", [pi, pi - 0.4, pi + 0.4])
@pytest.mark.parametrize(("model", "height"), [(MODEL_CAR, 0.9), (MODEL_TRUCK, 0.44)])
def test_lamps_are_at_the_front_corners_of_the_car(heading, model, height, pitch):
    """Lamps are 2 m ahead of the middle and 0.75 m beside it; their halos have a radius of 6 px."""
    obj = {"x": 32.0, "y": 1.0, "heading": heading, "model": model}
    image, _ = halos(obj, lens_of(focal=200.0, pitch=pitch))
    places = []
    for side in (-0.75, 0.75):
        x = 32 + 2 * cos(heading) - side * sin(heading)
        y = 1 + 2 * sin(heading) + side * cos(heading)
        up = height - 1
        depth = x * cos(pitch) + up * sin(pitch)
        places.append((60 + 200 * y / depth, 40 - 200 * tan(atan(up / x) - pitch)))
    for u, v in places:
        row, column = int(v), int(u)
        distances = [hypot(column + 0.5 - a, row + 0.5 - b) for a, b in places]
        assert image[row, column] == pytest.approx(sum(light(d, 6.0, 200.0) for d in distances), rel=1e-4)


def test_halos_roll_with_the_lens():
    lens = lens_of(focal=200.0, pitch=0.05, roll=0.4)
    image, _ = halos({"x": 32.0, "y": 1.0, "length": 0.0, "width": 0.0}, lens)
    u, v = project(lens, np.array([32.0, 1.0, 0.9]))
    rows, columns = np.indices(image.shape) + 0.5
    assert (image * columns).sum() / image.sum() == pytest.approx(u, abs=0.05)
    assert (image * rows).sum() / image.sum() == pytest.approx(v, abs=0.05)


def single(away, turn=0.0, bearing=0.0, focal=200.0, **options):
    """Return the light of two lamps that coincide, in the middle of the frame."""
    x, y = away * cos(bearing), away * sin(bearing)
    obj = {"x": x, "y": y, "length": 0.0, "width": 0.0, "heading": bearing + pi + turn}
    lens = lens_of(bearing, focal=focal, z=0.9, shape=(81, 121))
    return halos(obj, lens, shape=(81, 121), **options)[0]


@pytest.mark.parametrize("bearing", [0.0, 0.7, -2.0])
@pytest.mark.parametrize(("away", "near"), [(25.0, 1.0), (50.0, 1.0), (100.0, 0.5), (200.0, 0.25)])
def test_peak_of_a_halo_falls_with_the_distance(away, near, bearing):
    image = single(away, bearing=bearing)
    radius = 200 * 0.03 * sqrt(near)
    for row, column in ((40, 60), (40, 61), (42, 60), (38, 59), (40, 60 + int(radius) + 1)):
        expected = light(hypot(row - 40, column - 60), radius, 2 * 200 * near)
        assert image[row, column] == pytest.approx(expected, rel=1e-4, abs=1e-6)
    assert single(away, bearing=bearing, clear=0.5)[40, 60] == pytest.approx(200 * near, rel=1e-5)


@pytest.mark.parametrize(("focal", "radius"), [(20.0, 1.5), (100.0, 3.0), (700.0, 21.0), (2000.0, 24.0)])
def test_radius_of_a_halo_is_1_7_degrees_within_limits(focal, radius):
    image = single(50.0, focal=focal)
    for distance in (1, 5, 12, 22):
        expected = light(distance, radius, 400.0)
        assert image[40, 60 + distance] == pytest.approx(expected, rel=1e-3, abs=1e-4)


@pytest.mark.parametrize("bearing", [0.0, 0.7])
@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(
    ("turn", "share"),
    [
        (0, 1.0),
        (29, 1.0),
        (40, (cos(radians(40)) - 0.5) / 0.366),
        (59, (cos(radians(59)) - 0.5) / 0.366),
        (61, 0),
    ],
)
def test_lamps_shine_forwards(turn, share, side, bearing):
    image = single(50.0, side * radians(turn), bearing)
    assert image[40, 60] == pytest.approx(400 * share, rel=1e-4, abs=1e-6)


def test_which_objects_have_glare():
    shining = {MODEL_LAMP, MODEL_MOTORCYCLE, *(body.model for body in BODY_MODELS.values())}
    for model in range(len(all_models(linear=False).models)):
        image, _ = halos({"x": 20.0, "model": model})
        assert image.any() == (model in shining)
    assert not halos({"x": 20.0, "heading": 0.0})[0].any()
    assert not halos({"x": -20.0, "heading": 0.0})[0].any()  # behind
    assert not halos({"x": 20.0}, budget=0.0)[0].any()
    assert not single(0.999).any()  # nearer than 1 m
    assert single(1.001).any()


@pytest.mark.parametrize(
    ("u", "v"),
    [(-3.0, 40.5), (123.0, 40.5), (60.5, -3.0), (60.5, 83.0), (-2.0, -2.0), (122.0, 82.0), (0.2, 80.9)],
)
def test_halo_that_is_partly_outside_the_frame(u, v):
    obj = {"x": 50.0, "y": 0.0, "length": 0.0, "width": 0.0}
    lens = lens_of(focal=200.0, z=0.9)
    lens.centre_u, lens.centre_v = u, v
    image, _ = halos(obj, lens, shape=(81, 121))
    rows, columns = np.indices(image.shape) + 0.5
    square = (rows - v) ** 2 + (columns - u) ** 2
    np.testing.assert_allclose(image, 400 * np.maximum(1 - square / 36, 0) ** 3, rtol=1e-3, atol=1e-3)
    assert image.any()


def test_halos_use_up_the_budget():
    # A radius of 6 px around (60.5, 40.5): a box from 54 to 67 along both axes, for each lamp.
    obj = {"x": 42.0, "width": 0.0}
    lens = lens_of(focal=200.0, z=0.9, shape=(81, 121))
    assert halos(obj, lens, shape=(81, 121), budget=1000.0)[1] == 1000 - 2 * 13**2
    # The area π·r² of a halo is at most the budget, here a radius of 2 px.
    image, left = halos(obj, lens, shape=(81, 121), budget=pi * 4.0)
    assert [image[40, 60 + distance] for distance in (0, 1, 2)] == pytest.approx([200, 200 * 0.75**3, 0])
    assert left == pytest.approx(pi * 4 - 5**2)
    assert halos({"x": 42.0, "y": 60.0}, budget=500.0)[1] == 500.0  # outside the frame
    assert BUDGET_PX == 3000.0
