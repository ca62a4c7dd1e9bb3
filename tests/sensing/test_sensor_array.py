"""`SensorArray`: batches of cameras and neurons equal single cameras and neurons to the bit."""

import copy
import pickle
import threading

import numpy as np
import pytest
from support.golden_frames import busy_road, curve
from support.roads import add_car, straight_env

from lgmd_gym import LGMD, BirdsEye, CameraParams, EgoCamera, LGMDParams
from lgmd_gym.camera import CONDITIONS
from lgmd_gym.camera.objects import OBJECT
from lgmd_gym.neuron import DSN, LPLC2, SustainedEdges
from lgmd_gym.sensing.sensor_array import SensorArray

SMALL = {"shape": (45, 80)}
CAMERAS = [
    CameraParams.preset("wide", **SMALL),
    {"name": "small", "shape": (30, 40), "yaw_deg": 20.0, "seed": 3},
    CameraParams.preset("fovea", **SMALL, guard_rail=True),
    {"name": "back", "shape": (30, 40), "yaw_deg": 180.0, "vehicles": "box"},
    {"name": "path", "shape": (45, 80), "gaze": "path", "panorama": "natural", "mount_left": 0.4},
    {"name": "driver", "shape": (45, 80), "gaze": "path", "guard_rail": True},
    {"name": "back edges", "shape": (30, 40), "yaw_deg": 180.0, "vehicles": "box", "detector": "edges"},
    {"name": "columns", "shape": (30, 40), "yaw_deg": 20.0, "seed": 3, "columns": 4},
    {"name": "flow columns", "shape": (30, 40), "yaw_deg": 20.0, "detector": "dsn", "columns": 2},
    {"name": "side", "shape": (45, 80), "yaw_deg": 30.0, "detector": "lplc2"},
    {"name": "derotated", "shape": (30, 40), "derotated": True, "columns": 4},
    {"name": "derotated path", "shape": (45, 80), "gaze": "path", "derotated": True},
    {"name": "derotated flow", "shape": (30, 40), "derotated": True, "detector": "dsn", "columns": 4},
    {"name": "derotated edges", "shape": (30, 40), "derotated": True, "detector": "edges"},
    {"name": "derotated side", "shape": (45, 80), "derotated": True, "detector": "lplc2"},
    {"name": "small flow", "shape": (30, 40), "yaw_deg": 20.0, "seed": 3, "detector": "dsn"},
    {"name": "back flow", "shape": (30, 40), "yaw_deg": 180.0, "vehicles": "box", "detector": "dsn"},
]
MODELS = {"lgmd": LGMD, "lplc2": LPLC2, "dsn": DSN, "edges": SustainedEdges}
FIELDS = [
    {},
    {"condition": "night", "texture": 0.7, "visibility_m": 40.0},
    {"condition": "rain", "texture": 1.4, "auto_exposure_s": 0.2},
    {"condition": "fog", "seed": 5, "roadside": 2.0, "linear_light": True},
    {"condition": "low_sun", "world": 11, "road": "rough"},
    {"condition": "night_upper_beam", "world": 12},
]


def scenes():
    """Return environments with different roads, egos and traffic."""
    empty = straight_env(lanes=2, speed=5.0)
    return [busy_road(), curve(), empty, busy_road(), busy_road(), curve()]


def move(envs, step):
    for k, env in enumerate(envs):
        env.steps = step
        env.vehicle.position[0] += 0.3 * (k + 1)
        env.vehicle.heading += 0.01 * k
        env.vehicle.action = {"steering": 0.02 * k, "acceleration": -1.5 * k}
        for car in env.road.vehicles:
            if car is not env.vehicle:
                car.position[0] += 0.02 * step


def make_array(camera=CAMERAS, num_envs=6, **arguments):
    sensors = SensorArray(camera, 30.0, LGMDParams(), num_envs, **arguments)
    for index in range(num_envs):
        sensors.set_camera_fields(index, FIELDS[index])
    return sensors


def reference(camera, fields):
    """Return a camera and a neuron of their own."""
    own = EgoCamera(CameraParams.make(camera), **fields)
    return own, MODELS[own.params.detector](own.shape, 30.0)


def column_potentials(p, neuron):
    return neuron.column_potentials(p.columns) if p.columns else []


@pytest.mark.parametrize("threads", [None, 3])
def test_frames_and_outputs_equal_those_of_single_cameras_and_neurons(threads):
    envs, sensors = scenes(), make_array(threads=threads)
    singles = [[reference(camera, fields) for camera in CAMERAS] for fields in FIELDS]
    turns = dict.fromkeys(range(len(CAMERAS)), 0)
    for step in range(6):
        move(envs, step)
        for index, env in enumerate(envs):
            sensors.read(env, index)
        sensors.step()
        for index, env in enumerate(envs):
            for k, (camera, neuron) in enumerate(singles[index]):
                before = camera.yaw_px
                frame = camera.render(env)
                np.testing.assert_array_equal(sensors.frame_of(k, index), frame)
                turns[k] += abs(camera.yaw_px - before) if step else 0
                expected = neuron.step(frame, turn_px=camera.yaw_px - before)
                assert [field[index, k].item() for field in sensors.responses] == list(expected)
            expected = [column_potentials(camera.params, neuron) for camera, neuron in singles[index]]
            np.testing.assert_array_equal(sensors.column_potentials()[index], np.concatenate(expected))
    assert [name for k, name in enumerate(sensors.names) if turns[k]] == [
        name for name in sensors.names if name.startswith("derotated")
    ]
    assert sensors.responses.spikes.dtype == np.int64
    assert sensors.responses.alert.dtype == np.bool_


def test_fields_of_the_next_road_need_not_fit_the_last_one():
    """A level on two lanes, and then one with a queue on the third lane."""
    sensors = SensorArray("wide", 30.0, LGMDParams(), 1)
    narrow, broad = straight_env(lanes=2), straight_env(lanes=3)
    for env, lane in ((broad, 2), (narrow, 1), (broad, 2)):
        fields = {"world": 8002, "queue_lane": lane}
        sensors.set_camera_fields(0, fields)
        sensors.set_road(0, env.road)
        sensors.read(env, 0)
        sensors.process(0, 1)
        np.testing.assert_array_equal(sensors.frame_of(0, 0), EgoCamera("wide", **fields).render(env))


def test_camera_fields_change_at_any_time():
    envs, sensors = scenes(), make_array()
    for step in range(8):
        move(envs, step)
        for index, env in enumerate(envs):
            # Without the automatic exposure, which follows the frames before.
            fields = FIELDS[(index + step // 2) % 4] | {"auto_exposure_s": 0.0}
            sensors.set_camera_fields(index, fields)
            sensors.read(env, index)
            sensors.process(index, index + 1)
            for k, camera in enumerate(CAMERAS):
                own = EgoCamera(CameraParams.make(camera), **fields)
                np.testing.assert_array_equal(sensors.frame_of(k, index), own.render(env))
                assert sensors.cameras[index][sensors.names[k]].params == own.params
                point = [30.0, 2.0, 0.5]
                projected = sensors.cameras[index][sensors.names[k]].project(point)
                np.testing.assert_array_equal(projected, own.project(point))


def test_inactive_environments_keep_frames_and_outputs():
    envs, sensors = scenes(), make_array("wide")
    for step in range(4):
        move(envs, step)
        for index, env in enumerate(envs):
            sensors.read(env, index)
        sensors.step()
    before = copy.deepcopy((sensors.frames, sensors.responses))
    move(envs, 5)
    for index, env in enumerate(envs):
        sensors.read(env, index)
    active = np.array([True, False, True, True, False, False])
    sensors.process(0, 3, active)
    changed = [not np.array_equal(sensors.frames[0][k], before[0][0][k]) for k in range(len(FIELDS))]
    assert changed == [True, False, True, False, False, False]
    for new, old in zip(sensors.responses, before[1], strict=True):
        np.testing.assert_array_equal(new[[1, 3]], old[[1, 3]])
    assert (sensors.responses.ffi != before[1].ffi)[[0, 2]].all()


def test_detectors_on_the_same_views_share_frames_until_a_camera_pauses():
    """A camera that pauses keeps the exposure of its last frame, while its twin adapts further."""
    lgmds, dsns = [CAMERAS[1], CAMERAS[3]], CAMERAS[-2:]
    envs, together = scenes(), make_array([*lgmds, *dsns])
    apart = make_array(lgmds), make_array(dsns)
    assert together.frames[0] is together.frames[1]
    for step in range(9):
        move(envs, step)
        together.enabled[1:3, 0] = apart[0].enabled[1:3, 0] = not 4 <= step < 7
        for sensors in (together, *apart):
            for index, env in enumerate(envs):
                sensors.read(env, index)
            sensors.step()
        for camera in range(4):
            own = apart[camera // 2]
            for index in range(len(envs)):
                frame = own.frame_of(camera % 2, index)
                np.testing.assert_array_equal(together.frame_of(camera, index), frame)
                expected = own.response_of(index).membrane_potential[camera % 2]
                assert together.response_of(index).membrane_potential[camera] == expected
    assert together.frames[0] is not together.frames[1]


def test_a_disabled_camera_pauses_and_starts_anew():
    env = busy_road()
    sensors = make_array(num_envs=1)
    own, neuron = reference(CAMERAS[2], {})
    for step in range(12):
        move([env], step)
        sensors.enabled[0, 2] = not 4 <= step < 8
        sensors.read(env)
        kept = [field[0, 2].item() for field in sensors.responses], sensors.frame_of(2).copy()
        sensors.process(0, 1)
        if sensors.enabled[0, 2]:
            frame = own.render(env)
            if step == 8:
                neuron.reset()
            np.testing.assert_array_equal(sensors.frame_of(2), frame)
            kept = list(neuron.step(frame)), frame
        assert [field[0, 2].item() for field in sensors.responses] == kept[0]
        np.testing.assert_array_equal(sensors.frame_of(2), kept[1])
        np.testing.assert_array_equal(sensors.frame_of(0), EgoCamera(CAMERAS[0]).render(env))


def test_reset_returns_selected_neurons_to_their_first_frame():
    envs, sensors = scenes(), make_array(num_envs=2)
    fresh = make_array(num_envs=2)
    for step in range(4):
        move(envs, step)
        for index in range(2):
            sensors.read(envs[index], index)
        sensors.step()
    before = copy.deepcopy(sensors.responses)
    sensors.reset(np.array([False, True]))
    for new, old, initial in zip(sensors.responses, before, fresh.responses, strict=True):
        np.testing.assert_array_equal(new[0], old[0])
        np.testing.assert_array_equal(new[1], initial[1])
    assert before.ffi[1].max() > 0.0


def test_scenes_and_objects_may_be_written_directly():
    env = busy_road()
    read, written = make_array("fovea", 1), make_array("fovea", 1)
    read.read(env)
    written.set_road(0, env.road.network)
    written.scenes[:], written.objects[:] = read.scenes, read.objects
    written.object_counts[:] = read.object_counts
    read.step()
    written.step()
    assert read.objects.dtype == OBJECT
    np.testing.assert_array_equal(read.frames[0], written.frames[0])


def test_threads_process_disjoint_ranges_at_once():
    envs = scenes()
    apart, together = make_array(), make_array()
    for step in range(5):
        move(envs, step)
        for index, env in enumerate(envs):
            apart.read(env, index)
            together.read(env, index)
        together.step()
        threads = [threading.Thread(target=apart.process, args=(k, k + 1)) for k in range(len(FIELDS))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    for one, other in zip(apart.frames, together.frames, strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_equal(apart.responses._asdict(), together.responses._asdict())


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda item: pickle.loads(pickle.dumps(item))])
def test_copies_are_independent(duplicate):
    env, sensors = busy_road(), make_array(num_envs=1)
    for step in range(4):
        move([env], step)
        sensors.read(env)
        sensors.step()
    clone = duplicate(sensors)
    np.testing.assert_equal(clone.responses._asdict(), sensors.responses._asdict())
    other = curve()
    for used, scene in ((clone, other), (sensors, env), (clone, env)):
        used.read(scene)
        used.step()
        for k, camera in enumerate(CAMERAS):
            np.testing.assert_array_equal(
                used.frame_of(k), EgoCamera(CameraParams.make(camera)).render(scene)
            )
    assert not np.array_equal(clone.responses.ffi, sensors.responses.ffi)


def test_top_views_are_rendered_by_read():
    import gymnasium as gym
    import highway_env  # noqa: F401

    env = gym.make("two-way-v0")
    env.reset(seed=0)
    top_view = {"name": "birdseye", "shape": (45, 80)}
    sensors = SensorArray(["wide", top_view, "tele"], 30.0, LGMDParams())
    neuron = LGMD((45, 80), 30.0)
    for _ in range(3):
        env.step(1)
        sensors.read(env)
        sensors.step()
        frame = BirdsEye((45, 80)).render(env)
        np.testing.assert_array_equal(sensors.frame_of(1), frame)
        assert sensors.responses.ffi[0, 1] == neuron.step(frame).ffi
        np.testing.assert_array_equal(sensors.frame_of(2), EgoCamera("tele").render(env))
    sensors.close()
    env.close()


def test_invalid_camera_fields_raise():
    sensors = make_array(num_envs=1)
    with pytest.raises(ValueError, match="unknown camera field 'textur'; did you mean 'texture'"):
        sensors.set_camera_fields(0, {"textur": 1.0})
    with pytest.raises(ValueError, match=r"camera texture must be in \[0, 5\]"):
        sensors.set_camera_fields(0, {"texture": 9.0})
    with pytest.raises(ValueError, match=r"must keep the shape \(45, 80\) of camera 'wide', got \(20, 20\)"):
        sensors.set_camera_fields(0, {"shape": (20, 20)})
    with pytest.raises(ValueError, match="must keep the detector lgmd of camera 'wide', got dsn"):
        sensors.set_camera_fields(0, {"detector": "dsn"})
    with pytest.raises(ValueError, match="must keep the brake_known False of camera 'wide', got True"):
        sensors.set_camera_fields(0, {"brake_known": True})
    with pytest.raises(ValueError, match="must keep the derotated False of camera 'wide', got True"):
        sensors.set_camera_fields(0, {"derotated": True})


def test_conditions_are_covered():
    assert {fields.get("condition", "clear") for fields in FIELDS} == set(CONDITIONS)


def test_a_full_list_of_objects_is_drawn():
    env = straight_env()
    for k in range(600):
        add_car(env, 10.0 + 0.5 * k, 3.5 * (k % 3))
    sensors = SensorArray("wide", 30.0, LGMDParams())
    sensors.read(env)
    sensors.step()
    assert sensors.object_counts[0] == 512
    np.testing.assert_array_equal(sensors.frame_of(0), EgoCamera("wide").render(env))


@pytest.mark.parametrize(
    "identity", ["LGMD/CCRb-v0", "LGMD/CutOut-v0", "LGMD/PassBetween-v0", "LGMD/SteelPlate-v0"]
)
def test_a_scene_that_an_environment_writes_equals_the_scene_of_its_vehicles(identity):
    import gymnasium as gym

    env = gym.make(identity, camera=None)
    env.reset(seed=2)
    sensors = SensorArray(["fovea", "wide"], 30.0, LGMDParams())
    wide, written = EgoCamera("wide"), []
    write = env.unwrapped.write_scene
    env.unwrapped.write_scene = lambda arrays: (written.append(1), write(arrays))
    for _ in range(20):
        env.step(np.array([-0.2], np.float32))
        sensors.read(env)
        sensors.process(0, 1)
        np.testing.assert_array_equal(sensors.frame_of(1), wide.render(env))
    assert len(written) == 20
    np.testing.assert_array_equal(sensors.signals[0, 2], sensors.responses.ffi[0])
    env.close()
