"""360° panoramas: natural noise and images."""

import json

import numpy as np
import pytest
from PIL import Image
from support.cameras import ego_camera
from support.records import lens_of
from support.roads import straight_env

from lgmd_gym.camera import Scene
from lgmd_gym.camera.pinhole import project
from lgmd_gym.camera.render.buffers import horizon_of
from lgmd_gym.camera.render.sky import draw_panorama, natural_panorama


@pytest.fixture
def image_path(tmp_path):
    """Path of a panorama: grey = azimuth / 2, with a white row 19.5° above the horizon."""
    grey = np.tile((np.arange(1024) * 180 / 1024).astype(np.uint8), (512, 1))
    grey[256 - 56] = 255  # its middle is 55.5 rows up
    path = tmp_path / "panorama.png"
    Image.fromarray(grey).save(path)
    return str(path)


@pytest.mark.parametrize("heading", [0.3, 2.0, -1.0])
def test_image_spans_360_degrees_around_the_horizon(image_path, heading):
    env = straight_env(heading=heading)
    camera = ego_camera("wide", panorama=image_path, roadside=0.0, pitch_deg=10.0)
    frame = camera.render(env).astype(float)
    for right in (-25, -10, 0, 15, 25):
        way = heading + np.radians(right)
        far = 1e6 * np.array([np.cos(way), np.sin(way), np.tan(np.radians(8.0))])
        u, v = camera.project(far)
        assert frame[int(v), int(u)] == pytest.approx(np.degrees(way) % 360 / 2, abs=1.5)
        u, v = camera.project([*far[:2], 1e6 * np.tan(np.radians(55.5 * 360 / 1024))])
        column = frame[: int(v) + 6, int(u)]
        assert abs(int(np.argmax(column)) + 0.5 - v) < 1.6


def test_panorama_rolls_with_the_lens():
    """The values of these panoramas are the azimuth and the elevation [degrees]."""
    azimuth, elevation = np.meshgrid(
        (np.arange(1024) + 0.5) * 360 / 1024, 90 - (np.arange(512) + 0.5) * 360 / 1024
    )
    lens = lens_of(0.1, 0.05, roll=0.3, focal=120.0, z=0.0)
    for table in (azimuth, elevation):
        image = np.zeros((80, 120), np.float32)
        draw_panorama(image, lens, table.astype(np.float32), horizon_of(lens))
        for right, up in ((8.0, 3.0), (15.0, 9.0), (25.0, 3.0)):
            way, rise = np.radians(right), np.radians(up)
            point = 1e6 * np.array([np.cos(way), np.sin(way), np.tan(rise)])
            u, v = project(lens, point)
            expected = right if table is azimuth else up
            assert image[int(v), int(u)] == pytest.approx(expected, abs=0.5)


def test_panorama_moves_with_the_heading_but_not_with_the_position():
    env = straight_env(heading=1.0)
    camera = ego_camera("fovea", panorama="natural", roadside=0.0)
    first = camera.render(env).astype(float)
    env.vehicle.position[0] += 100.0
    assert np.array_equal(camera.render(env)[:40], first[:40])
    px = 1.0 / camera.camera.focal_px
    env.vehicle.heading += 0.1 * px
    tenth = np.abs(camera.render(env)[:40] - first[:40]).mean()
    env.vehicle.heading += 0.9 * px
    whole = camera.render(env).astype(float)
    assert tenth < 0.3 * np.abs(whole[:40] - first[:40]).mean() + 0.3
    assert whole[:40, 20:139] == pytest.approx(first[:40, 21:140], abs=2.0)


def test_natural_panorama_has_the_contrast_and_spectrum_of_natural_scenes():
    table = natural_panorama(0).astype(float)
    assert table.std() / table.mean() == pytest.approx(0.45, abs=0.12)
    assert np.abs(table[:, 0] - table[:, -1]).mean() < 1.2 * np.abs(np.diff(table, axis=1)).mean()
    power = np.abs(np.fft.rfft(table - table.mean(axis=1, keepdims=True), axis=1)).mean(axis=0)
    band = np.arange(16, 512)
    slope = np.polyfit(np.log(band), np.log(power[band]), 1)[0]
    assert -1.5 < slope < -0.4  # a cut through two-dimensional 1/f noise
    assert not np.array_equal(natural_panorama(1), table)


def test_night_darkens_and_fog_flattens_the_panorama():
    env = straight_env()
    day = ego_camera("wide", roadside=0.0, panorama="natural").render(env)[:35].astype(float)
    assert (
        ego_camera("wide", roadside=0.0, panorama="natural", light="night").render(env)[:35].mean()
        < 0.06 * day.mean()
    )
    fog = ego_camera("wide", roadside=0.0, panorama="natural", visibility_m=300.0).render(env)[:35]
    assert fog.std() < 0.05 * day.std()


def test_scenes_with_a_panorama_round_trip_through_json(image_path, tmp_path):
    scene = Scene(panorama=tmp_path / "panorama.png", guard_rail=True)
    assert scene.panorama == image_path
    again = Scene.make(json.loads(json.dumps(scene.to_dict())))
    assert again == scene
    assert hash(again) == hash(scene)


def test_unreadable_panorama_raises_an_error_with_path_and_fix(tmp_path):
    text = tmp_path / "notes.txt"
    text.write_text("not a picture")
    for bad in (str(tmp_path / "none.png"), str(text), str(tmp_path), "natrual"):
        with pytest.raises(ValueError) as error:
            ego_camera("wide", panorama=bad)
        message = str(error.value)
        assert repr(bad) in message
        assert "PNG" in message
        assert "\n" not in message
    for field, bad in (("panorama", ""), ("panorama", 3), ("guard_rail", 1)):
        with pytest.raises(ValueError, match=f"scene {field} must be"):
            Scene(**{field: bad})


@pytest.mark.parametrize("size", [(16, 1), (17, 5), (33, 400), (3000, 100)])
def test_image_of_any_size_fills_the_frame(tmp_path, size):
    Image.new("RGB", size, (200, 200, 200)).save(tmp_path / "any.png")
    camera = ego_camera("wide", panorama=str(tmp_path / "any.png"), roadside=0.0, pitch_deg=40.0)
    assert np.all(camera.render(straight_env()) == 200)
