"""The world of an episode: drawn, fixed or the laboratory, and what it changes."""

import gymnasium as gym
import numpy as np
import pytest

from lgmd_gym.camera.worlds import SPLIT_WORLDS, draw_world
from lgmd_gym.envs.appearance import MIXED, Appearance, camera_fields, world_condition
from lgmd_gym.envs.dynamics.brake import BrakeParams, draw_brake

IDS = ("LGMD/CCRs-v0", "LGMD/Traffic-Highway-v0", "LGMD/RandomBraking-v0")


def worlds_of(env_id, seeds=range(4), **arguments):
    env = gym.make(env_id, camera=None, **arguments)
    worlds = []
    for seed in seeds:
        env.reset(seed=seed)
        worlds.append(env.unwrapped.camera_fields["world"])
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


def test_the_camera_moves_on_a_normal_road_except_in_the_laboratory():
    assert camera_fields(3, "clear", None)["road"] == "normal"
    assert camera_fields(None, "clear", None)["road"] == "still"
    assert camera_fields(None, "clear", "rough")["road"] == "rough"


def test_mixed_is_the_condition_of_the_world():
    drawn = [world_condition(world) for world in range(400)]
    for condition in ("clear", "night", "fog", "rain"):
        assert 70 < drawn.count(condition) < 130
    assert camera_fields(7, MIXED, None)["condition"] == world_condition(7)
    assert camera_fields(None, MIXED, None)["condition"] == "clear"


def test_brakes_of_single_and_vector_environments_are_those_of_the_worlds():
    arguments = {"camera": None, "condition": "rain"}
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
        ({"condition": "nigth"}, "unknown condition 'nigth'; did you mean 'night'"),
        ({"road": "ruff"}, "unknown road 'ruff'; known: normal, rough"),
        ({"split": "held"}, "unknown split of worlds 'held'"),
    ],
)
def test_invalid_values_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        Appearance(**arguments)
