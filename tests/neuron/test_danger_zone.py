import math

import numpy as np
import pytest

from lgmd_gym.neuron import LGMD, danger_zone


def focal(width, hfov):
    return width / 2 / math.tan(math.radians(hfov / 2))


def test_zone_width_follows_the_pinhole_projection():
    shape = (120, 200)
    zone = danger_zone(shape, 40.0, 3.5, height_m=1.2)
    assert zone.dtype == np.float32
    assert not zone[:60].any()  # the horizon is at half height
    for row in (65, 80, 119):
        # Half the lane width over the camera height, per pixel below the horizon.
        width = min(200, 2 * (row + 0.5 - 60) * 1.75 / 1.2)
        assert zone[row].sum() == pytest.approx(width, abs=0.51)
    assert np.array_equal(zone, zone[:, ::-1])
    assert zone.min() >= 0
    assert zone.max() == 1


def test_near_and_far_limit_the_rows():
    shape, hfov = (200, 100), 30.0
    f = focal(100, hfov)
    zone = danger_zone(shape, hfov, 2.0, height_m=1.5, near_m=5.0, far_m=20.0)
    rows = np.flatnonzero(zone.any(1))
    assert rows[0] == pytest.approx(100 + f * 1.5 / 20, abs=1)
    assert rows[-1] == pytest.approx(100 + f * 1.5 / 5, abs=1)


def test_pitch_moves_the_horizon():
    shape, hfov, pitch = (200, 160), 30.0, 4.0
    zone = danger_zone(shape, hfov, pitch_deg=-pitch)
    horizon = 100 - focal(160, hfov) * math.tan(math.radians(pitch))
    assert np.flatnonzero(zone.any(1))[0] == pytest.approx(horizon, abs=1.5)


def test_clearance_covers_the_vehicle_ahead():
    shape, hfov = (120, 160), 20.0
    f = focal(160, hfov)
    flat = danger_zone(shape, hfov, 3.0, far_m=30.0)
    box = danger_zone(shape, hfov, 3.0, near_m=10.0, far_m=30.0, clearance_m=2.0)
    # At 10 m the box reaches 0.8 m above the camera.
    assert np.flatnonzero(box.any(1))[0] == pytest.approx(60 - f * 0.8 / 10, abs=1)
    assert box[60].sum() == pytest.approx(f * 3.0 / 10, abs=1)
    assert flat[60 + int(f * 1.2 / 25)].sum() == pytest.approx(f * 3.0 / 25, abs=1.5)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"hfov_deg": 0.0}, "hfov_deg must be > 0 and < 180, got 0"),
        ({"hfov_deg": 180.0}, "hfov_deg must be > 0 and < 180, got 180"),
        ({"width_m": 0.0}, "width_m must be > 0 and finite, got 0"),
        ({"height_m": -1.0}, "height_m must be > 0 and finite, got -1"),
        ({"near_m": 9.0, "far_m": 4.0}, "near_m must be >= 0 and < far_m = 4, got 9"),
        ({"clearance_m": -1.0}, "clearance_m must be >= 0 and finite, got -1"),
        ({"far_m": 2.0}, "must overlap the image, got .*near_m 0, far_m 2 .*raise far_m"),
    ],
)
def test_invalid_arguments_raise(options, message):
    with pytest.raises(ValueError, match=message):
        danger_zone((90, 160), **{"hfov_deg": 20.0, **options})


def test_pixels_outside_the_zone_have_no_effect_on_a_neuron():
    shape = (90, 160)
    zone = danger_zone(shape, 40.0)
    neuron = LGMD(shape, mask=zone)
    rng = np.random.default_rng(0)
    for _ in range(5):
        frame = rng.integers(0, 256, shape, dtype=np.uint8)
        frame[zone > 0] = 100
        assert neuron.step(frame).ffi == 0
    neuron.step(rng.integers(0, 256, shape, dtype=np.uint8))
    changed = neuron.layers["P"] != 0
    assert changed.any()
    assert not changed[zone == 0].any()
