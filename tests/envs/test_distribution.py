"""`RandomLevels`: levels, splits and the random distribution."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

from lgmd_gym import CameraParams, EgoCamera
from lgmd_gym.benchmark.suites import find_suite
from lgmd_gym.camera import CONDITIONS
from lgmd_gym.camera.worlds import SPLIT_WORLDS
from lgmd_gym.envs import FAMILIES
from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.episode_source import RandomLevels
from lgmd_gym.envs.scenarios.distribution import LEVELS, draw_scenario, level_generator
from lgmd_gym.envs.scenarios.free_lanes import free_lane
from lgmd_gym.envs.scenarios.random_arguments import NON_THREATS, THREATS
from lgmd_gym.wrappers.vector import LGMDObservation as LGMDVector

HOLD = np.zeros(1, np.float32)


def random_env(**arguments):
    return BrakingEnv(RandomLevels(**arguments))


def run_episode(env, seed=None):
    _, info = env.reset(seed=seed)
    level, steps = info["level"], 0
    while True:
        _, _, terminated, truncated, info = env.step(HOLD)
        steps += 1
        assert info["level"] == level
        if terminated or truncated:
            return level, env.scenario, steps, info["collision"], float(env.vehicle.position[0])


def test_every_family_is_drawn():
    assert set(THREATS) | set(NON_THREATS) == set(FAMILIES)
    assert not set(THREATS) & set(NON_THREATS)
    drawn = [draw_scenario(level_generator("train", level)).family for level in range(600)]
    assert set(drawn) == set(FAMILIES)
    share = np.mean([family in THREATS for family in drawn])
    assert share == pytest.approx(0.5, abs=0.07)


def test_levels_are_valid():
    """Every drawn argument is in range, and so is every field of the scenario made from it."""
    for split in ("train", "validation", "test"):
        for level in range(1500):
            draw_scenario(level_generator(split, level))


def test_levels_include_the_headways_of_fmvss127():
    """In FMVSS 127 a lead car brakes at a headway of 0.54 s."""
    cases = [dict(case.arguments) for case in find_suite("fmvss127").cases if case.family == "CCRb"]
    shortest = min(arguments["gap"] / arguments["ego_speed"] for arguments in cases)
    for draw in THREATS["CCRb"], NON_THREATS["Following"]:
        drawn = [draw.draw(level_generator("train", level))["headway"] for level in range(2000)]
        assert min(drawn) < shortest
        assert max(drawn) > 2.5


def test_only_threats_have_contact_without_braking():
    env = random_env(split="validation")
    families = set()
    for seed in range(120):
        _, scenario, _, collision, _ = run_episode(env, seed)
        assert collision is (scenario.family in THREATS), scenario
        families.add(scenario.family)
    assert len(families) > 15


def test_levels_do_not_depend_on_the_seed_or_the_range_in_use():
    one = random_env(start_level=7, num_levels=1)
    other = random_env(start_level=0, num_levels=8)
    episodes = {run_episode(other, seed)[0]: run_episode(other, seed) for seed in range(40)}
    assert run_episode(one, seed=1) == run_episode(one, seed=2) == episodes[7]
    assert run_episode(random_env(split="test", start_level=7, num_levels=1), 1) != episodes[7]


def test_resets_without_a_seed_use_the_same_levels():
    env = random_env(start_level=100, num_levels=5)
    env.reset(seed=0)
    levels = {env.reset()[1]["level"] for _ in range(60)}
    assert levels == {100, 101, 102, 103, 104}


def test_the_road_matches_the_scenario():
    env = random_env()
    env.reset(seed=0)
    for _ in range(60):
        env.reset()
        lanes = env.road.network.lanes_list()
        kind = env.scenario.road.kind
        assert any(lane.__class__.__name__ == "CircularLane" for lane in lanes) is (kind == "curve")
        if kind == "two-way":
            assert len(lanes) == 2


def test_levels_set_condition_and_texture_of_the_camera():
    env = gym.make("LGMD/RandomBraking-v0", camera=["fovea", "birdseye"], split="validation")
    textures = {}
    for seed in range(40):
        _, info = env.reset(seed=seed)
        used = env.get_wrapper_attr("sensors").cameras[0]["fovea"]
        bare = CameraParams.preset("fovea").with_condition(info["condition"])
        changed = {"texture": used.params.texture, "world": info["world"], "road": "normal"}
        assert used.params == replace(bare, **changed, queue_lane=free_lane(env.unwrapped.scenario))
        assert info["world"] in SPLIT_WORLDS["validation"]
        assert np.array_equal(env.get_wrapper_attr("frames")["fovea"], EgoCamera(used.params).render(env))
        textures.setdefault(info["condition"], []).append(used.params.texture)
    assert set(textures) == set(CONDITIONS)
    values = np.concatenate(list(textures.values()))
    assert 0.5 <= values.min() < 0.7 < 1.3 < values.max() <= 1.5
    env.close()


def test_the_scenario_does_not_depend_on_the_conditions():
    clear = random_env(conditions=["clear"])
    mixed = random_env()
    for seed in range(20):
        assert clear.reset(seed=seed)[1]["condition"] == "clear"
        mixed.reset(seed=seed)
        assert clear.scenario == mixed.scenario
        assert clear.camera_fields["texture"] == mixed.camera_fields["texture"]


def test_vector_environment_equals_single_environments():
    kind, count = "LGMD/RandomBraking-v0", 6
    vector = LGMDVector(gym.make_vec(kind, num_envs=count, vectorization_mode="sync", camera=None))
    vector.reset(seed=list(range(count)))
    single = [gym.make(kind) for _ in range(count)]
    for seed, env in enumerate(single):
        env.reset(seed=seed)
    for _ in range(12):
        both, *_ = vector.step(np.zeros((count, 1), np.float32))
        for index, env in enumerate(single):
            one, *_ = env.step(HOLD)
            assert np.array_equal(both["ffi"][index], one["ffi"])
    assert len({env.unwrapped.camera_fields["condition"] for env in single}) > 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"split": "tain"}, "unknown split 'tain'; did you mean 'train'"),
        ({"start_level": -1}, r"start_level must be a whole number in \[0, 999999\], got -1"),
        ({"start_level": LEVELS - 1, "num_levels": 2}, r"num_levels must be a whole number in \[0, 1\]"),
        ({"levels": 3}, "'num_levels'"),
        ({"conditions": ["clear", "foggy"]}, "unknown condition 'foggy'; did you mean 'fog'"),
        ({"conditions": []}, "conditions needs at least one name"),
        ({"condition": "night"}, "unknown argument of RandomBraking 'condition'; did you mean 'conditions'"),
        ({"ego_speed": 3.0}, "unknown argument of RandomBraking 'ego_speed'"),
    ],
)
def test_errors_state_the_value_and_suggest_a_fix(arguments, words):
    with pytest.raises(ValueError, match=words):
        gym.make("LGMD/RandomBraking-v0", **arguments)
