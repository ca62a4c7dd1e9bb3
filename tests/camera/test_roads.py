"""Every road of highway-env, bad input, and scenes that no one would drive."""

import gc
import itertools
import time
from types import SimpleNamespace

import gymnasium as gym
import highway_env  # noqa: F401  (registers the environments)
import numpy as np
import pytest
from highway_env.road.lane import CircularLane, LineType, SineLane, StraightLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.kinematics import Vehicle
from highway_env.vehicle.objects import Landmark, Obstacle
from hypothesis import given, settings
from hypothesis import strategies as st
from support.roads import add_car, lens_x, straight_env

from lgmd_gym.camera import EgoCamera
from lgmd_gym.camera import scene as scene_module
from lgmd_gym.camera.scene import STRIPED, road_geometry

IDS = [
    "highway-v0",
    "merge-v0",
    "roundabout-v0",
    "intersection-v1",
    "racetrack-v0",
    "exit-v0",
    "two-way-v0",
    "lane-keeping-v0",
    "u-turn-v0",
    "parking-v0",
]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("env_id", IDS)
def test_every_highway_env_road(env_id):
    config = {"simulation_frequency": 30}
    if env_id in ("highway-v0", "exit-v0"):
        config["vehicles_count"] = 5
    env = gym.make(env_id, config=config)
    env.reset(seed=3)
    camera = EgoCamera("wide")
    frames = [camera.render(env)]
    for _ in range(2):
        env.step(env.action_space.sample())
        frames.append(camera.render(env))
    assert all(frame.shape == (90, 160) and frame.std() > 10 for frame in frames)
    assert np.array_equal(camera.render(env), frames[-1])
    if env_id != "parking-v0":
        assert (np.array(frames)[:, 50:] > 185).any(), "no marking in sight"
    env.close()


def ring(kind=LineType.CONTINUOUS, clockwise=True):
    net = RoadNetwork()
    phases = (0.0, 2 * np.pi) if clockwise else (2 * np.pi, 0.0)
    kinds = [kind, LineType.NONE]
    lane = CircularLane([0, 0], 40.0, *phases, clockwise=clockwise, width=4.0, line_types=kinds)
    net.add_lane("a", "b", lane)
    return Road(net, np_random=np.random.RandomState(0)), lane


@pytest.mark.parametrize("clockwise", [True, False])
def test_curved_markings_lie_where_the_lane_says(clockwise):
    road, _ = ring(clockwise=clockwise)
    geometry = road_geometry(road)
    ends = geometry.lines[:, :4].reshape(-1, 2)
    # Left of the direction of travel is outwards in a clockwise ring (y down), inwards in the other.
    radius = 42.0 if clockwise else 38.0
    assert np.hypot(*ends.T) == pytest.approx(np.full(len(ends), radius), abs=1e-6)
    middle = geometry.lines[:, :4].reshape(-1, 2, 2).mean(axis=1)
    assert np.abs(np.hypot(*middle.T) - radius).max() < 0.05  # the chord leaves the arc by centimetres
    assert geometry.surface.shape[0] > 60


def test_curved_marking_is_in_the_frame_where_projection_says():
    road, lane = ring(kind=LineType.CONTINUOUS)
    ego = Vehicle(road, lane.position(0.0, 0.0), lane.heading_at(0.0), 10.0)
    road.vehicles.append(ego)
    env = SimpleNamespace(road=road, vehicle=ego)
    camera = EgoCamera("wide", texture=0.0, roadside=0.0)
    frame = camera.render(env)
    hits = 0
    for s in np.arange(5.0, 15.0, 0.5):
        u, v = camera.project([*lane.position(s, -2.0), 0.0])
        if 3 < u < 157 and 52 < v < 87:
            hits += 1
            row = frame[int(v)]
            assert abs(int(np.argmax(row)) + 0.5 - u) < 6 or row[int(u)] > 118
            assert row[int(u) - 1 : int(u) + 2].max() > 118  # asphalt is 104
    assert hits >= 5


def test_stripes_are_three_metres_in_four_and_a_third():
    env = straight_env(lanes=2, y=1.75)
    camera = EgoCamera("wide", texture=0.0, roadside=0.0)
    frame = camera.render(env)
    for s in np.arange(206.5, 216.0, 0.25):  # the lane starts at x = -200
        if 0.4 < s % 4.33 < 2.6 or 3.4 < s % 4.33 < 3.95:
            u, v = camera.project([s - 200.0, 1.75, 0.0])
            if 50 < v < 88:
                painted = frame[int(v), int(u) - 1 : int(u) + 2].max() > 150
                assert painted == (s % 4.33 < 3.0), s


def test_geometry_is_read_once_and_forgotten_with_the_road(monkeypatch):
    calls = []
    original = scene_module._extract
    monkeypatch.setattr(scene_module, "_extract", lambda *a: calls.append(1) or original(*a))
    env = straight_env()
    camera = EgoCamera("wide")
    for _ in range(3):
        camera.render(env)
    assert len(calls) == 1
    kept = len(scene_module._CACHE)
    env.road = straight_env(lanes=1).road
    camera.render(env)
    assert len(calls) == 2
    del env
    gc.collect()
    assert len(scene_module._CACHE) <= kept


def test_a_straight_lane_is_one_piece_and_doubles_are_dropped():
    geometry = road_geometry(straight_env(lanes=4).road)
    assert geometry.surface.shape == (4, 8)
    assert geometry.lines.shape[0] == 5
    assert geometry.lines[:, 6].sum() == 3
    net = RoadNetwork()
    for i in range(2):
        kinds = [STRIPED, STRIPED]
        net.add_lane("a", "b", StraightLane([0, 4.0 * i], [100, 4.0 * i], line_types=kinds))
    assert road_geometry(Road(net)).lines.shape[0] == 3
    net.add_lane("c", "d", SineLane([0, 50], [100, 50], amplitude=3, pulsation=0.1, phase=0.0))
    assert road_geometry(Road(net)).lines.shape[0] == 3  # still that of the network's first reading


def test_obstacles_and_landmarks_are_drawn():
    env = straight_env()
    camera = EgoCamera("wide", roadside=0.0)
    bare = camera.render(env).astype(int)
    env.road.objects.append(Obstacle(env.road, [20.0, 3.5]))
    assert np.abs(camera.render(env) - bare).max() > 30
    env.road.objects[:] = [Landmark(env.road, [20.0, 3.5])]
    marked = np.abs(camera.render(env) - bare)
    assert marked.max() > 20
    assert marked[:45].max() == 0  # flat on the ground


def test_nearer_hides_farther_whatever_the_order():
    for order in (1, -1):
        env = straight_env()
        cars = [(20.0, 10), (30.0, 250)][::order]
        for x, shade in cars:
            add_car(env, x, 3.5, shade=shade, size=(4, 1.8, 1.5))
        frame = EgoCamera("wide", vehicles="box").render(env)
        assert frame[46, 80] < 40


def test_a_long_truck_does_not_hide_the_car_beside_its_tail():
    env = straight_env()
    add_car(env, lens_x(env) + 28.0, 7.0, shade=120, size=(16.0, 2.5, 3.5))
    car = add_car(env, lens_x(env) + 14.0, 3.5, shade=20, size=(4.0, 1.8, 1.5))
    camera = EgoCamera("wide", vehicles="box")
    frame = camera.render(env)
    u, v = camera.project([lens_x(env) + 12.0, 3.5 + 0.5, 0.8])
    assert frame[int(v), int(u)] < 40
    assert car in env.road.vehicles


def test_no_road_no_ego_no_lanes():
    with pytest.raises(ValueError, match="no road"):
        EgoCamera("wide").render(SimpleNamespace(road=None, vehicle=None))
    env = straight_env()
    env.vehicle = None
    with pytest.raises(ValueError, match="no ego"):
        EgoCamera("wide").render(env)
    empty = straight_env()
    empty.road.network = RoadNetwork()
    frame = EgoCamera("wide").render(empty)
    assert abs(frame[60:].mean() - 104) < 5  # all paved


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_poses_that_are_not_finite_are_refused(value):
    env = straight_env()
    env.vehicle.position[0] = value
    with pytest.raises(ValueError, match=r"ego vehicle has position \((nan|inf)"):
        EgoCamera("wide").render(env)
    env = straight_env()
    car = add_car(env, 10.0, 3.5)
    car.position[1] = value
    with pytest.raises(ValueError, match="Vehicle 1 of the road has position"):
        EgoCamera("wide").render(env)
    env = straight_env()
    add_car(env, 10.0, 3.5, heading=value)
    with pytest.raises(ValueError, match="Vehicle 1 of the road has heading"):
        EgoCamera("wide").render(env)


def test_vehicle_at_the_lens_and_around_it():
    env = straight_env()
    camera = EgoCamera("wide", roadside=0.0)
    bare = camera.render(env)
    car = add_car(env, lens_x(env), 3.5)
    inside = camera.render(env)  # from inside nothing of it is drawn but its shadow
    assert np.array_equal(inside[:45], bare[:45])
    car.position[0] = -20.0
    assert np.array_equal(camera.render(env), bare)  # behind
    car.position[:] = lens_x(env) + 1.0, 3.5 - 1.2
    beside = camera.render(env)
    assert np.any(beside[:, :80] != bare[:, :80])
    car.position[:] = env.vehicle.position
    camera.render(env)


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
    camera = EgoCamera(preset, pitch_deg=pitch)
    camera.render(env)
    start = time.perf_counter()
    frame = camera.render(env)
    assert time.perf_counter() - start < 0.25
    assert frame.shape == (90, 160)
    assert np.array_equal(camera.render(env), frame)


@settings(max_examples=40, deadline=None)
@given(x=st.floats(-3, 9), y=st.floats(-3, 3), turn=st.floats(-4, 4))
def test_a_vehicle_touching_the_lens_draws_no_wild_polygon(x, y, turn):
    env = straight_env()
    camera = EgoCamera("wide", roadside=0.0)
    car = add_car(env, lens_x(env) + x, 3.5 + y, heading=turn, shade=30)
    frame = camera.render(env)
    # All of the car is lower than 1.43 m: nothing above the row of its nearest possible point.
    c, s = abs(np.cos(turn)), abs(np.sin(turn))
    clear = x - 0.5 * (car.LENGTH * c + car.WIDTH * s)
    if clear > 0.3:
        top = 45 - camera.params.focal_px * 0.23 / clear
        env.road.vehicles.remove(car)
        bare = camera.render(env)
        rows = max(int(top) - 1, 0)
        assert np.array_equal(frame[:rows], bare[:rows])


def test_shades_without_a_shade_cover_dark_to_light():
    shades = [scene_module.index_shade(0, i) for i in range(8)]
    assert min(shades) < 60
    assert max(shades) > 195
    assert min(abs(a - b) for a, b in itertools.pairwise(shades)) > 40
    assert scene_module.index_shade(1, 3) != scene_module.index_shade(0, 3)


def test_marks_and_boxes_with_a_grey_of_their_own():
    """A landmark with `shade` is filled, lighter or darker than asphalt; an obstacle is a plain box."""
    greys = {}
    for shade in (None, 40, 180):
        env = straight_env()
        mark = Landmark(env.road, np.add(env.vehicle.position, (22.0, 0.0)))
        mark.LENGTH, mark.WIDTH = 8.0, 3.0
        if shade is not None:
            mark.shade = shade
        env.road.objects.append(mark)
        camera = EgoCamera("standard", texture=0.0, roadside=0.0)
        frame = camera.render(env)
        column, row = np.floor(camera.project([*mark.position, 0.0])).astype(int)
        greys[shade] = float(frame[row, column])
    assert 104 < greys[None] < 150  # an outline is faint in the middle
    assert greys[40] == pytest.approx(40, abs=3)
    assert greys[180] == pytest.approx(180, abs=3)

    def box_spread(shade):
        env = straight_env()
        box = Obstacle(env.road, np.add(env.vehicle.position, (22.0, 0.0)))
        if shade is not None:
            box.shade = shade
        env.road.objects.append(box)
        camera = EgoCamera("standard", texture=0.0, roadside=0.0)
        frame = camera.render(env)
        corners = camera.project(
            [[*(np.add(box.position, (-1.0, side * 0.8))), z] for side in (-1, 1) for z in (0.2, 0.8)]
        )
        (u0, v0), (u1, v1) = np.ceil(corners.min(0)).astype(int), np.floor(corners.max(0)).astype(int)
        return np.ptp(frame[v0:v1, u0:u1].astype(float))

    assert box_spread(120) < 10
    assert box_spread(None) > 50
