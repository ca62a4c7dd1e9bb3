"""Projection and pose of the camera: every expected value is computed by hand."""

from math import asin, atan, cos, nan, pi, radians, sin, tan

import numpy as np
import pytest
from support.cameras import rig
from support.records import lens_of, record

from lgmd_gym.camera.env_state import SCENE
from lgmd_gym.camera.pinhole import LENS, project
from lgmd_gym.camera.pose import SHAKE, mount_of, pose_lens


@pytest.mark.parametrize(
    ("lens", "point", "pixel"),
    [
        # Focal length 100 px, centre at (60, 40): 10 m ahead, 1 m is 10 px.
        ({}, (10.0, 0.0, 1.0), (60.0, 40.0)),
        ({}, (10.0, 1.0, 1.0), (70.0, 40.0)),
        ({}, (10.0, 0.0, 0.0), (60.0, 50.0)),
        ({"x": 2.0, "y": 3.0, "z": 4.0}, (12.0, 4.0, 6.0), (70.0, 20.0)),
        ({"yaw": pi / 2}, (1.0, 10.0, 1.0), (50.0, 40.0)),
        # A lens that looks up by 45° has a point at 45° in its centre, and the horizon 100 px lower.
        ({"pitch": pi / 4}, (10.0, 0.0, 11.0), (60.0, 40.0)),
        ({"pitch": pi / 4}, (1e9, 0.0, 1.0), (60.0, 140.0)),
        ({"pitch": -pi / 4}, (1e9, 0.0, 1.0), (60.0, -60.0)),
        # A roll of 90° to the right puts the right side at the top, and the ground on the right.
        ({"roll": pi / 2}, (10.0, 1.0, 1.0), (60.0, 30.0)),
        ({"roll": pi / 2}, (10.0, 0.0, 0.0), (70.0, 40.0)),
        ({"roll": asin(0.6)}, (10.0, 5.0, 1.0), (100.0, 10.0)),
        ({"pitch": pi / 4, "roll": pi / 2}, (1e9, 0.0, 1.0), (160.0, 40.0)),
    ],
)
def test_projection(lens, point, pixel):
    assert project(lens_of(**lens), np.array(point)) == pytest.approx(pixel, abs=1e-6)


def test_points_behind_the_lens_have_no_projection():
    pixels = project(lens_of(), np.array([(1e-7, 0.0, 1.0), (-5.0, 0.0, 1.0), (2e-6, 0.0, 1.0)]))
    assert np.isnan(pixels).all(axis=1).tolist() == [True, True, False]


def posed(params=(), ago=0.0, **scene):
    """Return the lens of a camera on a car of 4 m at 10 m/s."""
    params = {"setback_m": 0.5, "left_m": 0.25, "height_m": 1.5} | dict(params)
    mount = mount_of(*rig(**params)).view(np.recarray)[()]
    lens = record(LENS)
    state = record(SCENE, **({"length": 4.0, "speed": 10.0} | scene))
    pose_lens(mount, state, ago, record(SHAKE, time_s=nan), lens)
    return lens


def test_mount_on_the_car():
    lens = posed(x=100.0, y=50.0)
    assert (lens.x, lens.y, lens.z) == (101.5, 49.75, 1.5)  # left is towards smaller y
    lens = posed(x=100.0, y=50.0, heading=pi / 2)
    assert (lens.x, lens.y) == pytest.approx((100.25, 51.5))
    assert (lens.yaw, lens.cos_yaw, lens.sin_yaw) == pytest.approx((pi / 2, 0.0, 1.0))


def test_options_of_the_mount():
    def mount(**fields):
        return mount_of(*rig(**fields))

    for fields in ({"shot_noise": 0.05}, {"read_noise": 0.05}, {"shot_noise": 1.0, "read_noise": 1.0}):
        assert mount(**fields)["noisy"] == 1
    assert mount(shot_noise=0.0, read_noise=0.0)["noisy"] == 0
    assert [mount(gaze=gaze)["gaze"] for gaze in ("fixed", "path", "stopping")] == [0, 1, 2]
    assert [mount(stabiliser=kind)["stabilised"] for kind in ("gyroscope", None)] == [1, 0]
    assert [mount(vehicles=kind)["box"] for kind in ("box", "car")] == [1, 0]
    values = mount(seed=17, shutter_s=0.01)
    assert (values["seed"], values["shutter_s"]) == (17, 0.01)
    assert [mount(road=road)["road"] for road in ("still", "smooth", "normal", "rough")] == [
        0.0,
        0.5,
        1.0,
        2.0,
    ]


def test_gaze_of_the_mount():
    lens = posed({"yaw_deg": 10.0, "pitch_deg": -5.0, "shape": (90, 160), "hfov_deg": 60.0}, heading=0.5)
    assert (lens.yaw, lens.pitch) == pytest.approx((0.5 + radians(10), radians(-5)))
    assert (lens.cos_pitch, lens.sin_pitch) == pytest.approx((cos(radians(5)), -sin(radians(5))))
    assert (lens.sin_yaw, lens.cos_yaw) == pytest.approx((sin(lens.yaw), cos(lens.yaw)))
    assert (lens.focal, lens.centre_u, lens.centre_v) == pytest.approx((80 / tan(radians(30)), 80.0, 45.0))


# Bicycle model with tan(steering) = 2·tan(slip) and sin(slip) = length/2 · curvature.
SLIP = 0.1
STEERING = atan(2 * tan(SLIP))
YAW_RATE = 10 * sin(SLIP) / 2  # 10 m/s, half length 2 m


@pytest.mark.parametrize("sign", [1, -1])
def test_gaze_along_the_path_is_where_the_car_is_in_one_second(sign):
    lens = posed({"gaze": "path"}, steering=sign * STEERING)
    assert lens.yaw == pytest.approx(sign * (SLIP + YAW_RATE / 2))
    limited = posed({"gaze": "path"}, steering=sign * STEERING, speed=40.0)
    assert limited.yaw == pytest.approx(sign * radians(40))  # 0.1 + 1.0 rad
    assert posed(steering=STEERING).yaw == 0.0


def test_earlier_pose_is_on_the_same_circle():
    ago = 0.5
    lens = posed({"setback_m": 2.0, "left_m": 0.0}, ago, heading=0.3, steering=STEERING)
    course = 0.3 + SLIP - YAW_RATE * ago / 2
    assert (lens.x, lens.y) == pytest.approx((-5 * cos(course), -5 * sin(course)))
    assert lens.yaw == pytest.approx(0.3 - YAW_RATE * ago)


@pytest.mark.parametrize(
    ("acceleration", "clipped"), [(-6.0, -6.0), (-12.0, -12.0), (-15.0, -12.0), (4.0, 4.0), (9.0, 6.0)]
)
def test_body_dives_in_proportion_to_the_deceleration(acceleration, clipped):
    lens = posed({"dive_deg": 0.25, "pitch_deg": 1.0}, acceleration=acceleration)
    assert lens.pitch == pytest.approx(radians(1.0 + 0.25 * clipped))


def moved(shake, seed=3, time_s=1.5, stabiliser=None):
    """Return yaw, pitch, roll and height of a lens on a rough road, posed with a given `SHAKE` record."""
    camera, scene = rig(road="rough", seed=seed, stabiliser=stabiliser)
    mount = mount_of(camera, scene).view(np.recarray)[()]
    lens = record(LENS)
    pose_lens(mount, record(SCENE, length=4.0, speed=10.0, time_s=time_s), 0.0, shake, lens)
    return lens.yaw, lens.pitch, lens.roll, lens.z


@pytest.mark.parametrize("change", [{"seed": 4}, {"time_s": 1.6}, {"stabiliser": "gyroscope"}])
def test_motion_of_the_body_is_kept_for_one_time_of_one_car(change):
    shake = record(SHAKE, time_s=nan)
    first, other, again = moved(shake), moved(shake, **change), moved(shake)
    assert first == again == moved(record(SHAKE, time_s=nan))
    assert other == moved(record(SHAKE, time_s=nan), **change)
    assert all(a != b for a, b in zip(first[:3], other[:3], strict=True))
    shake.pitch += 1.0
    assert moved(shake)[1] != first[1]  # that of the record is used
