"""Extreme scenes and cameras: bounded time, finite light, no effect on later frames."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.cameras import ego_camera, rig
from support.roads import add_car, lens_x, straight_env

from lgmd_gym.camera.render.coverage import add_edge

OPTIONS = st.fixed_dictionaries(
    {
        "shape": st.tuples(st.integers(4, 60), st.integers(4, 60)),
        "hfov_deg": st.floats(2.0, 160.0),
        "pitch_deg": st.floats(-60.0, 60.0),
        "yaw_deg": st.floats(-360.0, 360.0),
        "height_m": st.floats(0.05, 5.0),
        "light": st.sampled_from(["day", "night"]),
        "visibility_m": st.sampled_from([0.0, 0.01, 1.0, 30.0]),
        "shutter_s": st.sampled_from([0.0, 0.03]),
        "linear_light": st.booleans(),
        "auto_exposure_s": st.sampled_from([0.0, 0.2]),
        "road": st.sampled_from(["still", "rough"]),
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
def test_any_camera_renders_any_scene(options, poses, steering):
    env = straight_env(speed=30.0)
    env.steps = 5
    env.vehicle.action = {"steering": steering, "acceleration": -3.0}
    for x, y, turn, speed in poses:
        add_car(env, x, y, heading=turn, speed=speed)
    camera = ego_camera(rig(**options))
    frame = camera.render(env)
    assert frame.shape == options["shape"]
    assert np.isfinite(camera.light).all()
    assert np.array_equal(camera.render(env), frame)


PLACE, TURN = st.floats(-300, 300), st.floats(-10, 10)
POSE = st.tuples(PLACE, PLACE, TURN, st.floats(0.1, 30), st.floats(0.1, 5))


@settings(max_examples=60, deadline=None)
@given(
    poses=st.lists(POSE, max_size=50),
    heading=st.floats(-4, 4),
    preset=st.sampled_from(["wide", "fovea"]),
    pitch=st.floats(-30, 30),
)
def test_any_pose_of_fifty_vehicles_renders_in_bounded_time(poses, heading, preset, pitch):
    env = straight_env(heading=heading)
    for x, y, turn, length, width in poses:
        add_car(env, x, y, heading=turn, size=(length, width, 1.5))
    camera = ego_camera(preset, pitch_deg=pitch)
    camera.render(env)
    start = time.process_time()
    frame = camera.render(env)
    assert time.process_time() - start < 0.25
    assert frame.shape == (90, 160)
    assert np.array_equal(camera.render(env), frame)


@settings(max_examples=40, deadline=None)
@given(x=st.floats(-3, 9), y=st.floats(-3, 3), turn=st.floats(-4, 4))
def test_vehicle_at_the_lens_changes_no_row_above_its_roof(x, y, turn):
    env = straight_env()
    camera = ego_camera("wide", roadside=0.0)
    car = add_car(env, lens_x(env) + x, 3.5 + y, heading=turn, shade=30)
    frame = camera.render(env)
    # The car is lower than 1.43 m: rows above its nearest possible point do not change.
    c, s = abs(np.cos(turn)), abs(np.sin(turn))
    clear = x - 0.5 * (car.LENGTH * c + car.WIDTH * s)
    if clear > 0.3:
        top = 45 - camera.camera.focal_px * 0.23 / clear
        env.road.vehicles.remove(car)
        bare = camera.render(env)
        rows = max(int(top) - 1, 0)
        assert np.array_equal(frame[:rows], bare[:rows])


def test_vehicle_around_behind_and_next_to_the_lens():
    env = straight_env()
    camera = ego_camera("wide", roadside=0.0)
    bare = camera.render(env)
    car = add_car(env, lens_x(env), 3.5)
    inside = camera.render(env)  # the lens is inside the car: only its shadow is drawn
    assert np.array_equal(inside[:45], bare[:45])
    car.position[0] = -20.0
    assert np.array_equal(camera.render(env), bare)  # behind
    car.position[:] = lens_x(env) + 1.0, 3.5 - 1.2
    adjacent = camera.render(env)
    assert np.any(adjacent[:, :80] != bare[:, :80])
    car.position[:] = env.vehicle.position
    camera.render(env)


@pytest.mark.parametrize("height", [np.nan, np.inf, 1e300])
def test_invalid_vehicle_height_does_not_affect_later_frames(height):
    env = straight_env()
    car = add_car(env, 20.0, 3.5)
    for pitch in (0.0, 5.0):
        camera = ego_camera("wide", pitch_deg=pitch)
        camera.render(env)
        car.HEIGHT = height
        camera.render(env)
        car.HEIGHT = 1.4
        again = camera.render(env)
        assert np.array_equal(again, ego_camera("wide", pitch_deg=pitch).render(env))


def test_edges_are_clipped_to_the_accumulator():
    """Random edges change no memory behind the accumulator."""
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


def test_coverage_buffers_are_zero_after_each_frame():
    """Coverage that is not cleared would appear in every later frame."""
    env = straight_env()
    for k in range(6):
        add_car(env, lens_x(env) + 4.0 + 3.0 * k, 3.5 * (k % 3), heading=0.5 * k)
    for preset in ("wide", "fovea"):
        camera = ego_camera(preset, guard_rail=True)
        for yaw_deg in (-120.0, -35.0, 0.0, 35.0, 120.0):
            camera.render(env, gaze=(yaw_deg, 0.1 * yaw_deg))
            assert not camera.buffers.ground.any()
            assert not camera.buffers.solids.any()
