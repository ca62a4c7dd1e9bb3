"""`SensorArray`: batches of cameras and neurons equal single cameras and neurons to the bit."""

import copy
import pickle
import threading

import numpy as np
import pytest
from support.golden_frames import busy_road, curve
from support.roads import add_car, straight_env

from lgmd_gym import LGMD, BirdsEye, LGMDParams, neuron
from lgmd_gym.camera import WEATHERS, AlongPath, Camera, EgoCamera, Fixed, Scene, Weather
from lgmd_gym.camera.objects import OBJECT
from lgmd_gym.sensing.channel import make_channels
from lgmd_gym.sensing.sensor_array import SensorArray

SMALL, TINY = {"shape": (45, 80)}, {"shape": (30, 40)}
ASIDE, BACK = {"mount": {"yaw_deg": 20.0}}, {"mount": {"yaw_deg": 180.0}}
PATH, STEADY = {"gaze": AlongPath(derotated=True)}, {"gaze": Fixed(derotated=True)}
CAMERAS = [
    Camera.make("wide", **SMALL),
    {"name": "small", **TINY, **ASIDE},
    Camera.make("fovea", **SMALL),
    {"name": "back", **TINY, **BACK},
    {"name": "path", **SMALL, "gaze": "path", "mount": {"left_m": 0.4}},
    {"name": "driver", **SMALL, "gaze": "path", "sensor": {"linear_light": True}},
    {"name": "back edges", "camera": {**TINY, **BACK}, "neuron": "edges"},
    {"name": "columns", "camera": {**TINY, **ASIDE}, "columns": 4},
    {"name": "flow columns", "camera": {**TINY, **ASIDE}, "neuron": "dsn", "columns": 2},
    {"name": "side", "camera": {**SMALL, "mount": {"yaw_deg": 30.0}}, "neuron": "lplc2"},
    {"name": "derotated", "camera": {**TINY, **STEADY}, "columns": 4},
    {"name": "derotated path", "camera": {**SMALL, **PATH}},
    {"name": "derotated flow", "camera": {**TINY, **STEADY}, "neuron": "dsn", "columns": 4},
    {"name": "derotated edges", "camera": {**TINY, **STEADY}, "neuron": "edges"},
    {"name": "derotated side", "camera": {**SMALL, **STEADY}, "neuron": "lplc2"},
    {"name": "small flow", "camera": {**TINY, **ASIDE}, "neuron": "dsn"},
    {"name": "back flow", "camera": {**TINY, **BACK}, "neuron": "dsn"},
]
CHANNELS = make_channels(CAMERAS)
SCENES = [
    {"vehicles": "box", "panorama": "natural"},
    {"weather": Weather.make("night", visibility_m=40.0), "texture": 0.7},
    {"weather": "rain", "texture": 1.4, "guard_rail": True},
    {"weather": "fog", "seed": 5, "roadside": 2.0},
    {"weather": "low_sun", "world": 11, "road": "rough"},
    {"weather": "night_upper_beam", "world": 12, "mount_height_m": 1.4},
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
        sensors.set_scene(index, SCENES[index])
    return sensors


def reference(channel, scene):
    """Return a camera and a neuron of their own."""
    return EgoCamera(channel.camera, scene), neuron.make(channel.neuron, channel.camera.shape, 30.0)


@pytest.mark.parametrize("threads", [None, 3])
def test_frames_and_outputs_equal_those_of_single_cameras_and_neurons(threads):
    envs, sensors = scenes(), make_array(threads=threads)
    singles = [[reference(channel, scene) for channel in CHANNELS] for scene in SCENES]
    turns = dict.fromkeys(range(len(CAMERAS)), 0)
    for step in range(6):
        move(envs, step)
        for index, env in enumerate(envs):
            sensors.read(env, index)
        sensors.step()
        for index, env in enumerate(envs):
            for k, (camera, model) in enumerate(singles[index]):
                before = camera.yaw_px
                frame = camera.render(env)
                np.testing.assert_array_equal(sensors.frame_of(k, index), frame)
                turns[k] += abs(camera.yaw_px - before) if step else 0
                expected = model.step(frame, turn_px=camera.yaw_px - before)
                assert [field[index, k].item() for field in sensors.responses] == list(expected)
            expected = [
                model.column_potentials(channel.columns)
                for channel, (_, model) in zip(CHANNELS, singles[index], strict=True)
                if channel.columns
            ]
            np.testing.assert_array_equal(sensors.column_potentials()[index], np.concatenate(expected))
    assert [name for k, name in enumerate(sensors.names) if turns[k]] == [
        name for name in sensors.names if name.startswith("derotated")
    ]
    assert sensors.responses.spikes.dtype == np.int64
    assert sensors.responses.alert.dtype == np.bool_


def test_the_scene_of_the_next_road_need_not_fit_the_last_one():
    """A level on two lanes, and then one with a queue on the third lane."""
    sensors = SensorArray("wide", 30.0, LGMDParams(), 1)
    narrow, broad = straight_env(lanes=2), straight_env(lanes=3)
    for env, lane in ((broad, 2), (narrow, 1), (broad, 2)):
        scene = Scene(world=8002, queue_lane=lane)
        sensors.set_scene(0, scene)
        sensors.set_road(0, env.road)
        sensors.read(env, 0)
        sensors.process(0, 1)
        np.testing.assert_array_equal(sensors.frame_of(0, 0), EgoCamera("wide", scene).render(env))


def test_scenes_change_at_any_time():
    envs, sensors = scenes(), make_array()
    for step in range(5):
        move(envs, step)
        for index, env in enumerate(envs):
            scene = Scene.make(SCENES[(index + step // 2) % 4])
            sensors.set_scene(index, scene)
            sensors.read(env, index)
            sensors.process(index, index + 1)
            for k, channel in enumerate(CHANNELS):
                own = EgoCamera(channel.camera, scene)
                np.testing.assert_array_equal(sensors.frame_of(k, index), own.render(env))
                posed = sensors.cameras[index][sensors.names[k]]
                assert (posed.camera, posed.scene) == (own.camera, own.scene)
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
    changed = [not np.array_equal(sensors.frames[0][k], before[0][0][k]) for k in range(len(SCENES))]
    assert changed == [True, False, True, False, False, False]
    for new, old in zip(sensors.responses, before[1], strict=True):
        np.testing.assert_array_equal(new[[1, 3]], old[[1, 3]])
    assert (sensors.responses.ffi != before[1].ffi)[[0, 2]].all()


def test_neurons_on_the_same_views_share_frames():
    """A channel that pauses keeps its outputs; its camera is drawn for the other neuron."""
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
                if together.enabled[index, camera]:
                    frame = own.frame_of(camera % 2, index)
                    np.testing.assert_array_equal(together.frame_of(camera, index), frame)
                expected = own.response_of(index).membrane_potential[camera % 2]
                assert together.response_of(index).membrane_potential[camera] == expected


def test_a_disabled_camera_pauses_and_starts_anew():
    env = busy_road()
    sensors = make_array(num_envs=1)
    own, model = reference(CHANNELS[2], SCENES[0])
    for step in range(12):
        move([env], step)
        sensors.enabled[0, 2] = not 4 <= step < 8
        sensors.read(env)
        kept = [field[0, 2].item() for field in sensors.responses], sensors.frame_of(2).copy()
        sensors.process(0, 1)
        if sensors.enabled[0, 2]:
            frame = own.render(env)
            if step == 8:
                model.reset()
            np.testing.assert_array_equal(sensors.frame_of(2), frame)
            kept = list(model.step(frame)), frame
        assert [field[0, 2].item() for field in sensors.responses] == kept[0]
        np.testing.assert_array_equal(sensors.frame_of(2), kept[1])
        np.testing.assert_array_equal(sensors.frame_of(0), EgoCamera(CAMERAS[0], SCENES[0]).render(env))


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
        threads = [threading.Thread(target=apart.process, args=(k, k + 1)) for k in range(len(SCENES))]
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
        for k, channel in enumerate(CHANNELS):
            own = EgoCamera(channel.camera, SCENES[0])
            np.testing.assert_array_equal(used.frame_of(k), own.render(scene))
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


def test_invalid_scenes_raise():
    sensors = SensorArray(["wide", {"gaze": "stopping"}], 30.0, LGMDParams())
    with pytest.raises(ValueError, match="unknown scene field 'textur'; did you mean 'texture'"):
        sensors.set_scene(0, {"textur": 1.0})
    with pytest.raises(ValueError, match=r"scene texture must be in \[0, 5\]"):
        sensors.set_scene(0, {"texture": 9.0})
    with pytest.raises(ValueError, match="scene panorama must be 'skyline' with the gaze 'stopping'"):
        sensors.set_scene(0, {"panorama": "natural"})


def test_weathers_are_covered():
    assert {Scene.make(scene).weather.name for scene in SCENES} == set(WEATHERS)


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
def test_frames_of_the_physics_equal_those_of_the_vehicles(identity):
    import gymnasium as gym

    env = gym.make(identity, camera=["fovea", "wide"], world="laboratory")
    env.reset(seed=2)
    wide = EgoCamera("wide")
    for _ in range(20):
        env.step(np.array([-0.2], np.float32))
        np.testing.assert_array_equal(env.get_wrapper_attr("frames")["wide"], wide.render(env))
    sensors = env.get_wrapper_attr("sensors")
    np.testing.assert_array_equal(sensors.signals[0, 2], sensors.responses.ffi[0])
    env.close()
