"""Image motion: world-anchored texture, F̂ on a road, still scenes."""

import itertools

import numpy as np
import pytest
from support.cameras import ego_camera
from support.roads import add_car, straight_env

from lgmd_gym.camera.render.texture import TEXEL_M, ground_texture


def drive(camera, speed=50 / 3.6, frames=90, rate=30, **road):
    """Return the frames of a drive at constant speed."""
    env = straight_env(**road)
    out = []
    for k in range(frames):
        env.vehicle.position[0] = k * speed / rate
        out.append(camera.render(env).astype(np.float64))
    return out


def f_hat(frames, dt_ms=1000 / 30, tau_ms=10.0):
    """Return the low-passed mean absolute change, as in the neuron's feed-forward inhibition."""
    gain = dt_ms / (dt_ms + tau_ms)
    value, out = None, []
    for a, b in itertools.pairwise(frames):
        change = np.abs(b - a).mean()
        value = change if value is None else value + gain * (change - value)
        out.append(value)
    return np.array(out)


def test_f_hat_on_an_empty_road_is_in_the_range_of_real_clips():
    assert np.median(f_hat(drive(ego_camera("wide")))) >= 2.0
    assert np.median(f_hat(drive(ego_camera("wide", roadside=0.0)))) >= 2.0  # the asphalt alone flows
    assert np.median(f_hat(drive(ego_camera("wide", texture=0.0, roadside=0.0)))) < 1.0


def test_still_scene_gives_identical_frames():
    env = straight_env()
    add_car(env, 20.0, 3.5)
    camera = ego_camera("wide")
    first = camera.render(env)
    for _ in range(5):
        assert np.array_equal(camera.render(env), first)
    # Other frames in between have no effect.
    other = straight_env(heading=1.0, x=300.0)
    camera.render(other)
    camera.render(env, gaze=(20.0, -3.0))
    assert np.array_equal(camera.render(env), first)


def test_ground_is_fixed_in_the_world():
    """Texture moves from one frame row to another with the distance driven."""
    env = straight_env(lanes=1, width=60.0, line_types=False)
    camera = ego_camera("wide", roadside=0.0, texture=3.0)
    f, h = camera.camera.focal_px, 1.2
    env.vehicle.position[0] = 50.0
    before = camera.render(env).astype(float)
    far, near = 70, 80  # rows; the ground of row 70 moves to row 80 after:
    step = f * h / (far + 0.5 - 45) - f * h / (near + 0.5 - 45)
    env.vehicle.position[0] += step
    after = camera.render(env).astype(float)
    scale = (near + 0.5 - 45) / (far + 0.5 - 45)
    cols = np.arange(40, 120)
    source = 80 + (cols + 0.5 - 80) / scale - 0.5
    expected = np.interp(source, np.arange(160), before[far])
    match = np.corrcoef(after[near, cols], expected)[0, 1]
    unmoved = np.corrcoef(after[near, cols], before[near, cols])[0, 1]
    assert match > 0.85
    assert abs(unmoved) < 0.6


def test_ground_moves_sideways_with_the_car():
    env = straight_env(lanes=1, width=60.0, line_types=False)
    camera = ego_camera("wide", roadside=0.0, texture=3.0)
    before = camera.render(env).astype(float)
    row = 75
    px = 1.2 / (row + 0.5 - 45)  # metres across per pixel
    env.vehicle.position[1] += 6 * px
    after = camera.render(env).astype(float)
    assert np.corrcoef(after[row, 10:140], before[row, 16:146])[0, 1] > 0.99


def test_texture_is_periodic_and_its_levels_are_box_averages():
    texture = ground_texture("asphalt", 0)
    rows = texture.data[: 4096 * 513].reshape(4096, 513).astype(float)
    tile = rows[:, :512]
    assert np.array_equal(rows[:, 512], tile[:, 0])
    assert tile.mean() == pytest.approx(128.0, abs=1.0)
    assert tile.std() == pytest.approx(36.0, abs=2.0)
    assert 4096 * TEXEL_M > 150.0
    # Periodic: the wrapped step is not larger than any other.
    assert np.abs(tile[0] - tile[-1]).mean() < 1.5 * np.abs(np.diff(tile, axis=0)).mean()
    # Level (1, 2) is the mean over two by four texels.
    at = texture.level_start[1, 2]
    level = texture.data[at : at + 2048 * 129].reshape(2048, 129).astype(float)
    assert level[:, :128] == pytest.approx(tile.reshape(2048, 2, 128, 4).mean(axis=(1, 3)), abs=1.01)


def test_frames_of_an_episode_change_evenly():
    changes = f_hat(drive(ego_camera("wide"), frames=200), tau_ms=0.0)
    assert changes.max() < 1.8 * np.median(changes)
    assert changes.min() > 0.5 * np.median(changes)
