"""Properties of all agents: actions, alerts, chance level, and no access to ground truth."""

import gymnasium as gym
import numpy as np
import pytest
from support.agents import make_step, run_agent

import lgmd_gym  # noqa: F401
from lgmd_gym.agents import AGENTS, Rule, make_agent
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.fields import declarations

RULES = [name for name in AGENTS if issubclass(AGENTS[name], Rule)]


def test_every_action_is_one_float32_in_the_range_of_demands():
    wrong = []
    for name in AGENTS:
        agent = make_agent(name)
        agent.reset(0)
        cameras = len(agent.camera) if isinstance(agent.camera, list) else 1
        action = agent.act(*make_step(0.0, cameras=cameras))
        if (action.shape, action.dtype) != ((1,), np.float32) or not -1.0 <= action[0] <= 1.0:
            wrong.append((name, action))
    assert wrong == []


def test_always_brake_and_no_brake_are_constant():
    steps = [make_step(0.0), make_step(300.0)]
    assert run_agent(make_agent("no-brake"), *steps) == [0.0, 0.0]
    assert run_agent(make_agent("always-brake"), *steps) == [-1.0, -1.0]


def test_the_alert_is_that_of_the_neuron_except_for_oracles():
    agent, oracle = make_agent("no-brake"), make_agent("ttc-oracle")
    for each in (agent, oracle):
        each.act(*make_step(40.0))
    assert agent.alert
    assert not oracle.alert
    oracle.act(*make_step(0.0, ttc=1.0))
    assert oracle.alert


def test_random_brake_has_its_mean_onset_and_is_seeded():
    agent = make_agent("random-brake:rate=0.5")

    def onset(seed):
        agent.reset(seed)
        return next(k for k in range(3000) if agent.act(*make_step(0.0))[0] < 0) / 30

    onsets = [onset(seed) for seed in range(400)]
    assert np.mean(onsets) == pytest.approx(2.0, rel=0.15)
    assert onset(7) == onsets[7]


@pytest.mark.parametrize("name", [name for name in AGENTS if "oracle" not in name])
def test_ground_truth_does_not_change_the_actions(name):
    """All values of `info` outside `lgmd/` are shuffled, and one is replaced."""
    rng = np.random.default_rng(0)
    actions = []
    for shuffled in (False, True):
        agent = make_agent(name)
        sensors = SensorConfig().for_agent(agent)
        env = gym.make("LGMD/CCRs-v0", ego_speed=8.0, trace=True, world="laboratory", **sensors.arguments)
        observation, info = env.reset(seed=1)
        agent.reset(1)
        actions.append([])
        for _ in range(160):
            if shuffled:
                truth = [key for key in info if not key.startswith("lgmd/")]
                values = [*(info[key] for key in truth[1:]), float(rng.normal())]
                info = info | dict(zip(truth, rng.permutation(values).tolist(), strict=True))
            action = agent.act(observation, info)
            actions[-1].append(float(action[0]))
            observation, _, terminated, truncated, info = env.step(action)
            if terminated or truncated:
                break
        env.close()
    assert actions[0] == actions[1]
    if name in RULES:
        assert min(actions[0]) < 0.0, "the rule never brakes, so that the test shows nothing"


def test_default_parameters_are_within_their_search_ranges():
    wrong = []
    for name in RULES:
        for item in declarations(AGENTS[name].Params):
            low, high = item.search or (item.default, item.default)  # not tuned
            if not low <= item.default <= high:
                wrong.append(f"{name}: {item.name} = {item.default} outside [{low}, {high}]")
    assert wrong == []
