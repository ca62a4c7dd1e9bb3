"""The sensor: linear light, its noise, and automatic exposure."""

import copy
import pickle
from math import exp, sqrt

import numpy as np
import pytest
from support.cameras import ego_camera, rig
from support.records import records
from support.roads import add_mark, straight_env

from lgmd_gym.camera import EgoCamera
from lgmd_gym.camera.effects import look_of, noise_table
from lgmd_gym.camera.env_state import SCENE
from lgmd_gym.camera.render.sensor import (
    CONTRAST_GREY,
    CONTRAST_MEAN,
    STATE_SIZE,
    adapt_contrast,
    adapt_exposure,
    expose,
    fixed_tone,
    follow_exposure,
)

BRIDGE = {"size": (200.0, 60.0), "shade": 10.0}


def exposed(light, gain=1.0, start=0, **fields):
    """Return the frame of an even light, shape (200, 201)."""
    image, out = np.full((200, 201), light, np.float32), np.zeros((200, 201), np.uint8)
    look = look_of(*rig(**fields))[()]
    expose(out, image, look, gain, fixed_tone(look), noise_table(0), start)
    return out


@pytest.mark.parametrize("light", [-3.0, 0.0, 0.3, 1.0, 40.0, 200.0, 255.0, 400.0])
@pytest.mark.parametrize("gain", [0.25, 1.0, 8.0])
def test_linear_light_is_encoded_with_a_square_root(light, gain):
    assert np.all(exposed(light, gain) == int(min(max(gain * light, 0.0), 255.0) + 0.5))
    grey = 255.0 * sqrt(min(max(gain * light, 0.0) / 255.0, 1.0))
    assert np.all(exposed(light, gain, linear_light=True) == int(grey + 0.5))


@pytest.mark.parametrize("grey", [64.0, 128.0, 200.0])
def test_noise_of_linear_light_is_the_same_at_every_grey(grey):
    """Photon noise grows with the root of the light, as the curve's slope falls."""
    light = grey**2 / 255.0
    assert exposed(light, shot_noise=4.0, linear_light=True).std() == pytest.approx(4.0, rel=0.03)
    both = exposed(light, shot_noise=4.0, read_noise=3.0, linear_light=True).std()
    assert both == pytest.approx(5.0, rel=0.03)


def test_rows_have_different_noise_also_at_the_end_of_the_table():
    frame = exposed(60.0, start=(1 << 17) - 150, shot_noise=4.0, linear_light=True)
    assert len({row.tobytes() for row in frame}) == len(frame)
    assert np.array_equal(frame[0, 150:], exposed(60.0, shot_noise=4.0, linear_light=True)[0, :51])


def test_gain_amplifies_noise():
    """The same grey from a quarter of the light has twice the noise."""
    light = 128.0**2 / 255.0
    noise = exposed(light / 4.0, 4.0, shot_noise=2.0, linear_light=True).std()
    assert noise == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize("linear", [False, True])
def test_gain_brings_the_mean_light_to_mid_grey(linear):
    look = look_of(*rig(auto_exposure_s=1.0, linear_light=linear))[()]
    target = 110.0**2 / 255.0 if linear else 110.0
    exposure = np.full(STATE_SIZE, np.nan)
    assert adapt_exposure(exposure, np.full((9, 21), 40.0, np.float32), look) == pytest.approx(target / 40.0)
    # The next frame has the same gain, and calls for another one.
    assert adapt_exposure(exposure, np.full((9, 21), 20.0, np.float32), look) == pytest.approx(target / 40.0)
    assert exposure[1] == pytest.approx(target / 20.0)


@pytest.mark.parametrize(
    ("light", "night", "gain"), [(4.0, 0, 8.0), (1e4, 0, 110 / 255), (0.0, 1, 6.0), (250.0, 1, 0.5)]
)
def test_gain_is_bounded(light, night, gain):
    look = look_of(*rig(auto_exposure_s=1.0, light=("day", "night")[night]))[()]
    assert adapt_exposure(
        np.full(STATE_SIZE, np.nan), np.full((8, 8), light, np.float32), look
    ) == pytest.approx(gain)


def test_gain_approaches_with_the_time_constant():
    scenes = records(
        SCENE, *({"time_s": time, "steps": step} for time, step in ((2.0, 20), (2.3, 23), (0.1, 1)))
    )
    look = look_of(*rig(auto_exposure_s=0.5, contrast_s=1.0))[()]
    exposure = np.array([1.0, 4.0, 1.5, 100.0, 20.0, 50.0, 10.0])
    follow_exposure(exposure, scenes[0], look)
    # One time constant: the logarithm has gone 63 % of its way.
    assert exposure[:3] == pytest.approx([4.0 ** (1.0 - exp(-1.0)), 4.0, 2.0])
    assert exposure[3:] == pytest.approx([50 + 50 * exp(-0.5), 10 + 10 * exp(-0.5), 50.0, 10.0])
    follow_exposure(exposure, scenes[0], look)
    assert exposure[0] == pytest.approx(4.0 ** (1.0 - exp(-1.0)))  # no time has passed
    follow_exposure(exposure, scenes[1], look)
    assert exposure[0] == pytest.approx(4.0 ** (1.0 - exp(-1.6)))
    follow_exposure(exposure, scenes[2], look)
    assert np.isnan(exposure[0])  # the clock has gone back


@pytest.mark.parametrize("linear", [False, True])
@pytest.mark.parametrize(
    ("deviation", "gain"), [(10.0, 2.5), (50.0, 0.5), (90.0, 0.5), (4.0, 3.0), (25.0, 1.0)]
)
def test_contrast_control_brings_mean_and_deviation_to_those_of_every_frame(linear, deviation, gain):
    """Without noise: half of the pixels are darker and half lighter than the mean by the deviation."""
    grey = 120.0 + np.where(np.arange(1600).reshape(40, 40) % 2 == 0, -deviation, deviation)
    image = (grey**2 / 255.0 if linear else grey).astype(np.float32)
    look = look_of(*rig(contrast_s=1.0, linear_light=linear))[()]
    exposure, out = np.full(STATE_SIZE, np.nan), np.zeros((40, 40), np.uint8)
    tone = adapt_contrast(exposure, image, look, 1.0, 1.0)
    assert tone[0] == pytest.approx(gain, rel=1e-4)
    expose(out, image, look, 1.0, tone, noise_table(0), 0)
    assert out.mean() == pytest.approx(CONTRAST_MEAN, abs=0.6)
    assert out.std() == pytest.approx(gain * deviation, abs=0.6)
    assert (gain * deviation == CONTRAST_GREY) == (gain not in (0.5, 3.0) or deviation == 50.0)
    # A frame of another contrast gets the same tone curve at first.
    assert adapt_contrast(exposure, np.full_like(image, 60.0), look, 1.0, 1.0) == tone
    assert exposure[6] == pytest.approx(0.0, abs=1e-2)


def test_contrast_of_fog_is_amplified_over_time():
    """A road in fog: the contrast of the frame is brought to that of every frame."""
    env = straight_env()
    plain, controlled = (
        ego_camera("fovea", weather="fog", roadside=0.0, contrast_s=contrast_s) for contrast_s in (0.0, 0.4)
    )
    deviations = []
    for frame in range(60):
        env.steps = frame
        deviations.append([float(camera.render(env).std()) for camera in (plain, controlled)])
    assert deviations[-1][0] < 0.8 * CONTRAST_GREY
    assert deviations[-1][1] == pytest.approx(CONTRAST_GREY, rel=0.05)


def drive_under_a_bridge(camera):
    """Return the grey of the road in eight frames 0.5 s apart, with a shadow from the third one on."""
    env, greys = straight_env(), []
    for frame in range(8):
        env.steps = 15 * frame
        if frame == 2:
            add_mark(env, 50.0, 3.5, **BRIDGE)
        greys.append(float(camera.render(env)[70:].mean()))
    return greys


def test_picture_becomes_brighter_under_a_bridge_after_a_delay():
    greys = drive_under_a_bridge(ego_camera("wide", auto_exposure_s=0.5, roadside=0.0))
    fixed = drive_under_a_bridge(ego_camera("wide", roadside=0.0))
    assert fixed[:2] == [fixed[0]] * 2
    assert fixed[2:] == [fixed[2]] * 6
    assert greys[1] == pytest.approx(greys[0], abs=0.5)
    # The gain of the frames before.
    assert greys[2] / greys[1] == pytest.approx(fixed[2] / fixed[1], rel=0.02)
    assert greys[3] > greys[2] + 5.0
    assert np.all(np.diff(greys[3:]) > 0.0)
    assert greys[7] - greys[6] < 0.1 * (greys[3] - greys[2])


def test_first_frame_of_an_episode_has_its_own_gain():
    env, camera = straight_env(), ego_camera("wide", auto_exposure_s=5.0, roadside=0.0)
    drive_under_a_bridge(camera)
    env.steps = 3
    assert np.array_equal(camera.render(env), EgoCamera(camera.camera, camera.scene).render(env))
    env.steps = 9
    camera.render(env)
    add_mark(env, 50.0, 3.5, **BRIDGE)
    env.steps = 0
    assert np.array_equal(camera.render(env), EgoCamera(camera.camera, camera.scene).render(env))


@pytest.mark.parametrize(
    "copied", [copy.deepcopy, lambda camera: pickle.loads(pickle.dumps(camera))], ids=["deepcopy", "pickle"]
)
def test_copy_continues_with_the_same_gain(copied):
    env, camera = straight_env(), ego_camera("wide", auto_exposure_s=0.5, roadside=0.0)
    camera.render(env)
    add_mark(env, 50.0, 3.5, **BRIDGE)
    env.steps = 15
    camera.render(env)
    clone = copied(camera)
    for env.steps in (20, 30):
        frame = camera.render(env)
        assert np.array_equal(clone.render(env), frame)
    assert not np.array_equal(EgoCamera(camera.camera, camera.scene).render(env), frame)
