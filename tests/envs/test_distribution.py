"""`RandomLevels`: levels, splits and the random distribution."""

import json
from dataclasses import replace
from hashlib import sha256

import gymnasium as gym
import numpy as np
import pytest

from lgmd_gym.benchmark.suites import find_suite
from lgmd_gym.camera import WEATHERS, EgoCamera, Scene
from lgmd_gym.camera.worlds import SPLIT_WORLDS
from lgmd_gym.envs import FAMILIES
from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.episode_source import RandomLevels
from lgmd_gym.envs.families import LEVELS as DECLARED
from lgmd_gym.envs.families.data import scenario_to_data
from lgmd_gym.envs.families.distribution import (
    ALL_FAMILIES,
    EXTRA_FAMILIES,
    FIRST_EXTRAS,
    LEVELS,
    SPLITS,
    draw_scenario,
    level_generator,
)
from lgmd_gym.envs.families.rear import RELEASE
from lgmd_gym.envs.families.scenario import free_lane, without_target
from lgmd_gym.envs.registration import RANDOM_TASKS, env_id

HOLD = np.zeros(1, np.float32)
THREATS = {name for name in ALL_FAMILIES if DECLARED[name].threat}


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
    assert {level.family for level in DECLARED.values()} == {*FAMILIES}
    assert {*ALL_FAMILIES, *EXTRA_FAMILIES} == {*DECLARED}
    assert not {*ALL_FAMILIES} & {*EXTRA_FAMILIES}
    drawn = [draw_scenario(level_generator("train", level)).family for level in range(600)]
    assert set(drawn) == set(ALL_FAMILIES)
    share = np.mean([family in THREATS for family in drawn])
    assert share == pytest.approx(0.5, abs=0.07)


def test_levels_are_valid():
    """Every drawn argument is in range, and so is every field of the scenario made from it."""
    for split in ("train", "validation", "test"):
        for level in range(700):
            draw_scenario(level_generator(split, level))
            draw_scenario(level_generator(split, level), EXTRA_FAMILIES)


@pytest.mark.parametrize("threat", [True, False])
def test_extra_families_are_drawn_where_they_are_named(threat):
    """A standing target is a threat in every level; a car next to the lane or a missing target is not."""
    names = [name for name in EXTRA_FAMILIES if DECLARED[name].threat is threat]
    for name in names:
        env = random_env(split="validation", families=[name])
        for seed in range(3):
            _, scenario, _, collision, _ = run_episode(env, seed)
            assert collision is threat, scenario
            assert scenario.family == DECLARED[name].family


def test_levels_without_targets_are_twins():
    """Levels of threats and those of the same threats without their targets differ by the target only."""
    threats = [name.removesuffix("WithoutTarget") for name in EXTRA_FAMILIES if "WithoutTarget" in name]
    without = [f"{name}WithoutTarget" for name in threats]
    for level in range(200):
        scenario = draw_scenario(level_generator("train", level), threats)
        assert draw_scenario(level_generator("train", level), without) == without_target(scenario)


@pytest.mark.parametrize(
    ("decelerations", "message"),
    [
        ((9.0, 4.0), r"decelerations must be the lowest and the highest value \[m/s²\], got \[9.0, 4.0\]"),
        ((5.0,), "decelerations must be the lowest and the highest value"),
        ((5.0, 20.0), r"max_deceleration must be in \[0.1, 12\] m/s², got 20"),
    ],
)
def test_invalid_decelerations_raise(decelerations, message):
    with pytest.raises(ValueError, match=message):
        RandomLevels(decelerations=decelerations)


@pytest.mark.parametrize("name", [name for name in EXTRA_FAMILIES if name.startswith("Fast")])
def test_fast_families_have_the_speeds_of_a_motorway(name):
    drawn = [draw_scenario(level_generator("train", level), [name]) for level in range(200)]
    assert {scenario.family for scenario in drawn} == {name.removeprefix("Fast")}
    speeds = [scenario.ego_speed * 3.6 for scenario in drawn]
    assert 80.0 <= min(speeds) < 85.0
    assert 125.0 < max(speeds) <= 130.0


def test_close_brake_releases_leave_room():
    """The lead car takes at most 60 % of a headway of 1 to 2 s before it regains its speed."""
    for level in range(300):
        scenario = draw_scenario(level_generator("train", level), ["CloseBrakeRelease"])
        lead = scenario.actors[0]
        assert 1.0 <= lead.gap / scenario.ego_speed <= 2.0
        drop = lead.speed - lead.profile[0].final_speed
        assert 1.0 < drop <= 6.0
        assert drop**2 / RELEASE < 0.61 * lead.gap


def test_narrow_boxes_are_narrow():
    for level in range(300):
        (box,) = draw_scenario(level_generator("train", level), ["NarrowBox"]).actors
        assert (box.kind, 0.3 <= box.width <= 1.2) == ("box", True)


def test_decelerations_replace_those_of_the_worlds():
    usual, drawn = random_env(split="validation"), random_env(split="validation", decelerations=(4.5, 10.0))
    decelerations = []
    for seed in range(100):
        (_, info), (_, other) = usual.reset(seed=seed), drawn.reset(seed=seed)
        assert info == other
        assert replace(drawn.brake, max_deceleration=usual.brake.max_deceleration) == usual.brake
        decelerations.append(drawn.brake.max_deceleration)
    assert 4.5 <= min(decelerations) < 5.0
    assert 9.5 < max(decelerations) <= 10.0
    wet = [drawn.reset(seed=seed)[1]["condition"] == "rain" for seed in range(100)]
    assert max(np.array(decelerations)[wet]) > 8.0  # a wet road does not limit them


def test_levels_include_the_headways_of_fmvss127():
    """In FMVSS 127 a lead car brakes at a headway of 0.54 s."""
    cases = [dict(case.arguments) for case in find_suite("fmvss127").cases if case.family == "CCRb"]
    shortest = min(arguments["gap"] / arguments["ego_speed"] for arguments in cases)
    for name in "CCRb", "Following":
        drawn = [DECLARED[name].draw(level_generator("train", level))["headway"] for level in range(2000)]
        assert min(drawn) < shortest
        assert max(drawn) > 2.5


def test_only_threats_have_contact_without_braking():
    env = random_env(split="validation")
    families = set()
    for seed in range(70):
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


def test_levels_set_weather_and_texture_of_the_scene():
    env = gym.make("LGMD/RandomBraking-v0", camera=["fovea", "birdseye"], split="validation")
    textures = {}
    for seed in range(40):
        _, info = env.reset(seed=seed)
        used = env.get_wrapper_attr("sensors").cameras[0]["fovea"]
        assert (
            used.scene
            == env.unwrapped.scene
            == Scene(
                world=info["world"],
                weather=info["condition"],
                road="normal",
                texture=used.scene.texture,
                queue_lane=free_lane(env.unwrapped.scenario),
            )
        )
        assert info["world"] in SPLIT_WORLDS["validation"]
        frame = EgoCamera("fovea", used.scene).render(env)
        assert np.array_equal(env.get_wrapper_attr("frames")["fovea"], frame)
        textures.setdefault(info["condition"], []).append(used.scene.texture)
    assert set(textures) == set(WEATHERS)
    values = np.concatenate(list(textures.values()))
    assert 0.5 <= values.min() < 0.7 < 1.3 < values.max() <= 1.5
    env.close()


def test_the_scenario_does_not_depend_on_the_weathers():
    clear = random_env(weathers=["clear"])
    mixed = random_env()
    for seed in range(20):
        assert clear.reset(seed=seed)[1]["condition"] == "clear"
        mixed.reset(seed=seed)
        assert clear.scenario == mixed.scenario
        assert clear.scene.texture == mixed.scene.texture


def test_levels_of_all_families_are_those_of_before():
    """A level keeps its number, family and arguments in every version with the id v0."""
    levels = [draw_scenario(level_generator("train", level)) for level in range(6)]
    assert [(scenario.family, round(scenario.ego_speed, 6)) for scenario in levels] == [
        ("Oncoming", 8.90241),
        ("CurveGuardRail", 21.497453),
        ("CCRb", 16.684572),
        ("BicyclePass", 8.233679),
        ("Oncoming", 14.036758),
        ("CCFhos", 14.047752),
    ]
    for families in (None, ALL_FAMILIES[::-1]):
        chosen = [RandomLevels(start_level=level, num_levels=1, families=families) for level in range(6)]
        assert [source.first for source in chosen] == levels
        assert [source.draw(np.random.default_rng(0)).placement.scenario for source in chosen] == levels


@pytest.mark.parametrize(
    ("families", "digest"),
    [(ALL_FAMILIES, "7ad893cc8e61ce15"), ((*ALL_FAMILIES, *FIRST_EXTRAS), "2b590284d0581e5e")],
)
def test_scenarios_of_levels_are_pinned(families, digest):
    """The hash changes if a family, its order, its weight or one of its arguments does."""
    data = [
        scenario_to_data(draw_scenario(level_generator(split, level), families))
        for split in SPLITS
        for level in range(300)
    ]
    assert sha256(json.dumps(rounded(data)).encode()).hexdigest()[:16] == digest


def rounded(item):
    """Return plain data with floats of 9 digits, which do not depend on the C library."""
    if isinstance(item, dict):
        return {key: rounded(value) for key, value in item.items()}
    if isinstance(item, list):
        return [rounded(value) for value in item]
    return f"{item:.9g}" if isinstance(item, float) else item


@pytest.mark.parametrize(
    ("families", "threats"),
    [
        (["CCRs", "Following", "CutOut"], 0.5),
        (["CCRs", "CCRb"], 1.0),
        (["Following", "CutOut"], 0.0),
        (["CPFA"], 1.0),
    ],
)
def test_families_restrict_the_levels(families, threats):
    drawn = [draw_scenario(level_generator("train", level), families).family for level in range(400)]
    assert set(drawn) == set(families)
    assert np.mean([family in THREATS for family in drawn]) == pytest.approx(threats, abs=0.07)


def test_families_keep_their_relative_frequencies():
    drawn = [draw_scenario(level_generator("train", level), ["CCRs", "CPRA"]).family for level in range(400)]
    assert drawn.count("CPRA") == pytest.approx(400 / 16, abs=12)


def test_the_easy_task_has_cars_on_a_straight_and_even_road():
    name, defaults = env_id("RandomBrakingEasy"), RANDOM_TASKS["RandomBrakingEasy"].arguments
    env = gym.make(name, camera=None)
    families, worlds = set(), set()
    for seed in range(60):
        info = env.reset(seed=seed)[1]
        scenario, scene = env.unwrapped.scenario, env.unwrapped.scene
        assert (scenario.road.kind, info["condition"], scene.road) == ("straight", "clear", "smooth")
        families.add(scenario.family)
        worlds.add(info["world"])
    assert families == set(defaults["families"])
    assert len(worlds) > 30
    assert worlds < set(SPLIT_WORLDS["train"])
    changed = gym.make(name, camera=None, families=["CMRs"], weathers=["fog"], split="validation")
    assert changed.reset(seed=0)[1]["condition"] == "fog"
    assert changed.unwrapped.scenario.family == "CMRs"
    same = gym.make("LGMD/RandomBraking-v0", camera=None, **defaults)
    for seed in range(5):
        assert same.reset(seed=seed)[1] == env.reset(seed=seed)[1]
        assert same.unwrapped.scenario == env.unwrapped.scenario


@pytest.mark.parametrize(
    ("name", "arguments"), [("RandomBrakingEasy", {}), ("RandomBraking", {"families": ["CCRs", "CutOut"]})]
)
def test_the_engine_draws_the_same_families(name, arguments):
    envs = gym.make_vec(env_id(name), num_envs=6, camera=None, **arguments)
    single = gym.make(env_id(name), camera=None, **arguments)
    _, infos = envs.reset(seed=3)
    for index in range(6):
        info = single.reset(seed=3 + index)[1]
        assert {key: infos[key][index] for key in ("level", "world", "gap", "ego_speed")} == {
            key: info[key] for key in ("level", "world", "gap", "ego_speed")
        }
    envs.close()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"split": "tain"}, "unknown split 'tain'; did you mean 'train'"),
        ({"start_level": -1}, r"start_level must be a whole number in \[0, 999999\], got -1"),
        ({"start_level": LEVELS - 1, "num_levels": 2}, r"num_levels must be a whole number in \[0, 1\]"),
        ({"levels": 3}, "'num_levels'"),
        ({"weathers": ["clear", "foggy"]}, "unknown weather 'foggy'; did you mean 'fog'"),
        ({"weathers": []}, "weathers needs at least one name"),
        ({"weather": "night"}, "unknown argument of RandomBraking 'weather'; did you mean 'weathers'"),
        ({"ego_speed": 3.0}, "unknown argument of RandomBraking 'ego_speed'"),
        ({"families": ["CCRs", "Folowing"]}, "family of random levels 'Folowing'; did you mean 'Following'"),
        ({"families": []}, "families needs at least one name, got none"),
        ({"families": "CCRs"}, "families must be a list of str, got 'CCRs'"),
    ],
)
def test_errors_state_the_value_and_suggest_a_fix(arguments, words):
    with pytest.raises(ValueError, match=words):
        gym.make("LGMD/RandomBraking-v0", **arguments)
