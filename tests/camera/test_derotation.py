"""Derotated views turn by whole pixels, so that the rotation of the car causes no motion in the neuron."""

import math

import numpy as np
import pytest
from support.cameras import ego_camera, rig
from support.roads import straight_env

from lgmd_gym import LGMDParams
from lgmd_gym.agents.sides import side_cameras
from lgmd_gym.camera import EgoCamera, Fixed
from lgmd_gym.sensing.channel import Channel
from lgmd_gym.sensing.sensor_array import SensorArray

LENS = {"shape": (40, 80), "hfov_deg": 30.0}


def views(camera, env, headings):
    """Yield the yaw [px] and the lens of a camera for some headings of the ego [rad]."""
    for heading in headings:
        env.vehicle.heading = heading
        camera.render(env)
        yield camera.yaw_px, camera._lens.copy()


def test_the_view_turns_by_whole_pixels_within_half_a_pixel_of_the_car():
    p = rig(**LENS, yaw_deg=12.0, derotated=True)
    env = straight_env(speed=0.0)
    headings = np.linspace(-0.3, 0.4, 23)
    for heading, (yaw_px, lens) in zip(headings, views(EgoCamera(*p), env, headings), strict=True):
        assert lens["yaw"] * p.camera.focal_px == pytest.approx(yaw_px, abs=1e-6)
        assert abs(lens["yaw"] - heading - math.radians(12.0)) * p.camera.focal_px <= 0.5 + 1e-9


def test_distant_points_move_by_the_turn():
    p = rig(**LENS, derotated=True)
    camera, env = ego_camera(p), straight_env(speed=0.0)
    columns, yaws = [], []
    for yaw_px, _ in views(camera, env, np.radians([0.0, 0.9, 2.2, 1.4, -1.0])):
        columns.append(camera.project((3000.0, 0.0, 0.0))[0])
        yaws.append(yaw_px)
    assert len(set(yaws)) == len(yaws)
    assert np.diff(columns) == pytest.approx(-np.diff(yaws), abs=0.1)


def test_other_views_have_the_yaw_of_the_car():
    camera = ego_camera(rig(**LENS))
    assert camera.yaw_px == 0
    (yaw_px, lens), *_ = views(camera, straight_env(speed=0.0), [0.1234])
    assert (yaw_px, lens["yaw"]) == (0, pytest.approx(0.1234))


def test_motion_blur_contains_the_rotation_during_the_exposure():
    fields = LENS | {"gaze": "path", "shutter_s": 0.02}
    pairs = []
    for derotated in (False, True):
        env = straight_env(speed=10.0)
        env.vehicle.action = {"steering": 0.2, "acceleration": 0.0}
        camera = ego_camera(rig(**fields, derotated=derotated))
        camera.render(env)
        end, start = camera._own_stage().batch.lenses[0, 0]["yaw"]
        pairs.append(end - start)
    assert pairs[0] > 0.001
    assert pairs[1] == pytest.approx(pairs[0], abs=1e-12)


@pytest.mark.parametrize("neuron", ["lgmd", "dsn", "lplc2"])
def test_a_rotation_of_the_car_causes_no_motion(neuron):
    cameras = [
        Channel(camera={"name": str(derotated), **LENS, "gaze": Fixed(derotated=derotated)}, neuron=neuron)
        for derotated in (False, True)
    ]
    env, sensors = straight_env(lanes=2, speed=0.0), SensorArray(cameras, 30.0, LGMDParams())
    changes = []
    for step in range(20):
        env.vehicle.heading = 0.012 * step
        sensors.read(env)
        sensors.step()
        changes.append(sensors.responses.ffi[0].copy())
    steady, derotated = np.mean(changes[5:], axis=0)
    assert steady > 1.0
    assert derotated < 0.35 * steady


def test_the_fields_at_the_sides_are_derotated():
    assert all(channel["camera"]["gaze"]["derotated"] for channel in side_cameras())


def test_a_zooming_view_cannot_be_derotated():
    with pytest.raises(ValueError, match="unknown camera gaze field 'derotated'"):
        rig(gaze="stopping", derotated=True)
    with pytest.raises(ValueError, match="camera gaze derotated must be"):
        rig(derotated="yes")
