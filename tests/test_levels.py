"""`RandomBraking`: levels, splits, and what is drawn."""

import gymnasium as gym
import numpy as np
import pytest

from lgmd_gym.envs import FAMILIES
from lgmd_gym.envs.levels import LEVELS, QUIET, THREATS, draw_scenario, level_generator
from lgmd_gym.envs.random_braking import RandomBrakingEnv

HOLD = np.zeros(1, np.float32)


def outcome(env, seed=None):
    _, info = env.reset(seed=seed)
    level, steps = info["level"], 0
    while True:
        _, _, terminated, truncated, info = env.step(HOLD)
        steps += 1
        assert info["level"] == level
        if terminated or truncated:
            return level, env.scenario, steps, info["collision"], float(env.vehicle.position[0])


def test_every_family_is_drawn():
    assert set(THREATS) | set(QUIET) == set(FAMILIES)
    assert not set(THREATS) & set(QUIET)
    drawn = [draw_scenario(level_generator("train", level)).family for level in range(600)]
    assert set(drawn) == set(FAMILIES)
    share = np.mean([family in THREATS for family in drawn])
    assert share == pytest.approx(0.5, abs=0.07)


def test_threats_threaten_and_the_rest_does_not():
    env = RandomBrakingEnv(split="validation")
    seen = set()
    for seed in range(120):
        _, scenario, _, collision, _ = outcome(env, seed)
        assert collision is (scenario.family in THREATS), scenario
        seen.add(scenario.family)
    assert len(seen) > 15


def test_a_level_is_the_same_whoever_plays_it():
    one = RandomBrakingEnv(start_level=7, num_levels=1)
    other = RandomBrakingEnv(start_level=0, num_levels=8)
    played = {outcome(other, seed)[0]: outcome(other, seed) for seed in range(40)}
    assert outcome(one, seed=1) == outcome(one, seed=2) == played[7]
    assert outcome(RandomBrakingEnv(split="test", start_level=7, num_levels=1), 1) != played[7]


def test_resets_without_a_seed_stay_in_their_levels():
    env = RandomBrakingEnv(start_level=100, num_levels=5)
    env.reset(seed=0)
    levels = {env.reset()[1]["level"] for _ in range(60)}
    assert levels == {100, 101, 102, 103, 104}


def test_the_road_follows_the_scenario():
    env = RandomBrakingEnv()
    env.reset(seed=0)
    for _ in range(60):
        env.reset()
        lanes = env.road.network.lanes_list()
        kind = env.scenario.road.kind
        assert any(lane.__class__.__name__ == "CircularLane" for lane in lanes) is (kind == "curve")
        if kind == "two-way":
            assert len(lanes) == 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"split": "tain"}, "unknown split 'tain'; did you mean 'train'"),
        ({"start_level": -1}, r"start_level must be in \[0, 999999\], got -1"),
        ({"start_level": LEVELS - 1, "num_levels": 2}, r"num_levels must be in \[0, 1\]"),
        ({"levels": 3}, "'num_levels'"),
        ({"ego_speed": 3.0}, "unknown argument of RandomBraking 'ego_speed'"),
    ],
)
def test_bad_levels_are_refused(arguments, words):
    with pytest.raises(ValueError, match=words):
        gym.make("LGMD/RandomBraking-v0", **arguments)
