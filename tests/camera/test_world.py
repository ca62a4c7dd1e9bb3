"""Panorama, guard rails and glare: what may be added to the world."""

import dataclasses
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from support.roads import add_car, lens_x, straight_env

from lgmd_gym.camera import CameraParams, EgoCamera
from lgmd_gym.camera.render.glare import BUDGET_PX
from lgmd_gym.camera.render.panorama import natural_panorama
from lgmd_gym.camera.scene import MODEL_RAIL, OBJ_MODEL, OBJ_X, OBJ_Y, road_geometry


@pytest.fixture
def picture(tmp_path):
    """A panorama, grey = azimuth / 2, with a white row 19.5° above the horizon."""
    grey = np.tile((np.arange(1024) * 180 / 1024).astype(np.uint8), (512, 1))
    grey[256 - 56] = 255  # its middle is 55.5 rows up
    path = tmp_path / "panorama.png"
    Image.fromarray(grey).save(path)
    return str(path)


@pytest.mark.parametrize("heading", [0.3, 2.0, -1.0])
def test_an_image_is_wrapped_round_the_horizon(picture, heading):
    env = straight_env(heading=heading)
    camera = EgoCamera("wide", panorama=picture, roadside=0.0, pitch_deg=10.0)
    frame = camera.render(env).astype(float)
    for right in (-25, -10, 0, 15, 25):
        way = heading + np.radians(right)
        far = 1e6 * np.array([np.cos(way), np.sin(way), np.tan(np.radians(8.0))])
        u, v = camera.project(far)
        assert frame[int(v), int(u)] == pytest.approx(np.degrees(way) % 360 / 2, abs=1.5)
        u, v = camera.project([*far[:2], 1e6 * np.tan(np.radians(55.5 * 360 / 1024))])
        column = frame[: int(v) + 6, int(u)]
        assert abs(int(np.argmax(column)) + 0.5 - v) < 1.6


def test_a_panorama_turns_smoothly_and_stands_still(picture):
    env = straight_env(heading=1.0)
    camera = EgoCamera("fovea", panorama="natural", roadside=0.0)
    first = camera.render(env).astype(float)
    env.vehicle.position[0] += 100.0
    assert np.array_equal(camera.render(env)[:40], first[:40])  # it is infinitely far away
    px = 1.0 / camera.params.focal_px
    env.vehicle.heading += 0.1 * px
    tenth = np.abs(camera.render(env)[:40] - first[:40]).mean()
    env.vehicle.heading += 0.9 * px
    whole = camera.render(env).astype(float)
    assert tenth < 0.3 * np.abs(whole[:40] - first[:40]).mean() + 0.3
    assert whole[:40, 20:139] == pytest.approx(first[:40, 21:140], abs=2.0)


def test_natural_panorama_is_natural():
    table = natural_panorama(0).astype(float)
    assert table.std() / table.mean() == pytest.approx(0.45, abs=0.12)
    assert np.abs(table[:, 0] - table[:, -1]).mean() < 1.2 * np.abs(np.diff(table, axis=1)).mean()
    power = np.abs(np.fft.rfft(table - table.mean(axis=1, keepdims=True), axis=1)).mean(axis=0)
    band = np.arange(16, 512)
    slope = np.polyfit(np.log(band), np.log(power[band]), 1)[0]
    assert -1.5 < slope < -0.4  # a cut through two-dimensional 1/f noise
    assert not np.array_equal(natural_panorama(1), table)


def test_panorama_in_night_and_fog():
    env = straight_env()
    day = EgoCamera("wide", roadside=0.0, panorama="natural").render(env)[:35].astype(float)
    assert (
        EgoCamera("wide", roadside=0.0, panorama="natural", light="night").render(env)[:35].mean()
        < 0.06 * day.mean()
    )
    fog = EgoCamera("wide", roadside=0.0, panorama="natural", visibility_m=300.0).render(env)[:35]
    assert fog.std() < 0.05 * day.std()


def test_panorama_is_plain_and_hashable(picture, tmp_path):
    params = CameraParams(panorama=tmp_path / "panorama.png", guard_rail=True)
    assert params.panorama == picture
    again = CameraParams.make(json.loads(json.dumps(dataclasses.asdict(params))))
    assert again == params
    assert hash(again) == hash(params)


def test_an_unreadable_panorama_is_named_with_the_mend(tmp_path):
    text = tmp_path / "notes.txt"
    text.write_text("not a picture")
    for bad in (str(tmp_path / "none.png"), str(text), str(tmp_path), "natrual"):
        with pytest.raises(ValueError) as error:
            EgoCamera("wide", panorama=bad)
        message = str(error.value)
        assert repr(bad) in message
        assert "PNG" in message
        assert "\n" not in message
    for field, bad in (("panorama", ""), ("panorama", 3), ("guard_rail", 1)):
        with pytest.raises(ValueError, match=f"camera {field} must be"):
            CameraParams(**{field: bad})


@pytest.mark.parametrize("size", [(16, 1), (17, 5), (33, 400), (3000, 100)])
def test_a_panorama_of_any_size(tmp_path, size):
    Image.new("RGB", size, (200, 200, 200)).save(tmp_path / "any.png")
    camera = EgoCamera("wide", panorama=str(tmp_path / "any.png"), roadside=0.0, pitch_deg=40.0)
    assert np.all(camera.render(straight_env()) == 200)


def test_rails_stand_along_the_outer_edges():
    env = straight_env(lanes=3)
    rail = road_geometry(env.road, rail=True).roadside
    rail = rail[rail[:, OBJ_MODEL] == MODEL_RAIL]
    assert set(np.round(rail[:, OBJ_Y], 3)) == {-1.75 - 0.75, 7.0 + 1.75 + 0.75}
    assert len(rail) == 2 * 5200 / 8
    assert np.diff(np.sort(rail[:, OBJ_X])).max() <= 8.001
    assert len(road_geometry(env.road).roadside) == 0


def test_rails_hide_what_is_behind_and_not_what_is_before():
    env = straight_env(lanes=1, y=0.0, line_types=False)
    camera = EgoCamera("wide", roadside=0.0, texture=0.0, guard_rail=True)
    bare = EgoCamera("wide", roadside=0.0, texture=0.0)
    rail = camera.render(env).astype(int) - bare.render(env)
    u, v = np.floor(camera.project([lens_x(env) + 10.0, 2.5, 0.6])).astype(int)
    assert abs(rail[v, u]) > 20
    for y, hidden in ((4.5, True), (1.3, False)):
        car = add_car(env, lens_x(env) + 10.0, y, shade=10, size=(6.0, 1.2, 1.5))
        at = np.array([lens_x(env) + 10.0, min(y + 0.6, 2.5) if hidden else y - 0.6, 0.66])
        u, v = np.floor(camera.project(at)).astype(int)
        seen = int(camera.render(env)[v, u]) - int(bare.render(env)[v, u])
        assert (abs(seen) > 20) == hidden, (y, seen)
        env.road.vehicles.remove(car)


def test_rails_are_anchored_in_the_world():
    env = straight_env(line_types=False)
    camera = EgoCamera("wide", roadside=0.0, texture=0.0, guard_rail=True, hfov_deg=90.0)
    env.vehicle.position[0] = 100.0
    first = camera.render(env)
    env.vehicle.position[0] += 4.0  # from post to post, but for the far end
    assert np.abs(camera.render(env).astype(int) - first)[50:].max() < 20
    env.vehicle.position[0] += 2.0
    assert np.abs(camera.render(env).astype(int) - first)[50:].max() > 30


def test_oncoming_headlights_glare_at_night():
    env = straight_env()
    car = add_car(env, lens_x(env) + 25.0, 0.0, heading=np.pi, shade=40)
    camera = EgoCamera("standard", light="night", roadside=0.0)
    glare = camera.render(env).astype(int)
    u, v = np.floor(camera.project([car.position[0] - 2.0, -0.64, 0.64])).astype(int)
    assert glare[v, u] == 255
    assert glare[v - 3, u] > 60  # beyond the lamp
    car.heading = 0.0
    assert camera.render(env)[v - 3, u] < 30
    car.heading = np.pi
    day = EgoCamera("standard", roadside=0.0)
    assert day.render(env)[:20].mean() > 150  # and by day there is none
    assert glare[:25].max() < 40  # it does not light the sky


def test_glare_is_bounded():
    env = straight_env(lanes=20)
    for k in range(200):
        add_car(env, lens_x(env) + 8.0 + 0.5 * k, 3.5 * (k % 20), heading=np.pi)
    camera = EgoCamera("fovea", light="night", roadside=0.0)
    with_glare = camera.render(env)
    assert with_glare.max() == 255
    assert 0.25 * with_glare.size > BUDGET_PX


OPTIONS = st.fixed_dictionaries(
    {
        "shape": st.tuples(st.integers(4, 60), st.integers(4, 60)),
        "hfov_deg": st.floats(2.0, 160.0),
        "pitch_deg": st.floats(-60.0, 60.0),
        "yaw_deg": st.floats(-360.0, 360.0),
        "mount_height": st.floats(0.05, 5.0),
        "light": st.sampled_from(["day", "night"]),
        "visibility_m": st.sampled_from([0.0, 30.0]),
        "shutter_s": st.sampled_from([0.0, 0.03]),
        "vibration_deg": st.sampled_from([0.0, 2.0]),
        "heave_m": st.sampled_from([0.0, 0.1]),
        "panorama": st.sampled_from(["skyline", "natural"]),
        "guard_rail": st.booleans(),
        "read_noise": st.sampled_from([0.0, 3.0]),
    }
)


@settings(max_examples=60, deadline=None)
@given(
    options=OPTIONS,
    poses=st.lists(
        st.tuples(st.floats(-5, 60), st.floats(-10, 10), st.floats(-4, 4), st.floats(-60, 60)), max_size=8
    ),
    steering=st.floats(-0.7, 0.7),
)
def test_any_camera_draws_any_scene(options, poses, steering):
    env = straight_env(speed=30.0)
    env.steps, env.config = 5, {"simulation_frequency": 30}
    env.vehicle.action = {"steering": steering, "acceleration": -3.0}
    for x, y, turn, speed in poses:
        add_car(env, x, y, heading=turn).speed = speed
    camera = EgoCamera(CameraParams(**options))
    frame = camera.render(env)
    assert frame.shape == options["shape"]
    assert np.isfinite(camera.light).all()
    assert np.array_equal(camera.render(env), frame)


@pytest.mark.parametrize("height", [np.nan, np.inf, 1e300])
def test_a_vehicle_of_senseless_height_harms_nothing(height):
    env = straight_env()
    car = add_car(env, 20.0, 3.5)
    for pitch in (0.0, 5.0):
        camera = EgoCamera("wide", pitch_deg=pitch)
        camera.render(env)
        car.HEIGHT = height
        camera.render(env)
        car.HEIGHT = 1.4
        again = camera.render(env)
        assert np.array_equal(again, EgoCamera("wide", pitch_deg=pitch).render(env))


def test_no_edge_leaves_the_accumulator():
    """Every edge that a clip can bend lands inside: what lies behind the array stays as it was."""
    from lgmd_gym.camera.render.coverage import add_edge

    rng = np.random.default_rng(1)
    for height, width in ((5, 7), (33, 47), (90, 160)):
        store = np.zeros((height + 2, width + 2, 2), np.float32)
        for _ in range(20000):
            x0, x1 = rng.uniform(-2 * width, 3 * width, 2)
            y0, y1 = rng.uniform(-2 * height, 3 * height, 2)
            if rng.random() < 0.3:
                x0, y0 = rng.choice([0.0, width, x0]), rng.choice([0.0, height, y0])
            if rng.random() < 0.05:
                x1 = rng.choice([np.nan, np.inf, -np.inf, 1e300])
            add_edge(store[:height], 0, x0, y0, x1, y1, 1.0, 0.5)
        assert not store[height:].any()
        assert np.isfinite(store).all()
