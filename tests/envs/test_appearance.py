"""The world of an episode: drawn, fixed or the laboratory, and what it changes."""

import gymnasium as gym
import numpy as np
import pytest

from lgmd_gym.camera import Scene
from lgmd_gym.camera.worlds import SPLIT_WORLDS, draw_world
from lgmd_gym.envs.appearance import MIXED, Appearance, world_weather
from lgmd_gym.envs.dynamics.brake import BrakeParams, draw_brake

IDS = ("LGMD/CCRs-v0", "LGMD/Traffic-Highway-v0", "LGMD/RandomBraking-v0")


def worlds_of(env_id, seeds=range(4), **arguments):
    env = gym.make(env_id, camera=None, **arguments)
    worlds = []
    for seed in seeds:
        env.reset(seed=seed)
        worlds.append(env.unwrapped.scene.world)
    return worlds


@pytest.mark.parametrize("env_id", IDS)
def test_each_reset_draws_a_training_world_of_its_seed(env_id):
    worlds = worlds_of(env_id)
    assert len(set(worlds)) == 4
    assert all(world in SPLIT_WORLDS["train"] for world in worlds)
    assert worlds == worlds_of(env_id)


@pytest.mark.parametrize("env_id", IDS)
@pytest.mark.parametrize(("world", "expected"), [(42, 42), ("laboratory", None)])
def test_a_named_world_is_that_of_every_episode(env_id, world, expected):
    assert worlds_of(env_id, world=world) == [expected] * 4


def test_a_seed_has_the_same_scene_in_every_world():
    def scene(**arguments):
        env = gym.make("LGMD/CutIn-v0", camera=None, **arguments)
        env.reset(seed=3)
        return [(car.position.tolist(), car.shade) for car in env.unwrapped.road.obstacles]

    assert scene() == scene(world=17) == scene(world="laboratory")


@pytest.mark.parametrize("split", ["train", "validation", "test"])
def test_levels_have_worlds_of_their_split(split):
    assert all(world in SPLIT_WORLDS[split] for world in worlds_of("LGMD/RandomBraking-v0", split=split))


def test_roads_have_the_lane_width_of_the_world():
    for world in range(6):
        env = gym.make("LGMD/EmptyRoad-v0", camera=None, world=world)
        env.reset(seed=0)
        lanes = env.unwrapped.road.network.lanes_list()
        width = draw_world(world).lane_width
        assert {lane.width for lane in lanes} == {width}
        middles = sorted(lane.position(0.0, 0.0)[1] for lane in lanes)
        assert np.diff(middles) == pytest.approx(width)
        assert env.unwrapped.vehicle.position[1] in middles


def scene_in(world, **arguments):
    return Appearance(world=world, **arguments).draw(np.random.default_rng(0))


def test_a_scene_gives_world_weather_road_and_further_fields():
    fields = {"world": 7, "weather": "fog", "texture": 0.5}
    expected = Scene(world=7, weather="fog", road="normal", texture=0.5)
    assert Appearance.of(fields).draw(np.random.default_rng(0)) == expected
    assert Appearance.of(expected).draw(np.random.default_rng(0)) == expected
    assert Appearance.of(Scene()).draw(np.random.default_rng(0)) == Scene()
    assert Appearance.of(fields, world=8, weather="rain").draw(np.random.default_rng(0)).world == 8
    assert Appearance.of({"texture": 0.5}).world is None
    env = gym.make("LGMD/CCRs-v0", camera=None, scene=fields)
    env.reset(seed=0)
    assert (env.unwrapped.scene.texture, env.unwrapped.scene.weather.name) == (0.5, "fog")


def test_the_camera_moves_on_a_normal_road_except_in_the_laboratory():
    assert scene_in(3).road == "normal"
    assert scene_in("laboratory").road == "still"
    assert scene_in("laboratory", road="rough").road == "rough"


def test_mixed_is_the_weather_of_the_world():
    drawn = [world_weather(world) for world in range(400)]
    for weather in ("clear", "night", "fog", "rain"):
        assert 70 < drawn.count(weather) < 130
    assert scene_in(7, weather=MIXED).weather.name == world_weather(7)
    assert scene_in("laboratory", weather=MIXED).weather.name == "clear"


def test_brakes_of_single_and_vector_environments_are_those_of_the_worlds():
    arguments = {"camera": None, "weather": "rain"}
    vector = gym.make_vec("LGMD/CCRs-v0", num_envs=3, **arguments)
    _, infos = vector.reset(seed=5)
    for index, world in enumerate(infos["world"].tolist()):
        expected = draw_brake(world, True)
        brake = vector.unwrapped.simulation.brakes[index]
        assert brake["max_deceleration"] == expected.max_deceleration
        assert brake["delay"] == pytest.approx(expected.delay)
    laboratory = gym.make("LGMD/CCRs-v0", world="laboratory", **arguments)
    laboratory.reset(seed=5)
    assert laboratory.unwrapped.brake == BrakeParams()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"world": 10_000}, r"world must be a whole number in \[0, 9999\], got 10000"),
        ({"world": "labratory"}, "unknown world 'labratory'; did you mean 'laboratory'"),
        ({"weather": "nigth"}, "unknown weather 'nigth'; did you mean 'night'"),
        ({"road": "ruff"}, "unknown road 'ruff'; known: normal, rough"),
        ({"split": "held"}, "unknown split of worlds 'held'"),
    ],
)
def test_invalid_values_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        Appearance(**arguments)
