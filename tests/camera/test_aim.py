"""The gaze `ToStoppingPoint`: its aim on the ego's path and its zoom; stabilised and calibrated lenses."""

import math

import numpy as np
import pytest
from support.cameras import ego_camera, rig
from support.records import record
from support.roads import add_car, straight_env

from lgmd_gym.camera import Scene
from lgmd_gym.camera.body_motion import (
    GYRO_DRIFT_DEG,
    GYRO_GAIN_ERROR,
    PITCH,
    ROLL,
    YAW,
    body_motion,
    residual_motion,
)
from lgmd_gym.camera.effects import in_scene
from lgmd_gym.camera.env_state import SCENE
from lgmd_gym.camera.pinhole import LENS
from lgmd_gym.camera.pose import (
    CALIBRATED,
    ESTIMATE_ERROR,
    SHAKE,
    aim_depth,
    known_deceleration,
    mount_of,
    pose_lens,
)
from lgmd_gym.camera.worlds import draw_world

LENGTH, SETBACK, HEIGHT = 4.3, 1.7, 1.2


def stopping_camera(**fields):
    return ego_camera(rig(gaze="stopping", roadside=0.0, **fields))


def depth_of(speed, max_deceleration=9.0, **fields):
    """Return the distance of the aim from the lens [m]."""
    mount = mount_of(*rig(gaze="stopping", **fields), max_deceleration)
    return aim_depth(mount["aim"].view(np.recarray)[()], speed)


def stopping_distance(speed, deceleration=7.5, reaction=0.5):
    return speed**2 / (2 * deceleration) + speed * reaction


@pytest.mark.parametrize("speed", [6.0, 13.9, 27.8, 36.1])
@pytest.mark.parametrize(("reach", "offset_m"), [(1.0, 0.0), (0.5, 0.0), (1.5, 2.0), (0.8, -6.0)])
def test_the_aim_is_in_the_middle_and_the_span_fills_the_frame(speed, reach, offset_m):
    env = straight_env(speed=speed)
    camera = stopping_camera(reach=reach, offset_m=offset_m, span_m=3.0, lift=-1.0, shape=(40, 80))
    camera.render(env)
    ahead = reach * stopping_distance(speed) + LENGTH / 2
    y = env.vehicle.position[1] - offset_m
    (u, v), far = camera.project([(ahead, y, 0.0), (ahead * 40, y - 40 * offset_m + offset_m, HEIGHT)])
    depth = ahead - LENGTH / 2 + SETBACK
    # The pitch is that of the depth; an aim to the side is a little farther away.
    assert u == pytest.approx(40.0, abs=1e-6)
    assert v == pytest.approx(20.0, abs=0.1 + 0.5 * 80 * HEIGHT / 3.0 * (offset_m / depth) ** 2)
    assert far[1] < 20.0
    assert 80 / camera._own_stage().batch.lenses[0, 0, 0]["focal"] == pytest.approx(3.0 / depth)


def test_the_stopping_distance_has_a_least_value_and_grows_on_a_wet_road():
    def depth(speed, **fields):
        return depth_of(speed, **fields) - SETBACK

    assert depth(0.0) == depth(-3.0) == depth(2.0) == 4.0
    assert depth(20.0) == pytest.approx(stopping_distance(20.0))
    assert depth(20.0, wet=True) == pytest.approx(stopping_distance(20.0, 5.0))
    changed = depth(20.0, deceleration=9.0, reaction_s=0.2, reach=2.0)
    assert changed == pytest.approx(2.0 * stopping_distance(20.0, 9.0, 0.2))


def test_a_known_brake_scales_the_stopping_distance():
    def depth(**fields):
        return depth_of(20.0, brake_known=True, **fields) - SETBACK

    assert depth() == depth(wet=True) == pytest.approx(stopping_distance(20.0))
    assert depth(max_deceleration=6.0) == pytest.approx(stopping_distance(20.0, 5.0))
    assert depth(max_deceleration=6.0, deceleration=9.0) == pytest.approx(stopping_distance(20.0, 6.0))
    known = known_deceleration(Scene(world=8003), 6.0)
    assert known != 6.0
    assert depth(max_deceleration=6.0, world=8003) == pytest.approx(
        stopping_distance(20.0, 7.5 * known / 9.0)
    )


def test_the_estimate_of_the_brake_has_an_error_per_world():
    def errors(worlds, deceleration=8.0):
        scenes = [Scene(world=world) for world in worlds]
        return np.array([known_deceleration(scene, deceleration) / deceleration - 1.0 for scene in scenes])

    drawn = errors(range(2000))
    assert drawn.mean() == pytest.approx(0.0, abs=0.005)
    assert drawn.std() == pytest.approx(0.96 * ESTIMATE_ERROR, rel=0.05)  # of a clipped normal distribution
    assert abs(drawn).max() == pytest.approx(2.0 * ESTIMATE_ERROR)
    np.testing.assert_allclose(errors(range(20), 5.0), drawn[:20], atol=1e-12)
    assert errors([None]) == 0.0


def position_on_path(steering, way):
    """Return the centre of highway-env's bicycle after `way` metres, in steps of 1 mm."""
    x = y = heading = 0.0
    slip = math.atan(0.5 * math.tan(steering))
    for _ in range(round(1000 * way)):
        x += 1e-3 * math.cos(heading + slip)
        y += 1e-3 * math.sin(heading + slip)
        heading += 1e-3 * math.sin(slip) / (LENGTH / 2)
    return x, y


@pytest.mark.parametrize("radius", [60.0, -60.0, 150.0, 400.0])
@pytest.mark.parametrize("speed", [8.0, 14.0])
def test_in_a_curve_the_aim_is_on_the_path_of_the_ego(radius, speed):
    steering = math.atan(2 * math.tan(math.asin(LENGTH / 2 / radius)))
    env = straight_env(speed=speed, x=0.0, y=0.0)
    env.vehicle.action = {"steering": steering, "acceleration": 0.0}
    camera = stopping_camera(lift=-1.0, shape=(40, 80))
    camera.render(env)
    point = position_on_path(steering, stopping_distance(speed) + LENGTH / 2)
    u, _ = camera.project([(*point, 0.0)])[0]
    assert u == pytest.approx(40.0, abs=1.0)  # 3 cm
    assert math.copysign(1.0, camera._own_stage().batch.lenses[0, 0, 0]["yaw"]) == math.copysign(1.0, radius)


def test_a_given_gaze_replaces_the_aim():
    env = straight_env()
    camera = stopping_camera(shape=(40, 80), hfov_deg=20.0)
    camera.render(env, gaze=(5.0, 0.0))
    lens = camera._own_stage().batch.lenses[0, 0, 0]
    assert lens["yaw"] == pytest.approx(math.radians(5.0))
    assert lens["focal"] == pytest.approx(40 / math.tan(math.radians(10.0)))


def series(motion, axis, seconds=200):
    return np.array([motion(3, axis, k / 30.0) for k in range(30 * seconds)])


@pytest.mark.parametrize("axis", [PITCH, ROLL, YAW])
def test_a_stabilised_lens_keeps_a_small_part_of_the_motion(axis):
    body, left = series(body_motion, axis), series(residual_motion, axis)
    limit = math.hypot(GYRO_DRIFT_DEG, 3.0 * GYRO_GAIN_ERROR * body.std())
    assert 0.8 * GYRO_DRIFT_DEG < left.std() < limit
    # Between frames, the slow drift is small.
    assert np.diff(left).std() < max(0.1 * np.diff(body).std(), 0.001)


def lens_of(**params):
    lens = record(LENS)
    mount = mount_of(*rig(**params)).view(np.recarray)[()]
    scene = record(SCENE, length=LENGTH, speed=16.0, time_s=2.3, acceleration=-8.0)
    pose_lens(mount, scene, 0.0, record(SHAKE, time_s=math.nan), lens)
    return lens


def test_a_stabilised_lens_turns_little_and_heaves_as_before():
    moving, steady, still = (
        lens_of(world=7, road=road, stabiliser=flag)
        for road, flag in (("rough", None), ("rough", "gyroscope"), ("still", None))
    )
    for name in ("pitch", "roll", "yaw"):
        assert abs(steady[name] - still[name]) < math.radians(0.08)
        assert steady[name] != still[name]
    assert steady.z == moving.z != still.z
    dive, left = (lens_of(dive_deg=0.1, stabiliser=flag).pitch for flag in (None, "gyroscope"))
    assert (dive, left) == (pytest.approx(math.radians(-0.8)), pytest.approx(math.radians(-0.016)))


def test_a_calibrated_lens_knows_most_of_its_mounting_errors():
    world = draw_world(12)
    lens, known = lens_of(world=12), lens_of(world=12, calibrated=True)
    assert math.degrees(lens.pitch) == pytest.approx(world.pitch_error_deg)
    assert math.degrees(known.pitch) == pytest.approx(CALIBRATED * world.pitch_error_deg)
    assert math.degrees(known.yaw) == pytest.approx(CALIBRATED * world.yaw_error_deg)
    assert known.z == lens.z == pytest.approx(HEIGHT + world.mount_height_error)
    for calibrated, share in ((False, 1.0), (True, CALIBRATED)):
        p = rig(world=12, gaze="stopping", calibrated=calibrated)
        height = mount_of(*p)["aim"]["height"]
        assert height == pytest.approx(HEIGHT + (1.0 - share) * world.mount_height_error)


def test_no_calibration_finds_the_errors_of_the_scene():
    """The lens is tilted and higher, and the sensor aims as without; the world has its own errors, too."""
    world, errors = draw_world(12), {"pitch_error_deg": -0.8, "height_error_m": 0.12}
    for calibrated, share in ((False, 1.0), (True, CALIBRATED)):
        lens = lens_of(world=12, calibrated=calibrated, **errors)
        assert math.degrees(lens.pitch) == pytest.approx(share * world.pitch_error_deg - 0.8)
        assert lens.z == pytest.approx(HEIGHT + world.mount_height_error + 0.12)
        p, plain = (rig(world=12, gaze="stopping", calibrated=calibrated, **e) for e in (errors, {}))
        assert mount_of(*p)["aim"] == mount_of(*plain)["aim"]


def test_a_car_without_a_gyroscope_stabilises_no_lens():
    shared = {"road": "rough", "dive_deg": 0.1}
    plain, without = lens_of(**shared), lens_of(**shared, stabiliser="gyroscope", gyroscope=False)
    assert (plain.pitch, plain.roll, plain.yaw) == (without.pitch, without.roll, without.yaw)
    assert lens_of(**shared, stabiliser="gyroscope").pitch != plain.pitch


def test_at_night_the_headlights_are_those_of_the_car():
    """A box beside the path is as light in a frame that is aimed at it as in a frame straight ahead."""
    env = straight_env(speed=14.0, line_types=False)
    add_car(env, 24.0, 7.5, shade=120)
    shared = {"light": "night", "roadside": 0.0, "texture": 0.0, "vehicles": "box"}
    aimed = ego_camera(rig(gaze="stopping", offset_m=-4.0, span_m=3.0, shape=(60, 120), lift=-0.4, **shared))
    wide = ego_camera(rig(hfov_deg=60.0, shape=(400, 800), **shared))
    for camera in (aimed, wide):
        camera.render(env)
    points = [(21.988, y, z) for y in (7.2, 7.5) for z in (0.5, 0.9)]
    points += [(x, y, 0.0) for x in (23.0, 24.0) for y in (6.2, 6.4)]
    light = [
        [float(camera.light[int(v), int(u)]) for u, v in camera.project(points)] for camera in (aimed, wide)
    ]
    assert light[0] == pytest.approx(light[1], rel=0.03)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"panorama": "natural"}, "panorama must be 'skyline' with the gaze 'stopping' of camera 'custom'"),
        ({"span_m": 50.0}, "span_m must be at most 22.8 m, four times the least distance"),
        ({"reach": 0.1, "setback_m": -9.0}, "span_m must be at most -34.4 m"),
        ({"reach": 0.0}, "reach must be in \\[0.1, 10\\], got 0"),
    ],
)
def test_fields_that_do_not_fit_the_zoom_are_rejected(fields, message):
    with pytest.raises(ValueError, match=message):
        in_scene(*rig(gaze="stopping", **fields))
