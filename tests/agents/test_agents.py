"""Agents by themselves: strings, latches, chance, and that only oracles are told the truth."""

from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
import pytest

import lgmd_gym  # noqa: F401
from lgmd_gym.agents import AGENTS, Rule, make_agent
from lgmd_gym.agents.options import parse
from lgmd_gym.benchmark.sensors import SensorConfig

SIGHTED = [name for name in AGENTS if issubclass(AGENTS[name], Rule)]
GOOD = [*AGENTS, "spike-threshold:threshold=45.5,frames=2", "random-brake:rate=1", "ttc-oracle:ttc=2.5"]


class Frame(NamedTuple):
    response: Any
    ego_speed: float


class Said(NamedTuple):
    spike_frequency: Any
    membrane_potential: Any


def seen(*frequencies, trace=False, cameras=1, potential=0.5, speed=8.0, yaw_rate=0.0):
    observation = {
        "spike_frequency": np.full(cameras, frequencies[-1], np.float32),
        "membrane_potential": np.full(cameras, potential, np.float32),
        "ego_speed": np.array([speed], np.float32),
        "ego_yaw_rate": np.array([yaw_rate], np.float32),
        "frame": np.zeros((90, 160, cameras), np.uint8),
    }
    info = {"lgmd/alert": frequencies[-1] >= 30, "ttc": float("nan")}
    info |= {name: float("nan") for name in ("gap", "target_speed", "ego_speed")}
    if trace:
        said = [Said(np.full(cameras, value), observation["membrane_potential"]) for value in frequencies]
        info["lgmd/trace"] = [Frame(item, speed) for item in said]
    return observation, info


def cameras_of(agent):
    return len(agent.camera) if isinstance(agent.camera, list) else 1


@pytest.mark.parametrize("text", GOOD)
def test_agents_answer_with_a_demand(text):
    agent = make_agent(text)
    agent.reset(0)
    action = agent.act(*seen(0.0, cameras=cameras_of(agent)))
    assert action.shape == (1,)
    assert action.dtype == np.float32
    assert -1.0 <= action[0] <= 1.0
    assert text.startswith(agent.name)


def test_options_reach_the_agent():
    agent = make_agent("spike-threshold:threshold=45.5,frames=2")
    assert (agent.params.threshold, agent.params.frames) == (45.5, 2)
    assert parse("a:b=1e2") == ("a", {"b": 100.0})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("spike-treshold", "unknown agent 'spike-treshold'; did you mean 'spike-threshold'"),
        ("", "unknown agent ''; known: adaptive-threshold"),
        ("spike-threshold:treshold=3", "did you mean 'threshold'"),
        ("spike-threshold:threshold", "write threshold=VALUE"),
        ("spike-threshold:threshold=high", "threshold must be a number > 0, got 'high'"),
        ("spike-threshold:threshold=-1", "threshold must be a number > 0, got -1"),
        ("spike-threshold:frames=1.5", "frames must be a whole number >= 1, got 1.5"),
        ("random-brake:rate=0", "rate must be a number > 0, got 0"),
        ("no-brake:x=1", "unknown option of agent no-brake 'x'"),
    ],
)
def test_bad_strings_are_refused_with_the_mend(text, words):
    with pytest.raises(ValueError, match=words):
        make_agent(text)


def test_spike_threshold_latches_and_forgets_at_reset():
    agent = make_agent("spike-threshold:threshold=30")
    demands = [float(agent.act(*seen(value))[0]) for value in (0, 29.9, 30, 0, 0)]
    assert demands == [0, 0, -1, -1, -1]
    agent.reset(0)
    assert agent.act(*seen(0.0))[0] == 0


def test_spike_threshold_counts_consecutive_frames():
    agent = make_agent("spike-threshold:frames=3")
    demands = [float(agent.act(*seen(value))[0]) for value in (40, 40, 0, 40, 40, 40)]
    assert demands == [0, 0, 0, 0, 0, -1]


def test_spike_threshold_sees_every_frame_of_a_trace():
    agent = make_agent("spike-threshold:frames=2")
    assert agent.act(*seen(40, 0, 40, trace=True))[0] == 0
    assert agent.act(*seen(40, 0, trace=True))[0] == -1


def test_alert_is_the_neurons_but_for_the_oracle():
    agent, oracle = make_agent("no-brake"), make_agent("ttc-oracle")
    for one in (agent, oracle):
        one.act(*seen(40.0))
    assert agent.alert
    assert not oracle.alert
    oracle.act({"spike_frequency": np.zeros(1)}, {"ttc": 1.0})
    assert oracle.alert


def test_random_brake_keeps_its_rate_and_seed():
    agent = make_agent("random-brake:rate=0.5")

    def onset(seed):
        agent.reset(seed)
        return next(k for k in range(3000) if agent.act(*seen(0.0))[0] < 0) / 30

    onsets = [onset(seed) for seed in range(400)]
    assert np.mean(onsets) == pytest.approx(2.0, rel=0.15)
    assert onset(7) == onsets[7]


@pytest.mark.parametrize("text", [name for name in AGENTS if "oracle" not in name])
def test_no_truth_reaches_an_agent_that_is_no_oracle(text):
    """Shuffled and spoilt ground truth (all of `info` but `lgmd/`) changes no action."""
    rng = np.random.default_rng(0)
    actions = []
    for spoil in (False, True):
        agent = make_agent(text)
        env = gym.make("LGMD/CCRs-v0", ego_speed=8.0, trace=True, **SensorConfig().for_agent(agent).arguments)
        observation, info = env.reset(seed=1)
        agent.reset(1)
        taken = []
        for _ in range(160):
            if spoil:
                truth = [key for key in info if not key.startswith("lgmd/")]
                values = [*(info[key] for key in truth[1:]), float(rng.normal())]
                info = info | dict(zip(truth, rng.permutation(values).tolist(), strict=True))
            action = agent.act(observation, info)
            taken.append(float(action[0]))
            observation, _, terminated, truncated, info = env.step(action)
            if terminated or truncated:
                break
        actions.append(taken)
    assert actions[0] == actions[1]
    if text in SIGHTED:
        assert min(actions[0]) < 0.0, "an agent that never brakes shows nothing here"


class Mine:
    """A user's agent with nothing but `act`."""

    def __init__(self, level=20.0):
        self.level = level

    def act(self, observation, info):
        return -0.5 if observation["spike_frequency"].max() > self.level else 0.0


def test_a_users_own_agent():
    agent = make_agent(f"{__name__}:Mine:level=35")
    agent.reset(0)
    assert agent.name == f"{__name__}:Mine"
    assert agent.act(*seen(30.0)) == np.float32([0.0])
    assert agent.alert  # the neuron's
    assert agent.act(*seen(40.0)) == np.float32([-0.5])


@pytest.mark.parametrize("answer", [float("nan"), [0.0, 1.0], []])
def test_a_users_agent_that_answers_nonsense_is_told(answer):
    agent = make_agent(f"{__name__}:Mine")
    agent.agent.act = lambda observation, info: answer
    with pytest.raises(ValueError, match="must act with one finite number"):
        agent.act(*seen(0.0))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nowhere.at_all:Agent", "cannot be imported"),
        ("math:Agent", "cannot be imported"),
        ("collections:OrderedDict", "has no method act"),
        (f"{__name__}:Mine:levle=3", "did you mean 'level'"),
    ],
)
def test_bad_users_agents_are_refused(text, words):
    with pytest.raises(ValueError, match=words):
        make_agent(text)
