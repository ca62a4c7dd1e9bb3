"""Worlds: drawn from their number alone, different from each other, and lit as their fields state."""

import subprocess
import sys
from dataclasses import astuple, fields

import numpy as np
import pytest
from support.cameras import ego_camera, rig
from support.records import lens_of, record
from support.roads import add_car, box_record, set_roadside, straight_env

from lgmd_gym.camera import WEATHERS, Scene, Weather
from lgmd_gym.camera.effects import LOOK, in_scene, look_of, sun_of
from lgmd_gym.camera.objects import MODEL_BEAM, MODEL_CROWN, MODEL_DECK, OBJECT
from lgmd_gym.camera.pinhole import project
from lgmd_gym.camera.render.light import add_sun_glare
from lgmd_gym.camera.worlds import ASPHALTS, SPLIT_WORLDS, VERGES, WORLDS, World, draw_world

MANY = [draw_world(number) for number in range(400)]


def look_in(p):
    """Return the appearance for a camera in its scene."""
    return look_of(in_scene(*p), p.scene)


def test_splits_divide_all_worlds():
    numbers = [number for worlds in SPLIT_WORLDS.values() for number in worlds]
    assert sorted(numbers) == list(range(WORLDS))


def test_a_world_is_the_same_in_every_process():
    code = "from lgmd_gym.camera.worlds import draw_world; print([draw_world(n) for n in (0, 17, 9999)])"
    output = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert output.strip() == str([draw_world(number) for number in (0, 17, 9999)])


def test_worlds_differ_in_every_field():
    for field in fields(World):
        values = {str(getattr(world, field.name)) for world in MANY}
        assert len(values) > 1, field.name
    assert {world.asphalt[0] for world in MANY} == set(ASPHALTS)
    assert {world.verge[0] for world in MANY} == set(VERGES)


def test_the_laboratory_is_no_number():
    laboratory = draw_world(None)
    assert not laboratory.drawn
    assert laboratory == World()
    assert all(world.drawn and astuple(world) != astuple(laboratory) for world in MANY)


@pytest.mark.parametrize("world", [-1, WORLDS, 2.5, "lab", True])
def test_unknown_worlds_are_refused(world):
    with pytest.raises(ValueError, match="world"):
        Scene(world=world)


def test_a_frame_depends_on_the_world_only():
    env = straight_env(lanes=2, x=40.0)
    add_car(env, 60.0, 0.0)
    frames = [
        ego_camera("wide", world=number, seed=seed).render(env) for number, seed in ((3, 0), (3, 5), (4, 0))
    ]
    np.testing.assert_array_equal(frames[0], frames[1])
    assert np.mean(frames[0] != frames[2]) > 0.5


@pytest.mark.parametrize("condition", [*WEATHERS])
def test_every_condition_is_drawn_in_every_kind_of_world(condition):
    env = straight_env(lanes=2, x=40.0, speed=14.0)
    add_car(env, 65.0, 0.0)
    frames = [
        ego_camera("wide", world=number, weather=condition, road="rough").render(env) for number in range(8)
    ]
    assert len({frame.tobytes() for frame in frames}) == 8
    for frame in frames:
        assert frame.std() > 1.0


def test_the_sun_has_the_direction_of_the_world():
    for number, world in enumerate(MANY[:40]):
        look = look_in(rig(world=number))
        azimuth = np.degrees(np.arctan2(look["sun_y"], look["sun_x"])) % 360.0
        assert azimuth == pytest.approx(world.sun_azimuth_deg)
        assert np.degrees(np.arcsin(look["sun_z"])) == pytest.approx(world.sun_elevation_deg)
        azimuth, elevation, _ = sun_of(Weather(light="low_sun"), world)
        assert abs(np.degrees(azimuth)) <= 25.0
        assert 4.0 <= np.degrees(elevation) <= 12.0


def test_a_car_casts_its_shadow_away_from_the_sun():
    """With the sun on the left of a car, the road is darker on its right than on its left."""
    found = 0
    for number, world in enumerate(MANY[:60]):
        azimuth = world.sun_azimuth_deg
        # World y is to the right: a sun at an azimuth of 270° is on the left.
        if world.sun_share < 0.5 or abs((azimuth % 180.0) - 90.0) > 30.0 or world.sun_elevation_deg > 50.0:
            continue
        sides = []
        for lateral in (-2.2, 2.2):
            env = straight_env(lanes=3, x=40.0, y=4.0)
            camera = ego_camera("wide", world=number, roadside=0.0, texture=0.0)
            camera.render(env)
            bare = camera.light.copy()
            add_car(env, 60.0, 4.0)
            camera.render(env)
            u, v = camera.project([60.0, 4.0 + np.sign(lateral) * 1.25, 0.0])
            row, column = int(v), int(u)
            sides.append(camera.light[row, column] / bare[row, column])
        left, right = sides
        assert (right < left) == (azimuth > 180.0), number
        assert min(sides) < 1.0 - 0.5 * world.sun_share
        found += 1
    assert found >= 3


def test_no_cast_shadow_without_the_sun():
    for condition in ("night", "fog", "rain"):
        for number in range(20):
            assert look_in(rig("wide", world=number, weather=condition))["cast"] == 0.0
    overcast = [number for number, world in enumerate(MANY) if world.sun_share == 0.0]
    assert 0.3 < len(overcast) / len(MANY) < 0.5


def test_the_under_body_shadow_is_as_dark_as_measured_and_graded():
    """Display-coded, real roads have 0.49 to 0.58 of their grey below a car, graded over some 8 px."""
    env = straight_env(lanes=1, x=40.0)
    number = next(number for number, world in enumerate(MANY) if world.sun_share == 0.0)
    camera = ego_camera("fovea", world=number, texture=0.0, roadside=0.0, shape=(180, 320), pitch_deg=-5.0)
    camera.render(env)
    bare = camera.light.copy()
    add_car(env, 56.0, 0.0)
    camera.render(env)
    rear = 56.0 - 0.5 * env.road.vehicles[-1].LENGTH
    behind = [(rear - away, 0.0, 0.0) for away in np.linspace(1.0, 0.02, 25)]
    below = [(rear, 0.0, height) for height in (0.05, 0.1)]
    column, row = camera.project(behind + below).astype(int).T
    ratio = np.sqrt(camera.light[row, column] / bare[row, column])
    assert ratio[0] == pytest.approx(1.0, abs=0.01)
    assert 0.4 < ratio.min() < 0.65
    assert ratio[-1] == pytest.approx(ratio.min(), abs=0.05)
    assert (np.diff(ratio[:25]) < 0.01).all()
    assert len(np.unique(np.round(ratio, 2))) >= 4  # no hard edge


def test_the_mount_has_the_errors_of_the_world():
    env = straight_env(x=40.0)
    camera, exact = ego_camera("fovea", world=5), ego_camera("fovea")
    camera.render(env)
    exact.render(env)
    world, lens, plain = draw_world(5), camera._lens, exact._lens
    assert lens["z"] - plain["z"] == pytest.approx(world.mount_height_error)
    assert np.degrees(lens["yaw"] - plain["yaw"]) == pytest.approx(world.yaw_error_deg)
    assert np.degrees(lens["pitch"] - plain["pitch"]) == pytest.approx(world.pitch_error_deg)
    camera.render(env, gaze=(2.0, 0.0))
    assert np.degrees(camera._lens["yaw"]) == pytest.approx(world.yaw_error_deg + 2.0)


@pytest.mark.parametrize("number", [1618, 1790, 5702])
def test_frames_do_not_depend_on_frames_drawn_before(number):
    """The scratch memory is clear after each frame, also where details of trees protrude from them."""
    env, camera = straight_env(lanes=2), ego_camera("fovea", world=number, road="rough")
    for step in range(60):
        env.steps = step
        env.vehicle.position[0] = 1.5 * step
        camera.render(env)
        assert not camera.buffers.solids.any()
        assert not camera.buffers.ground.any()


@pytest.mark.parametrize("roll", [0.0, 0.3, -0.3])
def test_the_glare_is_brightest_in_the_direction_of_the_sun(roll):
    lens = lens_of(0.1, 0.05, roll=roll, shape=(81, 121))
    azimuth, elevation = 0.25, 0.15
    level = np.cos(elevation)
    sun = level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)
    look = record(LOOK, glare=500.0, **dict(zip(("sun_x", "sun_y", "sun_z"), sun, strict=True)))
    image = np.zeros((81, 121), np.float32)
    add_sun_glare(image, lens, look)
    u, v = project(lens, 1e6 * np.array(sun))
    row, column = np.unravel_index(image.argmax(), image.shape)
    assert (column + 0.5, row + 0.5) == pytest.approx((u, v), abs=0.71)


@pytest.mark.parametrize(("model", "shaded"), [(MODEL_BEAM, False), (MODEL_CROWN, False), (MODEL_DECK, True)])
def test_only_bridges_overhead_have_a_soft_shadow(model, shaded):
    params = rig(shape=(90, 160), world=1)  # overcast
    env = straight_env(lanes=1)
    set_roadside(env, params, np.zeros(0, OBJECT))
    camera = ego_camera(params)
    camera.render(env)
    bare = camera.light[70:].copy()
    x, y = env.vehicle.position
    record_above = box_record(x + 9.0, y, (8.0, 4.0, 6.0), model=model, base=5.0)
    set_roadside(env, params, record_above)
    camera = ego_camera(params)
    camera.render(env)
    assert bool((camera.light[70:] < 0.9 * bare).any()) is shaded
