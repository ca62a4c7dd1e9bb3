"""What moves when the car moves: world-anchored texture, F̂, stillness, determinism."""

import hashlib
import itertools
import subprocess
import sys

import numpy as np
import pytest
from support.roads import add_car, straight_env

from lgmd_gym.camera import CameraParams, EgoCamera
from lgmd_gym.camera.render.texture import TEXEL_M, ground_texture


def drive(camera, speed=50 / 3.6, frames=90, rate=30, **road):
    env = straight_env(**road)
    out = []
    for k in range(frames):
        env.vehicle.position[0] = k * speed / rate
        out.append(camera.render(env).astype(np.float64))
    return out


def f_hat(frames, dt_ms=1000 / 30, tau_ms=10.0):
    """Low-passed mean absolute change: rows 1 and 2 of the model's table without the persistence."""
    gain = dt_ms / (dt_ms + tau_ms)
    value, out = None, []
    for a, b in itertools.pairwise(frames):
        change = np.abs(b - a).mean()
        value = change if value is None else value + gain * (change - value)
        out.append(value)
    return np.array(out)


def test_f_hat_on_an_empty_road_is_that_of_real_clips():
    assert np.median(f_hat(drive(EgoCamera("wide")))) >= 2.0
    assert np.median(f_hat(drive(EgoCamera("wide", roadside=0.0)))) >= 2.0  # the asphalt alone flows
    assert np.median(f_hat(drive(EgoCamera("wide", texture=0.0, roadside=0.0)))) < 1.0


def test_a_standing_scene_gives_identical_frames():
    env = straight_env()
    add_car(env, 20.0, 3.5)
    camera = EgoCamera("wide")
    first = camera.render(env)
    for _ in range(5):
        assert np.array_equal(camera.render(env), first)
    # Whatever was drawn in between.
    other = straight_env(heading=1.0, x=300.0)
    camera.render(other)
    camera.render(env, gaze=(20.0, -3.0))
    assert np.array_equal(camera.render(env), first)


def test_ground_is_anchored_in_the_world():
    """A frame row shows, one step of its own distance later, what another row showed before."""
    env = straight_env(lanes=1, width=60.0, line_types=False)
    camera = EgoCamera("wide", roadside=0.0, texture=3.0)
    f, h = camera.params.focal_px, 1.2
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
    camera = EgoCamera("wide", roadside=0.0, texture=3.0)
    before = camera.render(env).astype(float)
    row = 75
    px = 1.2 / (row + 0.5 - 45)  # metres across per pixel
    env.vehicle.position[1] += 6 * px
    after = camera.render(env).astype(float)
    assert np.corrcoef(after[row, 10:140], before[row, 16:146])[0, 1] > 0.99


def test_texture_is_natural():
    texture = ground_texture("asphalt", 0)
    size = 4096 * 512
    tile = texture.data[:size].reshape(4096, 512).astype(float)
    assert tile.mean() == pytest.approx(128.0, abs=1.0)
    assert tile.std() == pytest.approx(36.0, abs=2.0)
    assert 4096 * TEXEL_M > 150.0
    # Periodic: the wrapped step is not larger than any other.
    assert np.abs(tile[0] - tile[-1]).mean() < 1.5 * np.abs(np.diff(tile, axis=0)).mean()
    # Level (1, 2) is the mean over two by four texels.
    at = texture.offset[1, 2]
    level = texture.data[at : at + 2048 * 128].reshape(2048, 128).astype(float)
    assert level == pytest.approx(tile.reshape(2048, 2, 128, 4).mean(axis=(1, 3)), abs=1.01)


def test_frames_of_a_drive_hold_no_jump():
    changes = f_hat(drive(EgoCamera("wide"), frames=200), tau_ms=0.0)
    assert changes.max() < 1.8 * np.median(changes)
    assert changes.min() > 0.5 * np.median(changes)


DIGEST = """
import hashlib, sys
sys.path.insert(0, {tests!r})
from support.roads import straight_env, add_car
from lgmd_gym.camera import EgoCamera, CameraParams
digest = hashlib.sha256()
for name in ("wide", "fovea"):
    env = straight_env(); add_car(env, 25.0, 3.5); add_car(env, 40.0, 7.0, heading=0.3)
    camera = EgoCamera(CameraParams.preset(name, seed=5).with_condition("degraded"))
    for k in range(5):
        env.vehicle.position[0] = k * 0.4
        digest.update(camera.render(env).tobytes())
print(digest.hexdigest())
"""


def test_the_same_seed_gives_the_same_frames_in_another_process(request):
    code = DIGEST.format(tests=str(request.path.parents[1]))
    runs = [
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        for _ in range(2)
    ]
    assert runs[0].stdout == runs[1].stdout
    assert len(runs[0].stdout.strip()) == hashlib.sha256().digest_size * 2


def test_the_seed_changes_texture_and_shades():
    env = straight_env()
    add_car(env, 12.0, 3.5)
    frames = [EgoCamera("wide", seed=s).render(env).astype(int) for s in (0, 1)]
    assert np.abs(frames[0] - frames[1])[50:].mean() > 3.0


def test_shade_is_the_vehicles_own():
    env = straight_env()
    car = add_car(env, 12.0, 3.5)
    greys = []
    for shade in (20, 120, 220):
        car.shade = shade
        greys.append(EgoCamera("wide", vehicles="box").render(env)[50, 80])
    assert greys == sorted(greys)
    assert greys[2] - greys[0] > 120


def test_tail_lights_brighten_when_braking():
    env = straight_env()
    car = add_car(env, 12.0, 3.5, shade=60)
    camera = EgoCamera("tele")
    quiet = camera.render(env).astype(int)
    car.action = {"acceleration": -3.0, "steering": 0.0}
    braking = camera.render(env).astype(int)
    assert (braking - quiet).max() > 120
    assert (braking - quiet).min() == 0


def test_conditions_do_what_they_say():
    env = straight_env()
    add_car(env, 60.0, 3.5, shade=20)
    env.steps, env.config = 10, {"simulation_frequency": 30}
    clear = EgoCamera("tele").render(env).astype(float)
    fog = EgoCamera("tele", visibility_m=60.0).render(env).astype(float)
    assert np.ptp(fog[30:55]) < 0.35 * np.ptp(clear[30:55])
    night = EgoCamera("tele", light="night").render(env).astype(float)
    assert night[:30].mean() < 20 < clear[:30].mean()
    assert night.max() > 120  # tail lights
    noisy = EgoCamera("tele", read_noise=4.0).render(env).astype(float)
    assert (noisy - clear).std() == pytest.approx(4.0, rel=0.1)
    env.steps = 11
    assert not np.array_equal(EgoCamera("tele", read_noise=4.0).render(env), noisy)


def test_dive_and_vibration_pitch_the_camera():
    env = straight_env()
    env.steps, env.config = 7, {"simulation_frequency": 30}
    point = [1000.0, 3.5, 1.2]
    camera = EgoCamera("fovea", dive_deg=0.1)
    camera.render(env)
    assert camera.project(point)[1] == pytest.approx(45.0, abs=1e-6)
    env.vehicle.action = {"acceleration": -9.0, "steering": 0.0}
    camera.render(env)
    # The nose dives by 0.9°: the world rises by 14.4 px.
    assert camera.project(point)[1] == pytest.approx(45.0 - 0.9 * camera.params.pixels_per_degree, abs=0.1)
    shaking = EgoCamera("fovea", vibration_deg=0.1)
    rows = []
    for env.steps in range(300):
        shaking.render(env)
        rows.append(shaking.project(point)[1])
    assert np.std(rows) == pytest.approx(0.1 * camera.params.pixels_per_degree, rel=0.15)
    env.vehicle.speed = 0.0
    shaking.render(env)
    assert shaking.project(point)[1] == pytest.approx(45.0, abs=1e-6)


def test_robust_condition_is_named():
    params = CameraParams.preset("fovea").with_condition("degraded")
    assert min(params.read_noise, params.vibration_deg, params.dive_deg) > 0
