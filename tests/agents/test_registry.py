"""Agent strings, the registry, and agents of the user."""

import random

import numpy as np
import pytest
from support.agents import make_step, run_agent

from lgmd_gym.agents import AGENTS, BatchAgent, make_agent, make_agents, register_agent
from lgmd_gym.agents.base import Agent
from lgmd_gym.agents.rules import FrequencyRule, SpikeThresholdParams
from lgmd_gym.agents.user_agents import parse_agent

USER_AGENT = f"{__name__}:Threshold"


class Threshold:
    """A user's agent with nothing but `act`."""

    def __init__(self, level=20.0):
        self.level = level

    def act(self, observation, info):
        return -0.5 if observation["spike_frequency"].max() > self.level else 0.0


class MyRule(FrequencyRule):
    """A user's rule with the parameters of another one."""

    name, Params = "mine", SpikeThresholdParams


class Gain(FrequencyRule):
    """A user's rule with a constructor of its own."""

    name, Params = "gain", SpikeThresholdParams

    def __init__(self, gain=1.0):
        super().__init__()
        self.gain = 1.0 / gain


class Derived(Agent):
    """What earlier versions expected of a user."""


def test_options_of_a_users_rule_are_its_parameters():
    assert make_agent(f"{__name__}:MyRule:threshold=45.5").agent.params.threshold == 45.5
    with pytest.raises(ValueError, match="unknown option of agent mine 'treshold'; did you mean 'threshold'"):
        make_agent(f"{__name__}:MyRule:treshold=45.5")


def test_errors_of_a_users_rule_name_it():
    assert make_agent(f"{__name__}:Gain:gain=2").agent.gain == 0.5
    with pytest.raises(ValueError, match=r"unknown option of agent .*:Gain 'gian'; did you mean 'gain'"):
        make_agent(f"{__name__}:Gain:gian=2")
    with pytest.raises(ValueError, match=r"Gain. cannot be created .ZeroDivisionError"):
        make_agent(f"{__name__}:Gain:gain=0")


def test_a_subclass_of_the_adapter_is_refused():
    with pytest.raises(ValueError, match=r"must not be a subclass of Agent.*derive it from BatchAgent"):
        make_agent(f"{__name__}:Derived")


def test_parse_agent_returns_name_and_typed_options():
    assert parse_agent("no-brake") == ("no-brake", {})
    assert parse_agent("a:b=1e2,c=3,d=x.toml") == ("a", {"b": 100.0, "c": 3, "d": "x.toml"})


def test_options_are_passed_to_the_agent():
    agent = make_agent("spike-threshold:threshold=45.5,frames=2")
    assert (agent.agent.params.threshold, agent.agent.params.frames) == (45.5, 2)
    assert make_agent("ttc-oracle:ttc=2.5").agent.ttc == 2.5


def test_options_from_a_file_are_overridden_by_the_string(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("ground = 2.5\nframes = 4\n")
    agent = make_agent(f"stopping-zone:toml={file},frames=5")
    params = agent.agent.params
    assert (params.ground, params.frames, params.upright) == (2.5, 5, 0.6)
    for text, message in (("grund = 2.5\n", "did you mean 'ground'"), ("ground =\n", "is not TOML")):
        file.write_text(text)
        with pytest.raises(ValueError, match=message):
            make_agent(f"stopping-zone:toml={file}")
    with pytest.raises(ValueError, match="cannot be read"):
        make_agent(f"stopping-zone:toml={tmp_path / 'none.toml'}")


def test_registered_names_are_the_names_of_the_agents():
    assert [name for name, cls in AGENTS.items() if make_agent(name).name != name or cls.name != name] == []


def test_a_duplicate_name_is_rejected():
    class Duplicate(BatchAgent):
        name = "no-brake"

    with pytest.raises(ValueError, match="agent 'no-brake' is already registered"):
        register_agent(Duplicate)
    assert AGENTS["no-brake"] is not Duplicate


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("spike-treshold", "unknown agent 'spike-treshold'; did you mean 'spike-threshold'"),
        ("", "unknown agent ''; known: adaptive-threshold"),
        ("no-brake,ttc-oracle", "contains a comma before its options; separate agents by spaces"),
        ("spike-threshold:treshold=3", "did you mean 'threshold'"),
        ("spike-threshold:threshold", "write threshold=VALUE"),
        ("spike-threshold:threshold=high", "threshold must be a number, got 'high'"),
        ("spike-threshold:threshold=-1", r"threshold must be in \(0, inf\) spikes/s, got -1"),
        ("spike-threshold:frames=1.5", r"frames must be a whole number in \[1, inf\), got 1.5"),
        ("random-brake:rate=0", "rate must be a number > 0, got 0"),
        ("no-brake:x=1", "unknown option of agent no-brake 'x'"),
        ("nowhere.at_all:Agent", "cannot be imported"),
        ("my_detector", "; an agent of your own is MODULE:CLASS$"),
        ("my_detector.py:Agent", "write the name of its module without .py$"),
        (f"{__name__}:OnlyObservation", r"act\(self, observation, info\), got act\(observation\)$"),
        (f"{__name__}:OtherReset", r"must have the method reset\(self, seed\), got reset\(\)$"),
        (f"{__name__}:TextFlag", "include_frame must be true or false, got 'no'"),
        ("stopping-zone:reach=0.2", r"reach must be in \[0.28, inf\), got 0.2"),
        (
            "spike-threshold:threshold=45,threshold=60",
            "option 'threshold' occurs twice in 'spike",
        ),
        (f"{__name__}:WithoutWeights", r"cannot be created \(FileNotFoundError: weights.npy, test_reg"),
        ("math:Agent", "unknown agent class 'math:Agent'; known: none"),
        ("collections:OrderedDict", "has no method act"),
        (f"{USER_AGENT}:levle=3", "did you mean 'level'"),
    ],
)
def test_an_invalid_string_is_rejected(text, message):
    with pytest.raises(ValueError, match=message):
        make_agent(text)


def test_private_classes_of_a_module_are_not_suggested(monkeypatch):
    monkeypatch.setattr("math._Private", int, raising=False)
    with pytest.raises(ValueError, match="unknown agent class 'math:Agent'; known: none"):
        make_agent("math:Agent")


class OnlyObservation:
    def act(self, observation):
        return 0.0


class OtherReset(Threshold):
    def reset(self):
        pass


class TextFlag(Threshold):
    include_frame = "no"


class WithoutWeights:
    def __init__(self):
        raise FileNotFoundError("weights.npy")

    def act(self, observation, info):
        return 0.0


@pytest.mark.parametrize(
    "action", [True, np.array([False]), None, "brake", [0.0, 0.0], float("nan"), -7.0, 1.1]
)
def test_an_action_that_is_not_one_number_is_rejected(action):
    agent = make_agent(USER_AGENT)
    agent.agent.objects[0].act = lambda observation, info: action
    with pytest.raises(ValueError, match=r"must return one number in .*, got "):
        run_agent(agent, make_step(30.0))


def test_a_user_agent_acts_with_its_options_and_the_alert_of_the_neuron():
    agent = make_agent(f"{USER_AGENT}:level=35")
    agent.reset(0)
    assert agent.name == USER_AGENT
    assert run_agent(agent, make_step(30.0)) == [0.0]
    assert agent.alert
    assert run_agent(agent, make_step(40.0)) == [-0.5]


@pytest.mark.parametrize("action", [float("nan"), [0.0, 1.0], []])
def test_a_user_agent_with_an_invalid_action_is_rejected(action):
    agent = make_agent(USER_AGENT)
    agent.agent.objects[0].act = lambda observation, info: action
    with pytest.raises(ValueError, match="must return one number in"):
        agent.act(*make_step(0.0))


def test_rounding_beyond_full_braking_is_accepted():
    agent = make_agent(USER_AGENT)
    agent.agent.objects[0].act = lambda observation, info: -1.0 - 1e-7
    assert agent.act(*make_step(0.0)) == -1.0


@pytest.mark.parametrize("name", ["observation", "info"])
def test_a_key_that_is_not_in_the_observation_or_info_suggests_the_closest(name):
    agent = make_agent(USER_AGENT)
    agent.agent.objects[0].act = lambda observation, info: {"observation": observation, "info": info}[name][
        "spike_freq"
    ]
    expected = f"unknown {name} key 'spike_freq'; did you mean 'spike_frequency'"
    with pytest.raises(KeyError, match=expected):
        agent.act({"spike_frequency": np.zeros(1)}, {"spike_frequency": 0.0})


def test_a_user_agent_receives_its_seed_as_an_int(tmp_path, monkeypatch):
    """`random.Random` refuses NumPy's integers."""
    (tmp_path / "seeded.py").write_text(
        "import random\n\n\nclass Seeded:\n"
        "    def reset(self, seed):\n        self.draw = random.Random(seed)\n\n"
        "    def act(self, observation, info):\n        return [0.0]\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    agents = make_agents("seeded:Seeded", 2)
    agents.reset(None, np.array([3, 4]))
    assert [agent.draw.random() for agent in agents.objects] == [
        random.Random(3).random(),
        random.Random(4).random(),
    ]
