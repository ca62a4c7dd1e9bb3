"""Motion of the body: its spectrum against the measured one, and its effect on the pose."""

from math import nan, pi, radians, sqrt

import numpy as np
import pytest
from support.cameras import ego_camera, rig
from support.records import record
from support.roads import straight_env

from lgmd_gym.camera.body_motion import (
    BAND_RMS,
    BANDS_HZ,
    HEAVE,
    MAX_DEG,
    MEAN_SPEED,
    PITCH,
    ROLL,
    YAW,
    body_motion,
    road_gain,
)
from lgmd_gym.camera.env_state import SCENE
from lgmd_gym.camera.pinhole import LENS
from lgmd_gym.camera.pose import SHAKE, mount_of, pose_lens

SECONDS, RATE_HZ = 400, 105  # three times the 35 Hz of the measured change of pitch


def posed(ago=0.0, scene=(), **params):
    """Return the lens of a camera 2 m behind the front of a car of 4 m at the speed of the recording."""
    mount = mount_of(*rig(setback_m=2.0, **params)).view(np.recarray)[()]
    lens = record(LENS)
    state = record(SCENE, **({"length": 4.0, "speed": MEAN_SPEED} | dict(scene)))
    pose_lens(mount, state, ago, record(SHAKE, time_s=nan), lens)
    return lens


def series(axis, seed=0):
    return np.array([body_motion(seed, axis, k / RATE_HZ) for k in range(SECONDS * RATE_HZ)])


@pytest.mark.parametrize("axis", [PITCH, ROLL, YAW, HEAVE])
def test_rms_per_band_is_the_measured_one(axis):
    motion = series(axis)
    window = np.hanning(len(motion))
    power = 2.0 * np.abs(np.fft.rfft(window * motion)) ** 2 / (len(motion) * np.sum(window**2))
    hertz = np.fft.rfftfreq(len(motion), 1.0 / RATE_HZ)
    bands = [sqrt(power[(hertz >= low) & (hertz < high)].sum()) for low, high in BANDS_HZ]
    assert bands == pytest.approx(BAND_RMS[axis], rel=0.1)
    assert power[hertz < 0.4].sum() < 1e-3 * power.sum()


def test_change_of_pitch_between_frames_is_the_measured_one():
    """Measured: 0.042° RMS and 0.14° at the 99th percentile, where the speed changed."""
    motion = series(PITCH)
    change = np.abs(motion[3:] - motion[:-3])
    assert sqrt(np.mean(change**2)) == pytest.approx(0.042, rel=0.1)
    assert np.percentile(change, 99) == pytest.approx(0.14, rel=0.3)


def test_motion_is_a_function_of_seed_axis_and_time():
    values = {(seed, axis): body_motion(seed, axis, 3.7) for seed in (0, 1, 2**32 - 1) for axis in range(4)}
    assert len(set(values.values())) == 12
    assert values[1, ROLL] == body_motion(1, ROLL, 3.7) != body_motion(1, ROLL, 3.8)


@pytest.mark.parametrize(
    ("speed", "effective"), [(0.0, 0.0), (MEAN_SPEED, MEAN_SPEED), (-8.0, 8.0), (60.0, 60.0), (90.0, 60.0)]
)
def test_motion_grows_with_the_root_of_the_speed(speed, effective):
    gain = 2.0 * sqrt(effective / MEAN_SPEED)
    assert road_gain(2.0, speed) == pytest.approx(gain)
    lens = posed(scene={"time_s": 2.3, "speed": speed}, road="rough", seed=5)
    angles = [radians(gain * body_motion(5, axis, 2.3)) for axis in (PITCH, ROLL, YAW)]
    assert (lens.pitch, lens.roll, lens.yaw) == pytest.approx(angles)
    assert (lens.cos_roll, lens.sin_roll) == pytest.approx((np.cos(lens.roll), np.sin(lens.roll)))
    assert lens.z == pytest.approx(1.2 + gain * body_motion(5, HEAVE, 2.3))


def test_camera_to_the_side_rolls_with_the_pitch_of_the_body():
    pitch, roll, yaw = (radians(body_motion(0, axis, 0.9)) for axis in (PITCH, ROLL, YAW))
    right = posed(scene={"time_s": 0.9}, road="normal", yaw_deg=90.0)
    # Nose up is left side up for a camera that looks right, and the car's right side is in front of it.
    assert (right.pitch, right.roll, right.yaw) == pytest.approx((-roll, pitch, pi / 2 + yaw))
    left = posed(scene={"time_s": 0.9}, road="normal", yaw_deg=-90.0)
    assert (left.pitch, left.roll) == pytest.approx((roll, -pitch))


def test_earlier_pose_has_the_earlier_motion():
    lens = posed(0.2, scene={"time_s": 0.7}, road="normal")
    assert lens.pitch == pytest.approx(radians(body_motion(0, PITCH, 0.5)))


def test_motion_is_bounded_and_the_lens_stays_above_the_ground():
    scenes = [{"time_s": time, "speed": 60.0} for time in np.arange(0.0, 30.0, 0.05)]
    lenses = [posed(scene=scene, road="normal", height_m=0.02) for scene in scenes]
    for name, bound in zip(("pitch", "roll", "yaw"), MAX_DEG, strict=True):
        largest = np.rad2deg(max(abs(lens[name]) for lens in lenses))
        assert 0.5 * bound < largest < bound
    assert min(lens.z for lens in lenses) == pytest.approx(0.002)


def test_still_road_and_standstill_move_nothing():
    env = straight_env()
    env.steps = 7
    moving, still = ego_camera("fovea", road="normal"), ego_camera("fovea")
    frame = still.render(env)
    lens = still._lens
    assert (lens["pitch"], lens["roll"], lens["yaw"], lens["z"]) == (0.0, 0.0, 0.0, 1.2)
    assert not np.array_equal(moving.render(env), frame)
    again = moving.render(env)
    assert np.array_equal(ego_camera("fovea", road="normal").render(env), again)
    assert not np.array_equal(ego_camera("fovea", road="normal", seed=1)._lens, moving._lens)
    env.vehicle.speed = 0.0
    assert np.array_equal(moving.render(env), still.render(env))
