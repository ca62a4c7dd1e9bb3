import math

import numpy as np
import pytest
from support.cameras import ego_camera, rig
from support.roads import EGO_LENGTH, add_car, lens_x, straight_env

from lgmd_gym.camera import EgoCamera
from lgmd_gym.camera.render.texture import distance_ahead

PLAIN = {"texture": 0.0, "roadside": 0.0, "vehicles": "box"}


def changed(camera, env, car):
    """Return the bounds (top, bottom, left, right) of the pixels that the car changes."""
    with_car = camera.render(env)
    env.road.vehicles.remove(car)
    without = camera.render(env)
    env.road.vehicles.append(car)
    diff = np.abs(with_car.astype(int) - without) > 12
    rows = np.flatnonzero(diff.any(axis=1))
    # Left and right above the horizon: below it the shadow is wider than the car.
    cols = np.flatnonzero(diff[: diff.shape[0] // 2].any(axis=0))
    return rows[0], rows[-1] + 1, cols[0], cols[-1] + 1


@pytest.mark.parametrize("shape", [(90, 160), (160, 90), (61, 200)])
@pytest.mark.parametrize("gap", [8.0, 20.0])
def test_box_covers_the_pixels_of_its_projection(shape, gap):
    env = straight_env(line_types=False)
    camera = ego_camera("standard", shape=shape, **PLAIN)
    # Dark, and higher than the lens, so that its rear face alone sets left, right and top.
    car = add_car(env, lens_x(env) + gap + 2.0, 3.5, shade=10, size=(4.0, 1.8, 1.6))
    top, bottom, left, right = changed(camera, env, car)
    f = 0.5 * shape[1] / math.tan(math.radians(20.0))
    # By hand: rear face at `gap` metres, 1.8 m wide, from 1.2 m below to 0.4 m above the lens.
    assert left == pytest.approx(shape[1] / 2 - f * 0.9 / gap, abs=1.0)
    assert right == pytest.approx(shape[1] / 2 + f * 0.9 / gap, abs=1.0)
    assert top == pytest.approx(max(shape[0] / 2 - f * 0.4 / gap, 0), abs=1.0)
    assert bottom >= min(shape[0] / 2 + f * 1.2 / gap, shape[0]) - 1.0
    corners = camera.project([[lens_x(env) + gap, 3.5 + side * 0.9, 1.6] for side in (-1, 1)])
    assert corners[0] == pytest.approx((shape[1] / 2 - f * 0.9 / gap, shape[0] / 2 - f * 0.4 / gap))
    assert corners[1, 0] == pytest.approx(shape[1] / 2 + f * 0.9 / gap)


def test_larger_y_is_on_the_right():
    env = straight_env()
    camera = ego_camera("wide", **PLAIN)
    car = add_car(env, 25.0, 3.5 + 3.5, shade=10)
    _, _, left, _ = changed(camera, env, car)
    assert left > 80
    car.position[1] = 0.0
    _, _, _, right = changed(camera, env, car)
    assert right < 80


@pytest.mark.parametrize("heading", [0.0, 0.7, math.pi / 2, -2.0, math.pi])
def test_straight_ahead_is_the_middle_for_any_heading(heading):
    env = straight_env(heading=heading, x=100.0, line_types=False)
    ahead = env.vehicle.position + 30.0 * np.array([math.cos(heading), math.sin(heading)])
    car = add_car(env, *ahead, shade=10, heading=heading)
    camera = ego_camera("standard", **PLAIN)
    _, _, left, right = changed(camera, env, car)
    assert (left + right) / 2 == pytest.approx(80.0, abs=1.0)
    u, v = camera.project([*ahead, 1.2])
    assert (u, v) == pytest.approx((80.0, 45.0))


def test_mount_is_behind_the_front_bumper():
    env = straight_env()
    camera = ego_camera("wide", setback_m=0.5, left_m=0.4, height_m=1.5)
    camera.render(env)
    lens = np.array([EGO_LENGTH / 2 - 0.5, 3.5 - 0.4, 1.5])
    assert camera.project(lens + np.array([10.0, 0.0, 0.0])) == pytest.approx((80.0, 45.0))
    # Ten metres ahead, one to the right and one up: f/10 = 13.86 px.
    assert camera.project(lens + np.array([10.0, 1.0, 1.0])) == pytest.approx(
        (80 + 13.856, 45 - 13.856), abs=1e-3
    )


@pytest.mark.parametrize("pitch", [-8.0, 0.0, 5.0])
def test_pitch_moves_the_horizon(pitch):
    env = straight_env(line_types=False)
    camera = ego_camera("wide", pitch_deg=pitch, **PLAIN)
    frame = camera.render(env)
    v = 45 + 80 / math.tan(math.radians(30)) * math.tan(math.radians(pitch))
    far = camera.project([1e7, 3.5, 0.0])
    assert far[1] == pytest.approx(v, abs=0.01)
    # Asphalt below the horizon; skyline and sky have other greys.
    assert np.all(np.abs(frame[math.ceil(v) + 2 :, 80].astype(int) - 104) <= 1)
    assert np.all(frame[: math.floor(v) - 8, 80] > 150)


def test_yaw_and_gaze_turn_the_picture():
    env = straight_env()
    camera = ego_camera("wide", yaw_deg=10.0, **PLAIN)
    point = [lens_x(env) + 20.0, 3.5, 1.2]
    camera.render(env)
    shift = camera.camera.focal_px * math.tan(math.radians(10.0))
    assert camera.project(point)[0] == pytest.approx(80.0 - shift)
    camera.render(env, gaze=(-10.0, 5.0))
    rise = camera.camera.focal_px * math.tan(math.radians(5.0))
    assert camera.project(point) == pytest.approx((80.0, 45.0 + rise))


def test_path_gaze_turns_towards_the_curve():
    env = straight_env()
    point = [lens_x(env) + 20.0, 3.5, 1.2]
    camera = ego_camera("wide", gaze="path")
    camera.render(env)
    assert camera.project(point)[0] == pytest.approx(80.0)
    env.vehicle.action = {"steering": 0.05, "acceleration": 0.0}  # to the right
    camera.render(env)
    assert camera.project(point)[0] < 75.0


@pytest.mark.parametrize("distance_m", [0.5, 60.0])
def test_corners_project_to_the_corners_of_the_frame(distance_m):
    env = straight_env()
    camera = EgoCamera("wide", {"road": "rough"}, mount={"pitch_deg": -4.0, "yaw_deg": 15.0})
    height, width = camera.shape
    with pytest.raises(ValueError, match="no frame yet"):
        camera.corners(distance_m)
    camera.render(env)
    expected = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]]
    assert camera.project(camera.corners(distance_m)) == pytest.approx(np.array(expected))
    with pytest.raises(ValueError, match="distance_m must be"):
        camera.corners(0.0)


def test_point_behind_the_lens_projects_to_nan():
    env = straight_env()
    camera = ego_camera("wide")
    camera.render(env)
    assert np.isnan(camera.project([[-5.0, 3.5, 0.0]])).all()
    with pytest.raises(ValueError, match="render"):
        ego_camera("wide").project([1.0, 2.0, 3.0])


@pytest.mark.parametrize("pitch_deg", [-5.0, 0.0, 5.0])
def test_distance_of_a_ground_row_agrees_with_projection(pitch_deg):
    env = straight_env(x=3.0, y=1.0)
    camera = ego_camera("wide", pitch_deg=pitch_deg)
    camera.render(env)
    for row in (65, 75, 89):
        ahead = distance_ahead(camera._lens, row)
        assert camera.project([lens_x(env) + ahead, 1.0, 0.0]) == pytest.approx((80.0, row + 0.5))
    if pitch_deg == 0.0:
        assert distance_ahead(camera._lens, 60) == pytest.approx(1.2 * 138.564 / 15.5)


def test_out_is_filled_and_checked():
    env = straight_env()
    camera = ego_camera(rig(shape=(40, 60)))
    out = np.zeros((40, 60), np.uint8)
    assert camera.render(env, out) is out
    assert out.std() > 5
    for bad in (np.zeros((60, 40), np.uint8), np.zeros((40, 60), np.float32)):
        with pytest.raises(ValueError, match="out must be"):
            camera.render(env, bad)
