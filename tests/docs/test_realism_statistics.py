"""Statistics of drives, and the fields that are cut out of wide frames."""

from math import atan, degrees, radians, tan

import gymnasium as gym
import numpy as np
import pytest
from support.examples import load

module = load("realism/drive_statistics")
Fields, Optics, STATISTICS = module.Fields, module.Optics, module.STATISTICS
field_cameras, field_samples, resample = module.field_cameras, module.field_samples, module.resample
drive_statistics, spectrum_slope = module.drive_statistics, module.spectrum_slope
OPTICS = Optics((60, 100), 30, 90.0)
RNG = np.random.default_rng(0)


def noise(shape, exponent, count=1):
    """Frames, float64, whose power falls with the frequency to the power of the exponent."""
    height, width = shape
    radius = np.hypot(np.fft.fftfreq(height)[:, None], np.fft.fftfreq(width)[None, :])
    radius[0, 0] = 1.0
    spectra = np.fft.fft2(RNG.normal(size=(count, *shape))) * radius ** (-exponent / 2)
    return np.fft.ifft2(spectra).real


def test_greys_by_hand():
    """Halves of 10 and 240, of which one row of 60 alternates between 30 and 32."""
    frames = []
    for index in range(20):
        frame = np.full((60, 100), 240, np.uint8)
        frame[:, :50] = 10
        frame[0] = 30 + 2 * (index % 2)
        frames.append(frame)
    values = drive_statistics(frames, 30.0, OPTICS)
    assert list(values) == list(STATISTICS)
    assert (values["p1"], values["p50"], values["p99"]) == (10.0, 30.0, 240.0)
    assert values["dark"] == values["bright"] == pytest.approx(100 * 59 / 120)
    assert values["difference"] == pytest.approx(2 / 60)
    assert values["contrast"] == pytest.approx(np.mean([frame.std() for frame in frames]), abs=1e-3)


def test_bounds_of_dark_and_bright_pixels():
    frame = np.repeat(np.array([19, 20, 235, 236], np.uint8), 25)[None, :].repeat(60, axis=0)
    values = drive_statistics([np.roll(frame, index, axis=1) for index in range(20)], 30.0, OPTICS)
    assert values["dark"] == values["bright"] == 25.0


def test_the_bottom_is_ignored_except_by_the_fields():
    frames = RNG.integers(100, 120, (20, 60, 100)).astype(np.uint8)
    other = frames.copy()
    other[:, 50:] = 0
    optics = OPTICS._replace(ignored_bottom=1 / 6)
    one, two = (drive_statistics(item, 30.0, optics) for item in (frames, other))
    assert one["p1"] == two["p1"] >= 100.0
    assert one == pytest.approx(two, nan_ok=True)
    assert drive_statistics(other, 30.0, OPTICS)["p1"] == 0.0


@pytest.mark.parametrize(
    ("shape", "exponent"),
    [((240, 432), 1.5), ((240, 432), 2.0), ((240, 432), 3.0), ((128, 100), 2.0), ((101, 160), 1.5)],
)
def test_slope_of_noise_with_a_known_spectrum(shape, exponent):
    frames = noise(shape, exponent, 20)
    window = np.outer(np.hanning(shape[0]), np.hanning(shape[1]))
    power = (np.abs(np.fft.rfft2((frames - frames.mean((1, 2), keepdims=True)) * window)) ** 2).sum(0)
    assert spectrum_slope(power) == pytest.approx(-exponent, abs=0.2)


def test_statistics_contain_the_slope_of_the_frames():
    pictures = noise((60, 100), 2.0, 20)
    frames = np.clip(128 + 30 * pictures / pictures.std(), 0, 255).astype(np.uint8)
    assert drive_statistics(frames, 30.0, OPTICS)["slope"] == pytest.approx(-2.0, abs=0.35)


def test_uniform_frames_have_no_slope():
    assert np.isnan(drive_statistics([np.full((60, 100), 9, np.uint8)] * 20, 30.0, OPTICS)["slope"])


def test_duplicates_have_no_influence():
    frames = RNG.integers(0, 256, (30, 60, 100)).astype(np.uint8)
    repeated = [frame for index, frame in enumerate(frames) for _ in range(2 if index % 5 == 4 else 1)]
    assert len(repeated) == 36
    np.testing.assert_equal(drive_statistics(repeated, 30.0, OPTICS), drive_statistics(frames, 30.0, OPTICS))


def test_refused_drives():
    frame = np.zeros((60, 100), np.uint8)
    with pytest.raises(ValueError, match="at least 10 different frames, got 9"):
        drive_statistics([frame] * 9, 30.0, OPTICS)
    with pytest.raises(ValueError, match=r"at least 50×50 px, got 100×49"):
        drive_statistics([frame] * 20, 30.0, OPTICS._replace(ignored_bottom=0.18))


def test_fields_in_use():
    names = Fields((240, 432), 30.0, 90.0).names
    assert names["upright"] == [f"upright{speed}" for speed in (10, 20, 25, 30, 40, 50)]
    assert names["ground"] == [f"ground{speed}" for speed in (20, 25, 30, 40, 50)]


def test_pixels_of_a_field_by_hand():
    """A field with the pixels per degree of the frame at its centre, pitched so that its axis is 20 px up."""
    focal = 50 / tan(radians(45))
    camera = {
        "shape": [10, 20],
        "hfov_deg": 2 * degrees(atan(10 / focal)),
        "mount": {"pitch_deg": degrees(atan(20 / focal))},
    }
    row, column = field_samples(camera, (60, 100), 90.0)
    assert row.shape == (1, 1, 10, 20)
    centre = row[0, 0, 4:6, 9:11].mean(), column[0, 0, 4:6, 9:11].mean()
    assert centre == pytest.approx((29.5 - 20, 49.5), abs=0.05)
    assert field_samples(camera | {"mount": {"pitch_deg": 30.0}}, (60, 100), 90.0) is None  # 58 px up
    assert field_samples(camera | {"hfov_deg": 5.0}, (60, 100), 90.0) is None  # 0.2 px per pixel


def test_fields_equal_frames_of_their_cameras():
    """A field resampled from a fine wide frame shows what a camera of that field shows."""
    cameras = [field_cameras(kind)[1] for kind in ("upright", "ground")]  # at 20 km/h
    wide = {"name": "clip", "shape": [480, 864], "hfov_deg": 90.0}
    env = gym.make("LGMD/CCRs-v0", camera=[wide, *cameras], ego_speed=8.0, world="laboratory")
    env.reset(seed=0)
    for _ in range(75):
        env.step(np.zeros(1, np.float32))
    sensors = env.get_wrapper_attr("sensors")
    frame = sensors.frame_of(0).astype(np.float32)
    for index, camera in enumerate(cameras, start=1):
        samples = field_samples(camera, (480, 864), 90.0)
        assert samples is not None
        field, expected = resample(frame, samples).astype(float), sensors.frame_of(index).astype(float)
        assert expected.std() > 5
        assert np.abs(field - expected).mean() < 2.5
        assert np.corrcoef(field.reshape(-1), expected.reshape(-1))[0, 1] > 0.97


def test_a_growing_square_excites_the_fields():
    optics = Optics((240, 432), 30, 90.0)
    rows, columns = np.abs(np.arange(240) - 119.5)[:, None], np.abs(np.arange(432) - 215.5)[None, :]
    approach = [
        np.where(np.maximum(rows, columns) < 20 / (1.6 - index / 30), 40, 160).astype(np.uint8)
        for index in range(45)
    ]
    static = [np.where(rows + columns < 100, 40, 160).astype(np.uint8)] * 45
    values = drive_statistics(approach, 30.0, optics)
    assert (values["upright"], values["ground"]) == pytest.approx((48.8, 28.6), abs=0.1)
    still = drive_statistics(static, 30.0, optics)
    assert (still["upright"], still["ground"], still["ffi_p95"]) == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)
