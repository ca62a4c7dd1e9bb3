"""Networks that a card describes are built and loaded without unpickling, and equal those of the model."""

import base64
import json
import os
import pickle
import zipfile
from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces
from support.policies import INPUTS, write_policy

from lgmd_gym.agents import make_agent
from lgmd_gym.agents.policies.card import CARD, write_card
from lgmd_gym.agents.policies.features import announce_pickle
from lgmd_gym.agents.policies.network import NetworkSpec, describe_network

pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3 import DQN, PPO, SAC, TD3
from stable_baselines3.common.torch_layers import CombinedExtractor

torch.set_num_threads(1)  # small networks
SPEED = spaces.Box(-5.0, 5.0, (3,))
FRAME = spaces.Box(0, 255, (40, 44, 2), np.uint8)
ONE = spaces.Box(-1.0, 1.0, (1,))
THREE = spaces.Discrete(3)


class Blank(gym.Env):
    """Environment that has nothing but spaces."""

    def __init__(self, actions, **inputs):
        self.observation_space, self.action_space = spaces.Dict(inputs), actions


def make(algorithm, env, **kwargs):
    return algorithm("MultiInputPolicy", env, seed=0, device="cpu", policy_kwargs=kwargs)


MODELS = {
    "ppo": lambda: make(PPO, Blank(THREE, ego_speed=SPEED), net_arch=[8], activation_fn=torch.nn.ELU),
    "ppo, frame": lambda: make(PPO, Blank(ONE, frame=FRAME, ego_speed=SPEED), optimizer_kwargs={"eps": 1e-4}),
    "dqn": lambda: make(DQN, Blank(THREE, ego_speed=SPEED), net_arch=[8, 4]),
    "sac": lambda: make(SAC, Blank(ONE, ego_speed=SPEED), net_arch=[8]),
    "td3": lambda: make(TD3, Blank(ONE, ego_speed=SPEED), net_arch={"pi": [8], "qf": [4]}),
    "ppo, sde": lambda: PPO("MultiInputPolicy", Blank(ONE, ego_speed=SPEED), use_sde=True, device="cpu"),
}  # fmt: skip


@pytest.mark.parametrize("name", MODELS)
def test_the_network_of_the_card_acts_as_the_model(name, tmp_path):
    model, rng = MODELS[name](), np.random.default_rng(0)
    with torch.no_grad():
        for parameter in model.policy.parameters():
            parameter.add_(torch.randn_like(parameter))
    model.save(tmp_path / "model.zip")
    state = torch.get_rng_state()
    spec = describe_network(model)
    algo, count = type(model).__name__.lower(), getattr(model.action_space, "n", None)
    network = NetworkSpec.make(json.loads(json.dumps(spec.to_dict()))).load(
        tmp_path / "model.zip", algo, count
    )
    assert torch.equal(torch.get_rng_state(), state)  # saving a policy does not change the rest of a training
    assert not network.training
    space, actions = spaces.Dict(ego_speed=SPEED, frame=FRAME), []
    space.seed(0)
    for _ in range(20):
        sample = {key: space[key].sample() for key in model.observation_space.spaces}
        sample["ego_speed"] = rng.normal(size=3).astype(np.float32)
        actions.append(model.predict(sample, deterministic=True)[0])
        assert np.array_equal(network.predict(sample, deterministic=True)[0], actions[-1])
    assert len(np.unique(actions)) > 1


class OwnExtractor(CombinedExtractor):
    pass


@pytest.mark.parametrize(("env", "kwargs"), [
    (Blank(ONE, ego_speed=SPEED), {"features_extractor_class": OwnExtractor}),
    (Blank(ONE, ego_speed=SPEED), {"activation_fn": lambda: torch.nn.ReLU()}),
    (Blank(ONE, frame=spaces.Box(0.0, 1.0, (3,))), {}),
    (Blank(spaces.Box(-1.0, 1.0, (2,)), ego_speed=SPEED), {}),
])  # fmt: skip
def test_other_networks_are_not_described(env, kwargs):
    assert describe_network(make(PPO, env, **kwargs)) is None


class Attack:
    """Its unpickling prints a line."""

    def __reduce__(self):
        return os.write, (2, b"executed\n")


@pytest.fixture(scope="module")
def policy(tmp_path_factory):
    return write_policy(tmp_path_factory.mktemp("policy") / "small.zip")


def attack(policy, path, **changes):
    """Write a policy with a malicious pickle among its data and a changed card."""
    with zipfile.ZipFile(policy) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            data = source.read(name)
            if name == "data":
                values = json.loads(data)
                payload = base64.b64encode(pickle.dumps(Attack())).decode()
                values["observation_space"][":serialized:"] = payload
                data = json.dumps(values)
            if name != CARD:
                target.writestr(name, data)
        card = json.loads(source.read(CARD))
    write_card(path, card | changes)
    return path


def test_a_pickle_in_the_file_of_a_described_network_is_not_executed(policy, tmp_path, capfd):
    agent = make_agent(f"policy:{attack(policy, tmp_path / 'policy.zip')}")
    assert capfd.readouterr().err == ""
    original = make_agent(f"policy:{policy}").agent.network.state_dict()
    assert all(torch.equal(value, original[name]) for name, value in agent.agent.network.state_dict().items())


def test_a_line_precedes_the_execution_of_a_pickle(policy, tmp_path, capfd):
    path = attack(policy, tmp_path / "policy.zip", network=None)
    line = f"lgmd-gym: loading {str(path)!r} executes the pickled code in this file\n"
    for expected in (line + "executed\n", "executed\n"):
        with pytest.raises(ValueError, match="cannot be loaded"):
            make_agent(f"policy:{path}")
        assert capfd.readouterr().err == expected


@pytest.mark.filterwarnings("ignore:Detected pickle protocol")
def test_weights_are_not_unpickled(policy, tmp_path, capfd):
    path = tmp_path / "policy.zip"
    with zipfile.ZipFile(policy) as source, zipfile.ZipFile(path, "w") as target:
        target.writestr(CARD, source.read(CARD))
        target.writestr("policy.pth", pickle.dumps(Attack()))
    with pytest.raises(ValueError, match="cannot be loaded"):
        make_agent(f"policy:{path}")
    assert "executed" not in capfd.readouterr().err


NETWORK = {"policy": "MultiInputPolicy", "policy_kwargs": {"net_arch": {"pi": [64, 64], "vf": []}}}


@pytest.mark.parametrize(("changes", "words"), [
    ({"inputs": INPUTS | {"zones": [70]}}, r"shape \(64, 70\), those of the card \(64, 72\)"),
    ({"inputs": INPUTS | {"zones": ["68"]}}, "shape of zones must be"),
    ({"inputs": INPUTS | {"zones": [10**9]}}, "shape of zones must be"),
    ({"inputs": {"ego_speed": [2], "zones": [68]}}, "model and card do not belong together"),
    ({"policy_kwargs": {"net_arch": [8]}}, "the weights mlp_extractor.policy_net.0.weight have the shape"),
    ({"policy_kwargs": {"net_arch": [10**9]}}, "numbers of policy_kwargs must be at most 10000"),
    ({"policy_kwargs": {"nett_arch": [8]}}, "did you mean 'net_arch'"),
    ({"policy_kwargs": {"activation_fn": "Relu"}}, "did you mean 'ReLU'"),
    ({"policy": "MultiInput"}, "did you mean 'MultiInputPolicy'"),
    ({"name": 7}, "unknown network field 'name'"),
])  # fmt: skip
def test_a_wrong_description_is_refused(policy, tmp_path, capfd, changes, words):
    path = attack(policy, tmp_path / "policy.zip", network=NETWORK | {"inputs": INPUTS} | changes)
    with pytest.raises(ValueError, match=words) as caught:
        make_agent(f"policy:{path}")
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)
    assert capfd.readouterr().err == ""


def test_worker_processes_print_no_line(tmp_path, capsys, monkeypatch):
    worker = SimpleNamespace(name="worker")
    monkeypatch.setattr("lgmd_gym.agents.policies.features.current_process", lambda: worker)
    announce_pickle(tmp_path / "policy.zip")
    assert capsys.readouterr().err == ""
