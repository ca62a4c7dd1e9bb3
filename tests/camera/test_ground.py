"""Rows of ground against a plain reference: running sums, bilinear samples and mixing in numpy."""

import numpy as np
import pytest
from support.cameras import ego_camera, rig
from support.roads import straight_env

from lgmd_gym.camera.effects import beam_profile, look_of
from lgmd_gym.camera.pinhole import LENS
from lgmd_gym.camera.render.buffers import Horizon, View
from lgmd_gym.camera.render.ground import shade_row
from lgmd_gym.camera.render.light import veil_at
from lgmd_gym.camera.render.tables import Tables
from lgmd_gym.camera.render.texture import TEXEL_M, ground_texture


def view_of(p, yaw, x=31.7, y=-4.2, pitch=-0.05):
    lens = np.zeros((), LENS)
    lens["x"], lens["y"], lens["z"], lens["yaw"], lens["pitch"] = x, y, 1.2, yaw, pitch
    lens["cos_yaw"], lens["sin_yaw"], lens["focal"] = np.cos(yaw), np.sin(yaw), p.focal_px
    lens["cos_roll"] = 1.0
    lens["cos_pitch"], lens["sin_pitch"] = np.cos(pitch), np.sin(pitch)
    lens["centre_v"], lens["centre_u"] = 0.5 * np.array(p.shape)
    empty = np.zeros((0, 0), np.float32)
    return View(
        lens=lens[()],
        look=look_of(*p)[()],
        beam=beam_profile(p.camera),
        sky=empty,
        sky_aim=np.zeros(2),
        noise_start=0,
        exposure=np.zeros(0),
    )


def level_horizon(row):
    return Horizon(row, 0.0, row, row)


def tables_of(seed):
    asphalt, verge = ground_texture("asphalt", seed), ground_texture("verge", seed)
    empty = np.zeros((0, 0), np.float32)
    return Tables(asphalt.data, verge.data, asphalt.level_start, empty, np.zeros(0, np.float32), empty)


def sample(data, level_start, lens, row, width):
    """Return a row of a texture, float64, shape (width,), minus 128."""
    v = row + 0.5 - lens["centre_v"]
    fall = v * lens["cos_pitch"] - lens["focal"] * lens["sin_pitch"]
    ahead = lens["z"] / fall * (lens["focal"] * lens["cos_pitch"] + v * lens["sin_pitch"])
    across = lens["z"] / fall * (np.arange(width) + 0.5 - lens["centre_u"])
    c, s = lens["cos_yaw"], lens["sin_yaw"]
    along, beside = lens["focal"] * lens["z"] / fall / max(fall, 0.3), lens["z"] / fall
    footprint = np.hypot(along * c, beside * s) / TEXEL_M, np.hypot(along * s, beside * c) / TEXEL_M
    i, j = (
        int(np.clip(np.floor(np.log2(size) + 0.5), 0, top))
        for size, top in zip(footprint, (12, 9), strict=True)
    )
    long, wide = 4096 >> i, 512 >> j
    at = level_start[i, j]
    level = data[at : at + long * (wide + 1)].reshape(long, wide + 1)[:, :wide].astype(float)
    x = (lens["x"] + ahead * c - across * s) / (TEXEL_M * 2**i) - 0.5
    y = (lens["y"] + ahead * s + across * c) / (TEXEL_M * 2**j) - 0.5
    a, b = np.floor(x).astype(int), np.floor(y).astype(int)
    wx, wy = x - a, y - b
    near = (1 - wy) * level[a % long, b % wide] + wy * level[a % long, (b + 1) % wide]
    far = (1 - wy) * level[(a + 1) % long, b % wide] + wy * level[(a + 1) % long, (b + 1) % wide]
    return (1 - wx) * near + wx * far - 128.0


def reference_row(view, tables, coverage, row, behind, part):
    """Return a row of ground as grey levels, float64, shape (width,)."""
    look, width = view.look, len(behind)
    road, paint, shadow, cast = np.cumsum(coverage[:, row, :width].astype(float), axis=1) / part
    road, paint, cast = np.clip(road, 0, 1), np.clip(paint, 0, 1), np.clip(cast, 0, 1)
    shadow = np.clip(shadow, 0, look["shadow_limit"])
    grain = look["asphalt_gain"] * sample(tables.asphalt, tables.level_start, view.lens, row, width)
    verge = look["verge_gain"] * sample(tables.verge, tables.level_start, view.lens, row, width)
    grey = road * (look["asphalt"] + grain) + (1 - road) * (look["verge"] + verge)
    grey += paint * (look["paint"] + 0.5 * grain - grey)
    grey *= (1 - shadow) * (1 - look["cast"] * cast)
    v = row + 0.5 - view.lens["centre_v"]
    fall = v * view.lens["cos_pitch"] - view.lens["focal"] * view.lens["sin_pitch"]
    run = view.lens["focal"] * view.lens["cos_pitch"] + v * view.lens["sin_pitch"]
    ahead = view.lens["z"] / fall * run
    if look["night"]:
        way = (1.0 / look["beam_reach"] + look["extinction"]) * ahead
        grey *= look["night_light"] + look["beam_gain"] * np.exp(-way) * view.beam
    if look["wet"]:
        grazing = 1.0 - view.lens["z"] / np.hypot(view.lens["z"], ahead)
        grey += 0.5 * (0.02 + 0.98 * grazing**5) * (look["horizon"] - grey)
    if look["extinction"]:
        grey = look["haze"] + np.exp(-ahead * look["extinction"]) * (grey - look["haze"])
        if look["night"]:
            grey += veil_at(look, view.lens["z"], view.lens["z"] / ahead, ahead) * view.beam
    return behind + part * (grey - behind)


@pytest.mark.parametrize("yaw", [0.0, 0.3, -2.0])
@pytest.mark.parametrize(
    ("width", "fields"),
    [
        (160, {}),
        (5, {}),
        (37, {"light": "night"}),
        (80, {"light": "night", "visibility_m": 60.0}),
        (50, {"world": 3}),
        (80, {"world": 3, "wet": True}),
    ],
)
def test_rows_equal_the_reference(width, fields, yaw):
    p = rig(shape=(40, width), hfov_deg=30.0, **fields)
    view, tables, rng = view_of(p, yaw), tables_of(0), np.random.default_rng(width)
    assert (view.look["cast"] > 0.0) == (p.world is not None and not p.wet)
    low, high = (
        [[[value]] for value in values] for values in ((0.05, -0.1, -0.1, -0.1), (1.2, 1.1, 0.9, 1.3))
    )
    summed = rng.uniform(low, high, (4, 40, width + 2))
    if not view.look["cast"]:
        summed[3] = 0.0
    summed[:, 30] = 0.0  # only verge
    summed[0, 31:33] = 1.0  # only asphalt, and without any marking or shadow
    summed[1:, 32] = 0.0
    coverage = np.diff(summed, axis=2, prepend=0.0).astype(np.float32)
    image = rng.uniform(0.0, 255.0, (40, width)).astype(np.float32)
    for row in range(20, 40):
        part = 0.3 if row == 20 else 1.0
        expected = reference_row(view, tables, coverage, row, image[row].astype(float), part)
        shade_row(image, row, level_horizon(row + 1.0 - part), coverage, view, tables)
        # The line over the texture is in 16.16 fixed point: 0.5/65536 texel per pixel, at most 0.0012 here.
        assert image[row] == pytest.approx(expected, abs=0.05)
    assert not coverage[:, 20:].any()


def test_rows_beside_the_row_do_not_change():
    p = rig(shape=(12, 37))
    view, tables = view_of(p, 0.1), tables_of(0)
    coverage = np.ones((4, 12, 39), np.float32)
    image = np.full((12, 37), -1.0, np.float32)
    shade_row(image, 8, level_horizon(8.0), coverage, view, tables)
    others = np.arange(12) != 8
    assert (image[others] == -1.0).all()
    assert (image[8] > 0.0).all()
    assert (coverage[:, others] == 1.0).all()


def test_texture_repeats_after_its_period():
    """164 m along and 20 m across are whole periods of the texture: the same ground."""
    env, camera = straight_env(lanes=1, width=200.0, line_types=False), ego_camera("wide", roadside=0.0)
    before = camera.render(env)
    env.vehicle.position = env.vehicle.position + np.array([4096 * TEXEL_M, 512 * TEXEL_M])
    assert np.abs(camera.render(env)[50:].astype(int) - before[50:]).max() <= 1
