"""The own car's bonnet at the bottom of the frame."""

import gymnasium as gym
import numpy as np
import pytest
from support.roads import add_car, straight_env

import lgmd_gym  # noqa: F401
from lgmd_gym.camera import CameraParams, EgoCamera

PLAIN = {"roadside": 0.0, "texture": 0.0}


def bonnet_of(camera, env):
    """Return the light of a camera with a bonnet and that of the same one without."""
    plain = EgoCamera(camera.params, bonnet=False)
    camera.render(env)
    plain.render(env)
    return camera.light.copy(), plain.light.copy()


def edge_slope(tangent, height=1.2, setback=1.7, left=0.0):
    """Return the least fall of the rays to points of the bonnet, found by trying points."""
    ahead = np.linspace(setback - 1.0, setback, 200_001)
    across = tangent * ahead - left
    along = (ahead - (setback - 1.0)) / 1.0
    surface = 0.95 - 0.2 * along**2 - 0.1 * (across / 0.8) ** 2
    return np.min(np.where(np.abs(across) <= 0.8, (height - surface) / ahead, np.inf))


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"mount_height": 1.25, "mount_setback": 1.5, "pitch_deg": -4.0},
        {"mount_left": 0.4, "hfov_deg": 90.0},
        {"mount_height": 1.3, "mount_setback": 1.3},  # the edge is that of the front
    ],
)
def test_the_upper_edge_is_the_least_fall_to_the_surface(fields):
    camera = EgoCamera("paper", bonnet=True, **PLAIN, **fields)
    light, plain = bonnet_of(camera, straight_env())
    p, f = camera.params, camera.params.focal_px
    found = 0
    for column in range(0, 352, 25):
        tangent = (column + 0.5 - 176.0) / f
        slope = edge_slope(tangent, p.mount_height, p.mount_setback, p.mount_left)
        edge = 144.0 + f * np.tan(np.arctan(slope) + np.radians(p.pitch_deg))
        if edge < 284.0:
            changed = np.flatnonzero(np.abs(light - plain)[:, column] > 0.05)
            assert changed[0] == pytest.approx(edge, abs=1.5), column
            found += 1
    assert found >= 8


def test_the_bonnet_covers_the_lowest_rows_of_wide_and_none_of_the_narrow_lenses():
    env = straight_env()
    light, plain = bonnet_of(EgoCamera("wide", bonnet=True), env)
    assert np.array_equal(light[:79], plain[:79])
    assert (light[79:] != plain[79:]).any(axis=1).all()
    assert (light[89] != plain[89]).all()
    for name in ("standard", "tele", "fovea"):
        assert np.array_equal(*bonnet_of(EgoCamera(name, bonnet=True), env)), name


def test_the_bonnet_is_lightest_at_its_edge_and_dark_at_night():
    env = straight_env()
    light, _ = bonnet_of(EgoCamera("paper", bonnet=True, seed=3), env)
    middle = light[144 + int(np.ceil(305.0 * edge_slope(0.0))) + 2 : 144 + int(305.0 * 0.35), 176]
    assert len(middle) > 20
    assert np.all(np.diff(middle) < 0.0)
    night, _ = bonnet_of(EgoCamera("paper", bonnet=True, seed=3, light="night"), env)
    assert night[225:, 176].max() < 0.2 * light[225:, 176].max()


def test_neither_road_nor_braking_nor_time_moves_the_bonnet():
    frames = []
    for steps in (0, 17, 40):
        env = straight_env(speed=30.0)
        env.steps, env.vehicle.action = steps, {"acceleration": -0.2 * steps, "steering": 0.0}
        add_car(env, 20.0 + steps, 3.5)
        camera = EgoCamera("paper", bonnet=True, road="rough", dive_deg=0.2, shutter_s=0.03, **PLAIN)
        light, plain = bonnet_of(camera, env)
        frames.append(light[-50:])
        assert not np.array_equal(light[:200], frames[0][:200])
        assert np.array_equal(light[:200], plain[:200])
    # Below the edge in every column.
    assert np.allclose(frames[0], frames[1], atol=1e-3)
    assert np.allclose(frames[0], frames[2], atol=1e-3)


def rows_of_bonnet(light, plain, column):
    return int(np.sum(np.abs(light - plain)[:, column] > 0.05))


def test_the_angles_of_the_mount_move_the_bonnet():
    env = straight_env()
    straight = bonnet_of(EgoCamera("wide", bonnet=True), env)
    down = bonnet_of(EgoCamera("wide", bonnet=True, pitch_deg=-5.0), env)
    # 5 degrees are 12 px in the middle, and 13 px where the edge is.
    assert rows_of_bonnet(*down, 80) - rows_of_bonnet(*straight, 80) in (12, 13)
    right = bonnet_of(EgoCamera("wide", bonnet=True, yaw_deg=12.0), env)
    assert rows_of_bonnet(*right, 40) > rows_of_bonnet(*straight, 40)
    assert rows_of_bonnet(*right, 120) < rows_of_bonnet(*straight, 120)
    env.vehicle.action = {"steering": 0.1, "acceleration": 0.0}
    path = bonnet_of(EgoCamera("wide", bonnet=True, gaze="path"), env)
    assert rows_of_bonnet(*path, 40) > rows_of_bonnet(*straight, 40)
    assert rows_of_bonnet(*path, 120) < rows_of_bonnet(*straight, 120)


def test_a_turned_gaze_moves_the_bonnet_for_one_frame():
    env = straight_env()
    camera = EgoCamera("wide", bonnet=True)
    first = camera.render(env)
    turned = camera.render(env, gaze=(0.0, -10.0))
    assert not np.array_equal(turned[-20:], first[-20:])
    assert np.array_equal(camera.render(env), first)


def test_a_lens_to_the_rear_has_no_bonnet():
    light, plain = bonnet_of(EgoCamera("wide", bonnet=True, yaw_deg=180.0), straight_env())
    assert np.array_equal(light, plain)


def test_an_environment_has_the_bonnet_of_its_camera():
    frames = []
    for bonnet in (False, True):
        camera = {"name": "wide", "bonnet": bonnet, "windscreen": 0.05 * bonnet}
        env = gym.make("LGMD/CCRs-v0", camera=camera, include_frame=True, world="laboratory")
        observation, _ = env.reset(seed=1)
        frames.append(observation["frame"])
        env.close()
    assert (frames[0] != frames[1])[79:].mean() > 0.9


@pytest.mark.parametrize(
    ("field", "value", "limit"),
    [
        ("mount_height", 1.0, "at least 1.1 m"),
        ("mount_setback", 0.0, "at least 1.2 m"),
        ("mount_left", -0.8, "at most 0.7 m to either side"),
    ],
)
def test_a_lens_outside_the_car_is_refused(field, value, limit):
    assert getattr(CameraParams(**{field: value}), field) == value
    with pytest.raises(ValueError, match=f"camera {field} must be {limit} with bonnet=True, got {value}"):
        CameraParams(bonnet=True, **{field: value})
