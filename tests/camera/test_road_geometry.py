"""Lanes, markings and their cache; every road of highway-env."""

import gc

import gymnasium as gym
import highway_env  # noqa: F401  (registers the environments)
import numpy as np
import pytest
from highway_env.road.lane import SineLane, StraightLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.kinematics import Vehicle
from support.cameras import ego_camera
from support.roads import env_of, ring_road, straight_env

from lgmd_gym.camera import road_geometry as geometry_module
from lgmd_gym.camera.road_geometry import STRIPED, road_geometry

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
def test_every_highway_env_road_renders_with_markings(env_id):
    config = {"simulation_frequency": 30}
    if env_id in ("highway-v0", "exit-v0"):
        config["vehicles_count"] = 5
    env = gym.make(env_id, config=config)
    env.reset(seed=3)
    camera = ego_camera("wide")
    frames = [camera.render(env)]
    for _ in range(2):
        env.step(env.action_space.sample())
        frames.append(camera.render(env))
    assert all(frame.shape == (90, 160) and frame.std() > 10 for frame in frames)
    assert np.array_equal(camera.render(env), frames[-1])
    if env_id != "parking-v0":
        assert (np.array(frames)[:, 50:] > 185).any(), "no marking in the frame"
    env.close()


def ends_of(lines):
    """Both ends of the markings, shape (n, 2, 2)."""
    starts, directions = (np.stack([lines[a], lines[b]], axis=1) for a, b in (("x", "y"), ("cos", "sin")))
    return np.stack([starts, starts + lines["length"][:, None] * directions], axis=1)


@pytest.mark.parametrize("clockwise", [True, False])
def test_curved_markings_follow_the_lane(clockwise):
    road, _ = ring_road(clockwise=clockwise)
    geometry = road_geometry(road)
    ends = ends_of(geometry.lines).reshape(-1, 2)
    # Left of the direction of travel is outwards in a clockwise ring (y down), inwards in the other.
    radius = 42.0 if clockwise else 38.0
    assert np.hypot(*ends.T) == pytest.approx(np.full(len(ends), radius), abs=1e-6)
    middle = ends_of(geometry.lines).mean(axis=1)
    assert np.abs(np.hypot(*middle.T) - radius).max() < 0.05  # the chord leaves the arc by centimetres
    assert geometry.surface.shape[0] > 60


def test_curved_marking_appears_at_its_projection():
    road, lane = ring_road()
    env = env_of(road, Vehicle(road, lane.position(0.0, 0.0), lane.heading_at(0.0), 10.0))
    camera = ego_camera("wide", texture=0.0, roadside=0.0)
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
    camera = ego_camera("wide", texture=0.0, roadside=0.0)
    frame = camera.render(env)
    for s in np.arange(206.5, 216.0, 0.25):  # the lane starts at x = -200
        if 0.4 < s % 4.33 < 2.6 or 3.4 < s % 4.33 < 3.95:
            u, v = camera.project([s - 200.0, 1.75, 0.0])
            if 50 < v < 88:
                painted = frame[int(v), int(u) - 1 : int(u) + 2].max() > 150
                assert painted == (s % 4.33 < 3.0), s


def test_geometry_is_cached_for_the_lifetime_of_the_network(monkeypatch):
    calls = []
    original = geometry_module._extract
    monkeypatch.setattr(geometry_module, "_extract", lambda *a: calls.append(1) or original(*a))
    env = straight_env()
    camera = ego_camera("wide")
    for _ in range(3):
        camera.render(env)
    assert len(calls) == 1
    cached = len(geometry_module._CACHE)
    env.road = straight_env(lanes=1).road
    camera.render(env)
    assert len(calls) == 2
    del env
    gc.collect()
    assert len(geometry_module._CACHE) <= cached


def test_straight_lane_is_one_piece_and_duplicate_lines_are_dropped():
    geometry = road_geometry(straight_env(lanes=4).road)
    assert geometry.surface.shape == (1,)  # joined
    assert geometry.lines.shape[0] == 5
    assert geometry.lines["striped"].sum() == 3
    net = RoadNetwork()
    for i in range(2):
        kinds = [STRIPED, STRIPED]
        net.add_lane("a", "b", StraightLane([0, 4.0 * i], [100, 4.0 * i], line_types=kinds))
    assert road_geometry(Road(net)).lines.shape[0] == 3
    net.add_lane("c", "d", SineLane([0, 50], [100, 50], amplitude=3, pulsation=0.1, phase=0.0))
    assert road_geometry(Road(net)).lines.shape[0] == 3  # cached at the first call


def test_lanes_side_by_side_are_joined_but_not_those_of_other_lengths_or_apart():
    net = RoadNetwork()
    for y, end in ((0.0, 100.0), (4.0, 100.0), (8.0, 90.0), (20.0, 90.0)):
        net.add_lane("a", "b", StraightLane([0, y], [end, y], width=4.0))
    surface = road_geometry(Road(net)).surface
    assert surface.shape == (3,)
    assert surface["corners"][0] == pytest.approx([0.0, -2.5, 0.0, 6.5, 100.0, 6.5, 100.0, -2.5])
    assert surface["corners"][1] == pytest.approx([0.0, 5.5, 0.0, 10.5, 90.0, 10.5, 90.0, 5.5])
    assert surface[1].tolist()[1:] == pytest.approx((45.0, 8.0, np.hypot(45.0, 2.5)))


def test_road_is_drawn_along_all_of_its_length():
    """Its quad is 5.2 km long; the middle of the circle around it is far from both of these places."""
    camera = ego_camera("wide", texture=0.0, roadside=0.0)
    first, last = (camera.render(straight_env(x=x, line_types=False)) for x in (0.0, 4600.0))
    np.testing.assert_array_equal(first[48:], last[48:])  # above, the end of the road is visible


def test_network_without_lanes_is_all_asphalt():
    env = straight_env()
    env.road.network = RoadNetwork()
    frame = ego_camera("wide").render(env)
    assert abs(frame[60:].mean() - 104) < 5
