"""Limits of steps, attributes of single environments, and arguments that change between episodes."""

import copy
import pickle

import gymnasium as gym
import numpy as np
import pytest

import lgmd_gym  # noqa: F401  (registers the environments)

LABORATORY = {"world": "laboratory", "camera": None}


def make(num_envs=2, env_id="LGMD/CCRs-v0", **arguments):
    return gym.make_vec(env_id, num_envs=num_envs, **(LABORATORY | arguments))


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_limit_of_steps_is_that_of_gymnasium(mode):
    options = {"max_episode_steps": 4, "vector_kwargs": {"autoreset_mode": gym.vector.AutoresetMode(mode)}}
    single = make(vectorization_mode="sync", **options)
    engine = make(max_episode_steps=4, autoreset_mode=mode)
    for envs in (single, engine):
        envs.reset(seed=3)
    for step in range(13):
        theirs, ours = (envs.step(np.zeros((2, 1), np.float32)) for envs in (single, engine))
        assert np.array_equal(theirs[3], ours[3]), step
        assert np.array_equal(theirs[0], ours[0])
        assert ("final_obs" in theirs[4]) == ("final_obs" in ours[4])


def test_limit_of_steps_applies_to_the_decisions_of_a_policy():
    pytest.importorskip("stable_baselines3")
    from lgmd_gym.agents.policies.features import FeatureConfig
    from lgmd_gym.training.policy_env import PolicyVecEnv

    features = FeatureConfig(inputs=("membrane_potential",), history=1, repeat=2)
    engine = make(max_episode_steps=3, autoreset_mode="Disabled", camera="fovea").unwrapped
    envs = PolicyVecEnv(engine, features)
    envs.seed(0)
    envs.reset()
    for _ in range(2):  # episodes of two and one decisions of the environment
        assert not envs.step(np.zeros((2, 1), np.float32))[2].any()
        _, _, done, infos = envs.step(np.zeros((2, 1), np.float32))
        assert done.all()
        assert [info["TimeLimit.truncated"] for info in infos] == [True, True]


@pytest.mark.parametrize("limit", [0, 1.5, True])
def test_limit_must_be_a_positive_number(limit):
    with pytest.raises(ValueError, match="max_episode_steps"):
        make(max_episode_steps=limit)


@pytest.mark.parametrize("name", ["scenario", "scene", "brake"])
def test_attributes_are_those_of_single_environments(name):
    arguments = {"env_id": "LGMD/RandomBraking-v0", "camera": None, "world": None}
    single, engine = make(**arguments, vectorization_mode="sync"), make(**arguments)
    for envs in (single, engine):
        envs.reset(seed=8)
    assert engine.unwrapped.get_attr(name) == single.get_attr(name)
    assert engine.unwrapped.call(name) == single.get_attr(name)


def test_shared_attributes_and_refusals():
    envs = make(render_mode="rgb_array").unwrapped
    assert envs.get_attr("render_mode") == ("rgb_array",) * 2
    assert envs.get_attr("action_space") == (envs.single_action_space,) * 2
    with pytest.raises(RuntimeError, match="reset"):
        envs.get_attr("scenario")
    with pytest.raises(AttributeError, match="known: scenario, scene"):
        envs.get_attr("speed")
    for name in ("reset", "set_arguments", "_elapsed"):  # of the vector
        with pytest.raises(AttributeError, match="no attribute"):
            envs.get_attr(name)
    with pytest.raises(AttributeError, match="set_arguments"):
        envs.set_attr("ego_speed", 5.0)
    with pytest.raises(AttributeError, match="method of the vector"):
        envs.call("reset")
    envs.reset(seed=0)
    assert [picture.shape[2] for picture in envs.call("render")] == [3, 3]


@pytest.mark.parametrize("threads", [1, 2])
def test_arguments_apply_from_the_next_episode_on(threads):
    envs = make(ego_speed=9.0, threads=threads, autoreset_mode="Disabled").unwrapped
    assert envs.reset(seed=0)[1]["ego_speed"].tolist() == [9.0, 9.0]
    envs.set_arguments([{"ego_speed": 5.0}, None])
    assert envs.step(np.zeros((2, 1)))[4]["ego_speed"].tolist() == [9.0, 9.0]
    assert envs.reset(seed=0)[1]["ego_speed"].tolist() == [5.0, 9.0]
    envs.set_arguments({"ego_speed": 7.0}, np.array([False, True]))
    assert envs.reset(seed=0)[1]["ego_speed"].tolist() == [5.0, 7.0]
    envs.set_arguments({})  # those of the construction
    assert envs.reset(seed=0)[1]["ego_speed"].tolist() == [9.0, 9.0]
    envs.close()


def test_changed_levels_are_those_of_an_environment_made_with_them():
    changed = make(env_id="LGMD/RandomBraking-v0", world=None).unwrapped
    changed.reset(seed=1)
    changed.set_arguments({"start_level": 50, "num_levels": 3})
    made = make(env_id="LGMD/RandomBraking-v0", world=None, start_level=50, num_levels=3)
    assert changed.reset(seed=1)[1]["level"].tolist() == made.reset(seed=1)[1]["level"].tolist()
    assert set(changed.reset(seed=2)[1]["level"].tolist()) <= {50, 51, 52}


@pytest.mark.parametrize(
    ("arguments", "selected", "message"),
    [
        ({"ego_sped": 5.0}, None, "did you mean 'ego_speed'"),
        ({"ego_speed": 50.0 * 3.6}, None, "ego_speed"),
        (None, None, "a mapping or a list of mappings, got None"),
        ([{"ego_speed": 5.0}], None, "one mapping or 2 mappings, got 1"),
        ({"ego_speed": 5.0}, [True, False], "selected must be a bool array"),
        ([{"ego_speed": 5.0}, {"num_envs": 3}], None, "num_envs"),
    ],
)
def test_refused_arguments_change_nothing(arguments, selected, message):
    envs = make(ego_speed=9.0).unwrapped
    with pytest.raises(ValueError, match=message):
        envs.set_arguments(arguments, selected)
    assert envs.reset(seed=0)[1]["ego_speed"].tolist() == [9.0, 9.0]


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda envs: pickle.loads(pickle.dumps(envs))])
def test_copies_of_an_engine_with_threads_continue_as_it_does(duplicate):
    envs = make(threads=2, camera="fovea", max_episode_steps=6)
    envs.reset(seed=4)
    envs.step(np.zeros((2, 1)))
    twin = duplicate(envs)
    for _ in range(8):
        ours, theirs = envs.step(np.zeros((2, 1))), twin.step(np.zeros((2, 1)))
        assert np.array_equal(ours[0]["membrane_potential"], theirs[0]["membrane_potential"])
        assert np.array_equal(ours[3], theirs[3])
    for each in (envs, twin):
        each.close()


def test_methods_of_stable_baselines3():
    pytest.importorskip("stable_baselines3")
    from lgmd_gym.engine import SB3VecEnv

    envs = SB3VecEnv("LGMD/CCRs-v0", num_envs=2, **LABORATORY)
    envs.seed(0)
    envs.reset()
    assert [scenario.family for scenario in envs.get_attr("scenario", [1])] == ["CCRs"]
    envs.env_method("set_arguments", {"ego_speed": 5.0}, indices=[1])
    envs.reset()
    assert [scenario.ego_speed == 5.0 for scenario in envs.get_attr("scenario")] == [False, True]


@pytest.mark.parametrize("env_id", ["LGMD/CCRs-v0", "LGMD/Traffic-Highway-v0"])
def test_unknown_options_of_a_reset_are_refused(env_id):
    if env_id not in gym.registry:
        pytest.skip(f"{env_id} is not registered")
    env = gym.make(env_id, camera=None)
    with pytest.raises(ValueError, match="unknown option 'ego_speed'"):
        env.reset(options={"ego_speed": 5.0})
