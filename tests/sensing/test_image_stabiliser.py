"""`stabilised="image"`: cameras of a `SensorArray` that follow the estimate of a far-field camera."""

import copy
import math
import pickle

import numpy as np
import pytest
from support.roads import add_car, straight_env

from lgmd_gym import CameraParams, EgoCamera, LGMDObservation, LGMDParams
from lgmd_gym.camera.body_motion import PITCH, ROLL, YAW, body_motion, road_gain
from lgmd_gym.sensing.image_stabiliser import far_camera
from lgmd_gym.sensing.registration import FarFieldRegistration
from lgmd_gym.sensing.sensor_array import SensorArray

FPS = 30.0
SHARED = {"shape": (30, 40), "world": 6003, "road": "normal", "stabilised": "image", "calibrated": True}
AHEAD = {"name": "ahead", "hfov_deg": 20.0, **SHARED}
CAMERAS = [
    AHEAD,
    {"name": "side", "yaw_deg": 30.0, **SHARED},
    {"name": "flow", "hfov_deg": 20.0, "detector": "dsn", **SHARED},
    {"name": "moving", **SHARED, "stabilised": False, "shape": (20, 40)},
]
FIELDS = [{}, {"condition": "night", "texture": 0.7}, {"condition": "fog", "world": 6140}]


def scenes():
    envs = [straight_env(speed=speed) for speed in (10.0, 17.0, 25.0)]
    add_car(envs[1], 30.0, 3.5)
    return envs


def move(envs, step):
    for k, env in enumerate(envs):
        env.steps = step
        env.vehicle.position[0] += env.vehicle.speed / FPS
        env.vehicle.heading = 0.004 * step * k


def make_array(num_envs=3, camera=CAMERAS, **arguments):
    sensors = SensorArray(camera, FPS, LGMDParams(), num_envs, **arguments)
    for index in range(num_envs):
        sensors.set_camera_fields(index, FIELDS[index])
    return sensors


def run(sensors, envs, steps):
    for step in steps:
        move(envs, step)
        for index, env in enumerate(envs):
            sensors.read(env, index)
        sensors.step()


def rotations(sensors):
    return sensors._stabiliser.registration.rotations


def assert_equal(one, other, index=slice(None)):
    for a, b in zip(one.frames, other.frames, strict=True):
        np.testing.assert_array_equal(a[index], b[index])
    for a, b in zip(one.responses, other.responses, strict=True):
        np.testing.assert_array_equal(a[index], b[index])
    np.testing.assert_array_equal(rotations(one)[index], rotations(other)[index])


def test_cameras_turn_by_the_body_without_the_estimate():
    """The estimate is that of the registration of frames of the far-field camera itself."""
    env, sensors = straight_env(speed=17.0), make_array(1)
    p = far_camera([CameraParams.make(AHEAD)])
    camera, registration = EgoCamera(p), FarFieldRegistration(p.shape, FPS, p.focal_px)
    heading, moving = 0.0, EgoCamera(CameraParams.make(CAMERAS[3]))
    for step in range(20):
        move([env], step)
        env.vehicle.heading = 0.002 * step
        if step == 0:
            registration.step(EgoCamera(p, road="still").render(env)[None])
        turn = env.vehicle.heading - heading if step else 0.0
        heading = env.vehicle.heading
        pitch, roll, yaw = registration.step(camera.render(env)[None], np.array([turn]))[0]
        sensors.read(env)
        sensors.process(0, 1)
        np.testing.assert_allclose(rotations(sensors)[0], [pitch, roll, yaw], atol=1e-9)
        gain = road_gain(1.0, 17.0)
        body = [gain * body_motion(6003, axis, step / FPS) for axis in (PITCH, ROLL, YAW)]
        lens = sensors.cameras[0]["ahead"]._lens
        still = EgoCamera(CameraParams.make(AHEAD, stabilised=False, road="still"))
        still.render(env)
        turned = math.radians(body[2] - yaw)
        assert lens["yaw"] - still._lens["yaw"] == pytest.approx(turned, abs=1e-10)
        left = math.degrees(lens["pitch"] - still._lens["pitch"]), math.degrees(lens["roll"])
        c, s = math.cos(lens["yaw"] - turned - heading), math.sin(lens["yaw"] - turned - heading)
        pitch, roll = body[0] - pitch, body[1] - roll
        assert left == pytest.approx((pitch * c - roll * s, roll * c + pitch * s), abs=1e-9)
        np.testing.assert_array_equal(sensors.frame_of(3), moving.render(env))


def test_the_camera_ahead_pitches_little():
    env, sensors = straight_env(speed=17.0), make_array(1)
    pitches = []
    for step in range(60):
        run(sensors, [env], [step])
        pitches.append(sensors.cameras[0]["ahead"]._lens["pitch"])
    body = [road_gain(1.0, 17.0) * body_motion(6003, PITCH, step / FPS) for step in range(60)]
    assert np.degrees(np.std(pitches)) < 0.13 * np.std(body)


@pytest.mark.parametrize("threads", [None, 3])
def test_environments_are_independent_of_each_other(threads):
    together, envs = make_array(threads=threads), scenes()
    run(together, envs, range(6))
    for index, env in enumerate(scenes()):
        alone = SensorArray(CAMERAS, FPS, LGMDParams(), 1)
        alone.set_camera_fields(0, FIELDS[index])
        for step in range(6):
            env.steps = step
            env.vehicle.position[0] += env.vehicle.speed / FPS
            env.vehicle.heading = 0.004 * step * index
            alone.read(env)
            alone.process(0, 1)
        for k in range(len(CAMERAS)):
            np.testing.assert_array_equal(together.frame_of(k, index), alone.frame_of(k))
        np.testing.assert_array_equal(rotations(together)[index], rotations(alone)[0])


def test_inactive_environments_keep_their_estimates():
    sensors, envs = make_array(), scenes()
    run(sensors, envs, range(4))
    before = rotations(sensors).copy()
    move(envs, 4)
    for index, env in enumerate(envs):
        sensors.read(env, index)
    sensors.process(0, 3, np.array([False, True, False]))
    changed = (rotations(sensors) != before).all(axis=1)
    assert changed.tolist() == [False, True, False]


def test_reset_restarts_the_estimates_of_selected_environments():
    sensors, fresh = make_array(), make_array()
    run(sensors, scenes(), range(5))
    sensors.reset(np.array([True, False, True]))
    run(sensors, scenes(), range(4))
    run(fresh, scenes(), range(4))
    assert_equal(sensors, fresh, np.array([0, 2]))
    assert (rotations(sensors)[1] != rotations(fresh)[1]).all()


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda item: pickle.loads(pickle.dumps(item))])
def test_copies_continue_alike_and_independently(duplicate):
    sensors, envs = make_array(), scenes()
    run(sensors, envs, range(4))
    clone, others = duplicate(sensors), copy.deepcopy(envs)
    run(sensors, envs, range(4, 7))
    assert (rotations(clone) != rotations(sensors)).all()
    run(clone, others, range(4, 7))
    assert_equal(sensors, clone)


def test_the_far_field_camera_costs_nothing_without_image_stabilisation():
    sensors = SensorArray([{"name": "ahead", "stabilised": True}, "wide"], FPS, LGMDParams())
    assert sensors._stabiliser is None
    assert far_camera([None, CameraParams()]) is None


def test_a_camera_alone_refuses_image_stabilisation():
    with pytest.raises(ValueError, match=r"camera 'ahead' .* use LGMDObservation or SensorArray"):
        EgoCamera(AHEAD)
    with pytest.raises(ValueError, match="camera stabilised must be True, False or 'image', got 'imag'"):
        CameraParams(stabilised="imag")
    with pytest.raises(ValueError, match="got 1"):
        CameraParams(stabilised=1)


def test_camera_fields_keep_image_stabilisation():
    sensors = make_array(1, [AHEAD])
    with pytest.raises(ValueError, match="must keep stabilised='image' of camera 'ahead', got True"):
        sensors.set_camera_fields(0, {"stabilised": True})
    sensors = SensorArray("wide", FPS, LGMDParams())
    with pytest.raises(ValueError, match="must keep stabilised=False of camera 'wide', got 'image'"):
        sensors.set_camera_fields(0, {"stabilised": "image"})


def test_in_an_environment():
    import gymnasium as gym

    env = gym.make("LGMD/Following-v0", camera=AHEAD, world=6003)
    observation, _ = env.reset(seed=1)
    for _ in range(3):
        observation, *_ = env.step(np.array([-0.2], np.float32))
    assert env.observation_space.contains(observation)
    assert isinstance(env, LGMDObservation) or env.has_wrapper_attr("sensors")
    env.close()
