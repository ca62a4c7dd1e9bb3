"""`SceneTable`: egos and objects as records, and the objects that are left out."""

import copy

import numpy as np
from support.cameras import ego_camera, rig
from support.roads import add_car, straight_env

from lgmd_gym.camera import Scene
from lgmd_gym.camera.scene_table import SceneTable, sector_of


def read(env, *cameras):
    """Return the x of the objects that are read for these cameras."""
    world = SceneTable()
    world.read(env, sector_of([item.camera for item in cameras], Scene()))
    return world.objects["x"][0, : world.object_counts[0]].tolist()


def test_objects_behind_all_lenses_and_far_away_are_left_out():
    env = straight_env()
    for x in (-50.0, 40.0, 660.0, 800.0):
        add_car(env, x, 3.5)
    ahead, back = rig(), rig(yaw_deg=180.0)
    assert read(env, ahead) == [40.0, 660.0]
    assert read(env, back) == [-50.0]
    assert read(env, ahead, back) == [-50.0, 40.0, 660.0]
    assert read(env, rig(yaw_deg=60.0), rig(yaw_deg=-60.0)) == [40.0, 660.0]
    assert read(env) == [-50.0, 40.0, 660.0]


def test_no_object_that_is_left_out_would_be_in_the_frame():
    rng = np.random.default_rng(0)
    for heading in rng.uniform(-3.0, 3.0, 8):
        env = straight_env(heading=heading)
        for x, y in rng.uniform(-30.0, 30.0, (12, 2)):
            add_car(env, x, y, heading=rng.uniform(-3.0, 3.0))
        env.vehicle.action = {"steering": rng.uniform(-0.5, 0.5), "acceleration": 0.0}
        for yaw_deg, gaze in ((0.0, "path"), (75.0, "fixed"), (-140.0, "fixed")):
            camera = ego_camera(hfov_deg=150.0, yaw_deg=yaw_deg, gaze=gaze, shape=(40, 100), road="rough")
            frame = camera.render(env)
            camera._stage._sector = None  # read all objects
            np.testing.assert_array_equal(camera.render(env), frame)
        camera = ego_camera(gaze="stopping", offset_m=8.0, span_m=9.0, lift=-0.6, road="rough")
        frame = camera.render(env)
        camera._stage._sector = None
        np.testing.assert_array_equal(camera.render(env), frame)


def test_copies_read_into_their_own_records():
    env = straight_env(x=5.0)
    add_car(env, 30.0, 0.0)
    world = SceneTable(2)
    world.read(env, None, 1)
    clone = copy.deepcopy(world)
    env.vehicle.position[0] = 9.0
    clone.read(env, None, 1)
    assert (world.scenes["x"][1], clone.scenes["x"][1], clone.bundle.arrays[0]["x"][1]) == (5.0, 9.0, 9.0)


def test_cameras_that_may_see_the_ground_right_below_them_look_all_around():
    """With a row to spare, the lower side of these frames is straight down at a pitch of 15.1°."""
    camera = rig(shape=(60, 20), hfov_deg=100.0)
    assert sector_of([rig(camera, pitch_deg=-15.0).camera], Scene()) is not None
    for fields in ({"pitch_deg": -15.3}, {"pitch_deg": 15.3}, {"dive_deg": 0.1}, {"road": "smooth"}):
        changed = rig(camera, **{"pitch_deg": -15.0, **fields})
        assert sector_of([rig(shape=(60, 20)).camera, changed.camera], changed.scene) is None
