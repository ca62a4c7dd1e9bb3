"""`FarFieldRegistration`: equations, known motions, exposure, turns and resets."""

import copy
import math
import pickle

import numpy as np
import pytest
from support.registration_reference import Reference
from support.roads import add_car, straight_env

from lgmd_gym import CameraParams, EgoCamera
from lgmd_gym.camera.body_motion import PITCH, ROLL, YAW, body_motion, road_gain
from lgmd_gym.sensing.image_stabiliser import far_camera
from lgmd_gym.sensing.registration import FarFieldRegistration, RegistrationParams

WORLDS = (6003, 6140, 6277)
FPS = 30.0


def make_camera(world=6003, **fields):
    return far_camera([CameraParams(stabilised="image", calibrated=True, world=world, **fields)])


def drive(env, camera, count):
    """Return frames of a drive along the road, uint8, shape (count, height, width)."""
    frames = []
    for step in range(count):
        env.steps = step
        frames.append(camera.render(env).copy())
        env.vehicle.position[0] += env.vehicle.speed / FPS
    return np.array(frames)


def registration_of(p, num=1):
    return FarFieldRegistration(p.shape, FPS, p.focal_px, num)


@pytest.mark.parametrize("condition", ["clear", "night", "fog"])
def test_the_kernels_equal_the_equations(condition):
    p = make_camera(road="rough").with_condition(condition)
    env = straight_env()
    add_car(env, 40.0, 3.5)
    frames = drive(env, EgoCamera(p), 12)
    kernel = registration_of(p)
    plain = Reference(p.shape, FPS, p.focal_px, RegistrationParams())
    for k, frame in enumerate(frames):
        turn = 0.003 * k
        estimate = kernel.step(frame[None], np.array([turn]))[0]
        np.testing.assert_allclose(estimate, plain.step(frame, turn), atol=2e-5)
    numbers, references, variances = kernel._state
    np.testing.assert_allclose(references[0], plain.image, atol=0.01)
    np.testing.assert_allclose(variances[0], plain.variance, rtol=1e-3, atol=0.05)
    np.testing.assert_allclose(numbers[0, 10], plain.pan)


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize(("pitch", "roll"), [(0.04, 0.0), (-0.15, 0.1), (0.4, -0.2), (0.0, 0.15)])
def test_known_rotations_of_rendered_frames(world, pitch, roll):
    """A shift of a quarter to 2.6 px, and a roll by up to 0.28 px at the sides of the frame."""
    p = make_camera(world)
    env, camera = straight_env(), EgoCamera(p)
    registration = registration_of(p)
    registration.step(camera.render(env)[None])
    tilted = rotated(camera, env, pitch, roll)
    for _ in range(5):
        estimate = registration.step(tilted[None])[0]
    assert estimate[0] == pytest.approx(pitch, abs=0.01 + 0.04 * abs(pitch))
    assert abs(estimate[1] - roll) < 0.02 + 0.4 * abs(roll)


def rotated(camera, env, pitch, roll):
    """Return the frame of a camera that is pitched upwards and rolled to the right [degrees]."""
    stage = camera._own_stage()
    mount = stage.batch._mounts[0, 0]
    kept = mount.copy()
    mount["stabilised"], mount["image_pitch"], mount["image_roll"] = 2, -pitch, -roll
    frame = camera.render(env).copy()
    stage.batch._mounts[0, 0] = kept
    return frame


def test_a_rough_ride_leaves_a_tenth_of_the_pitch():
    errors, body = [], []
    for world in WORLDS:
        p = make_camera(world, road="normal")
        env, registration = straight_env(), registration_of(p)
        registration.step(EgoCamera(p, road="still").render(env)[None])
        for step, frame in enumerate(drive(env, EgoCamera(p), 90)):
            gain = road_gain(1.0, env.vehicle.speed)
            truth = [gain * body_motion(world, axis, step / FPS) for axis in (PITCH, ROLL, YAW)]
            errors.append(registration.step(frame[None])[0] - truth)
            body.append(truth)
    (pitch, roll, yaw), (all_pitch, all_roll, all_yaw) = (
        np.sqrt(np.mean(np.square(x), axis=0)) for x in (errors, body)
    )
    assert pitch < 0.13 * all_pitch
    assert roll < 0.9 * all_roll
    assert yaw < 0.8 * all_yaw


@pytest.mark.parametrize(("gain", "offset"), [(1.25, 0.0), (0.8, 0.0), (1.0, 20.0), (0.85, -15.0)])
def test_steps_of_the_exposure_change_little(gain, offset):
    p = make_camera().with_condition("rain")
    env, camera = straight_env(), EgoCamera(p)
    registration, changed = registration_of(p), registration_of(p)
    frame, tilted = camera.render(env).copy(), rotated(camera, env, 0.1, 0.0)
    for one in (registration, changed):
        for _ in range(3):
            one.step(frame[None])
    brighter = np.clip(np.rint(gain * tilted + offset), 0, 255).astype(np.uint8)
    steps = [(registration.step(tilted[None])[0, 0], changed.step(brighter[None])[0, 0]) for _ in range(4)]
    assert steps[-1][0] == pytest.approx(0.1, abs=0.01)
    np.testing.assert_allclose(*np.array(steps)[1:].T, atol=0.01)


def test_a_turning_car_keeps_its_pitch():
    p = make_camera(roadside=0.0)
    env, camera = straight_env(line_types=False), EgoCamera(p)
    registration = registration_of(p)
    registration.step(camera.render(env)[None])
    for _ in range(60):
        env.vehicle.heading += math.radians(0.5)
        pitch, roll, _ = registration.step(camera.render(env)[None], np.array([math.radians(0.5)]))[0]
        assert abs(pitch) < 0.06
        assert abs(roll) < 0.2


def test_reset_forgets_the_reference_of_selected_cameras():
    p = make_camera(road="normal")
    frames = drive(straight_env(), EgoCamera(p), 6)
    two, fresh = registration_of(p, 2), registration_of(p)
    for frame in frames[:3]:
        two.step(np.stack([frame, frame]))
    assert two.started.all()
    kept = two.rotations[0].copy()
    two.reset(np.array([False, True]))
    assert two.started.tolist() == [True, False]
    np.testing.assert_array_equal(two.rotations, [kept, [0.0] * 3])
    for frame in frames[3:]:
        np.testing.assert_array_equal(two.step(np.stack([frame, frame]))[1], fresh.step(frame[None])[0])
    assert (two.rotations[0] != two.rotations[1]).all()


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda item: pickle.loads(pickle.dumps(item))])
def test_copies_are_independent(duplicate):
    p = make_camera(road="normal")
    frames = drive(straight_env(), EgoCamera(p), 4)
    one = registration_of(p)
    one.step(frames[:1])
    clone = duplicate(one)
    clone.step(frames[1:2])
    clone.reset()
    assert one.started.all()
    assert not clone.started.any()


def test_invalid_arguments_raise():
    with pytest.raises(ValueError, match=r"shape must be .* got \(50, 160\); use \(48, 160\)"):
        FarFieldRegistration((50, 160), FPS, 300.0)
    with pytest.raises(ValueError, match="fps must be"):
        FarFieldRegistration((48, 160), 0.0, 300.0)
    registration = FarFieldRegistration((48, 160), FPS, 300.0)
    with pytest.raises(
        ValueError, match=r"frames must be uint8 of shape \(1, 48, 160\), got uint8 \(48, 160\)"
    ):
        registration.step(np.zeros((48, 160), np.uint8))
    with pytest.raises(ValueError, match=r"turns must have the shape \(1,\), got \(2,\)"):
        registration.step(np.zeros((1, 48, 160), np.uint8), np.zeros(2))
