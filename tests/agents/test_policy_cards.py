"""Models of stable-baselines3 that were saved by hand act as agents with a card beside them."""

import json
import os
import zipfile
from math import inf

import gymnasium as gym
import pytest
from gymnasium.wrappers import RescaleAction

import lgmd_gym
from lgmd_gym import benchmark
from lgmd_gym.agents import make_agent
from lgmd_gym.agents.policies import PolicyCard, save_card, save_policy
from lgmd_gym.agents.policies import card as card_module
from lgmd_gym.agents.policies.network import NetworkSpec
from lgmd_gym.camera import Camera

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecFrameStack, VecNormalize, unwrap_vec_normalize

from lgmd_gym.engine import SB3VecEnv
from lgmd_gym.training import PolicyWrapper
from lgmd_gym.wrappers import LGMDObservation

ID = "LGMD/RandomBraking-v0"
CONTINUOUS = {"simulation_frequency": 30, "action": {"type": "ContinuousAction", "lateral": False}}
DISCRETE = {"action": {"type": "DiscreteDemand", "demands": [0.0, -0.3, -1.0]}}


def train(envs):
    model = PPO("MultiInputPolicy", envs, n_steps=32, batch_size=64, n_epochs=1, seed=0, device="cpu")
    return model.learn(64)


ENVS = {
    "plain": lambda: SB3VecEnv(ID, num_envs=2, camera=["fovea", "wide"]),
    "normalized": lambda: VecNormalize(SB3VecEnv(ID, num_envs=2), norm_reward=False),
    "discrete": lambda: SB3VecEnv(ID, num_envs=2, config=DISCRETE),
    "wrapper": lambda: VecNormalize(
        make_vec_env(ID, 2, wrapper_class=PolicyWrapper, wrapper_kwargs={"history": 2, "repeat": 1})
    ),
}


@pytest.fixture(scope="module", params=ENVS)
def saved(request, tmp_path_factory):
    envs = ENVS[request.param]()
    model = train(envs)
    return model, envs, save_policy(model, tmp_path_factory.mktemp(request.param) / "model")


def test_the_agent_acts_as_the_model_in_its_environment(saved, capsys):
    """The model acts in its own environment, and the agent in one without wrappers, with the same seed."""
    model, envs, path = saved
    agent = make_agent(f"policy:{path}")
    assert capsys.readouterr().err == ""  # nothing is unpickled
    config = {"config": DISCRETE} if agent.agent.card.demands else {}
    own = gym.make("LGMD/CCRs-v0", ego_speed=8.0, camera=agent.camera, **config)
    features = agent.agent.card.features
    own = own if features is None else PolicyWrapper(own, **features.to_dict())
    env = gym.make("LGMD/CCRs-v0", ego_speed=8.0, camera=agent.camera)
    normalizer, demands = unwrap_vec_normalize(envs), []
    (inputs, _), (observation, info) = own.reset(seed=3), env.reset(seed=3)
    agent.reset(3)
    for _ in range(20):
        inputs = normalizer.normalize_obs(inputs) if normalizer else inputs
        action, _ = model.predict(inputs, deterministic=True)
        demand = agent.agent.card.demands[int(action)] if agent.agent.card.demands else float(action[0])
        demands.append(float(agent.act(observation, info)[0]))
        assert demands[-1] == pytest.approx(demand, abs=1e-6)
        inputs, *_ = own.step(action)
        observation, _, _, _, info = env.step([demand])
    assert agent.agent.card.demands or len(set(demands)) > 1


def test_a_margin_requires_two_demands(saved):
    """The models here choose from three demands, or a continuous one."""
    _, _, file = saved
    with pytest.raises(
        ValueError, match=r"must have two demands and action probabilities for margin=0.5; omit"
    ):
        make_agent(f"policy:{file}:margin=0.5")


def test_the_card_describes_the_training(saved):
    _, envs, path = saved
    card = make_agent(f"policy:{path}").agent.card
    assert card == PolicyCard.make(json.loads(path.with_suffix(".json").read_text()))
    assert (card.vec_normalize is not None) == (unwrap_vec_normalize(envs) is not None)
    cameras = card.camera if isinstance(card.camera, list) else [card.camera]
    shape = envs.observation_space["spike_frequency"].shape
    assert shape == (len(cameras) * (1 if card.features is None else card.features.history),)


@pytest.mark.slow
def test_a_policy_saved_by_hand_runs_in_the_benchmark(saved, tmp_path):
    config = benchmark.RunConfig(suite="r152", agents=(f"policy:{saved[2]}",), seeds=1)
    benchmark.run(config, tmp_path / "run", plots=False, report=False)
    rows = [json.loads(line) for line in (tmp_path / "run" / "episodes.jsonl").read_text().splitlines()]
    assert len(rows) == 12
    assert all(row["error"] is None for row in rows)


@pytest.fixture(scope="module")
def model():
    return train(SB3VecEnv(ID, num_envs=2))


def test_a_file_without_card_names_the_remedy(model, tmp_path):
    path = tmp_path / "best_model.zip"  # as of EvalCallback
    model.save(path)
    words = r"has no card; write .*best_model.json.* with .*save_card\(file, env"
    with pytest.raises(ValueError, match=words) as caught:
        make_agent(f"policy:{path}")
    assert "\n" not in str(caught.value)
    path.with_suffix(".json").write_text('{"algo": "ppo", "camera": "fovea"}')  # the example of the message
    assert make_agent(f"policy:{path}").camera == "fovea"


@pytest.mark.parametrize(("values", "words"), [
    ({"camera": ["fovea", "wide"]}, "the model has 1 cameras instead of 2"),
    ({"demands": [0.0, -1.0]}, "the model has continuous actions instead of 2"),
    ({"features": {"history": 2}}, "the model has inputs ego_acceleration, .* instead of"),
    ({"vec_normalize": "nix.pkl"}, "vec_normalize .*nix.pkl' cannot be read: No such file"),
    ({"vec_normalize": "nix.npz"}, "vec_normalize .*nix.npz' cannot be read: No such file"),
    ({"vec_normalize": "model.json"}, "vec_normalize .* cannot be loaded"),
    ({"vec_normalize": "../stats.pkl"}, "vec_normalize must be the name of a file beside the policy"),
    ({"vec_normalize": "/tmp/stats.npz"}, "vec_normalize must be the name of a file beside the policy"),
    ({"vec_normalize": "C:\\stats.npz"}, "vec_normalize must be the name of a file beside the policy"),
    ({"vec_normalize": "..\\stats.npz"}, "vec_normalize must be the name of a file beside the policy"),
    ({"vec_normalize": ".."}, "vec_normalize must be the name of a file beside the policy"),
    ({"vec_normalize": ""}, "vec_normalize must be the name of a file"),
    ({"vec_normalize": "pipe.npz"}, "it is a device or pipe, not a regular file"),
    ({"vec_normalize": "pipe.pkl"}, "it is a device or pipe, not a regular file"),
    ({"cameras": "fovea"}, "unknown card field 'cameras'; did you mean 'camera'?"),
    ({"demands": [2.0]}, r"demand must be in \[-1, 1\], got 2.0"),
    ({"neuron": {"t_ff": 1}}, "unknown LGMD field 't_ff'"),
])  # fmt: skip
def test_a_wrong_card_is_refused(model, values, words, tmp_path):
    path = tmp_path / "model.zip"
    model.save(path)
    path.with_suffix(".json").write_text(json.dumps({"algo": "ppo", "camera": "fovea"} | values))
    for name in ("pipe.npz", "pipe.pkl"):
        os.mkfifo(tmp_path / name)
    with pytest.raises(ValueError, match=words) as caught:
        make_agent(f"policy:{path}")
    assert "\n" not in str(caught.value)


LARGE_LAYER = {
    "inputs": {"frame": [1, 500, 500]},
    "policy_kwargs": {"features_extractor_kwargs": {"cnn_output_dim": 512}},
}
NETWORK = {"policy": "MultiInputPolicy", "inputs": {"ego_speed": [1]}, "policy_kwargs": {}}


def test_a_card_with_a_network_unpickles_nothing(tmp_path):
    """The file would run code if it were unpickled; without the network it is announced and unpickled."""
    card = {"algo": "ppo", "camera": "fovea", "network": NETWORK, "vec_normalize": "stats.pkl"}
    with pytest.raises(ValueError, match=r"must be a file \.npz of save_card .*would be unpickled"):
        PolicyCard.make(card)
    assert PolicyCard.make(card | {"vec_normalize": "stats.npz"}).vec_normalize == "stats.npz"
    assert PolicyCard.make(card | {"network": None}).vec_normalize == "stats.pkl"


@pytest.mark.parametrize(
    ("values", "fits"),
    [
        ({"policy_kwargs": {"net_arch": [7000, 7000]}}, True),  # 49,007,000 weights
        ({"policy_kwargs": {"net_arch": [7100, 7100]}}, False),  # 50,417,100
        ({"policy_kwargs": {"net_arch": [10000] * 200}}, False),
        ({"policy_kwargs": {"net_arch": {"pi": [10, 10], "vf": [10000, 10000]}}}, False),
        ({"policy_kwargs": {"net_arch": [1000, 1000], "n_critics": 60}}, False),
        ({"inputs": {"frame": [1, 90, 160]}}, True),
        ({"inputs": {"frame": [1, 2000, 2000]}}, False),
        (LARGE_LAYER, False),
        ({"inputs": {"spike_frequency": [10000, 10000]}}, False),
    ],
)  # fmt: skip
def test_a_network_with_too_many_weights_is_refused_before_it_is_built(values, fits):
    if fits:
        NetworkSpec.make(NETWORK | values)
        return
    with pytest.raises(ValueError, match="the network must have at most 50000000 weights, got about"):
        NetworkSpec.make(NETWORK | values)


@pytest.mark.parametrize("name", ["policy.pth", "other"])
def test_a_small_file_that_unpacks_to_much_is_refused(tmp_path, monkeypatch, name):
    """The limit is 1 GB; here 1 MB, for zeros that take 2 kB in the file."""
    assert card_module.MAX_POLICY == 1_000_000_000
    monkeypatch.setattr(card_module, "MAX_POLICY", 1_000_000)
    card = json.dumps({"algo": "ppo", "camera": "fovea", "network": NETWORK})
    with zipfile.ZipFile(tmp_path / "bomb.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("lgmd_gym.json", card)
        archive.writestr(name, bytes(1_200_000))
    with pytest.raises(ValueError, match=f"unpacks to {1_200_000 + len(card)} bytes, more than 1000000"):
        make_agent(f"policy:{tmp_path / 'bomb.zip'}")


def test_cards_of_other_environments(tmp_path):
    file = tmp_path / "model.zip"
    lens = Camera.make("wide")
    env = gym.make("LGMD/CCRs-v0", camera=lens, params=lgmd_gym.LGMDParams(t_sf=40.0))
    card = save_card(file, env, "ppo", vec_normalize="stats.pkl")
    assert (card.neuron["t_sf"], card.vec_normalize) == (40.0, "stats.pkl")
    again = PolicyCard.make(json.loads(file.with_suffix(".json").read_text()))
    assert Camera.make(again.camera) == lens


@pytest.mark.parametrize(("make", "words"), [
    (lambda: gym.make("LGMD/CCRs-v0", config={"policy_frequency": 10}), r"PolicyWrapper\(env, repeat=3\)"),
    (lambda: VecFrameStack(SB3VecEnv(ID), 2), r"PolicyWrapper\(env, history=N\)"),
    (lambda: RescaleAction(gym.make("LGMD/CCRs-v0"), 0.0, 1.0), r"one demand in \[-1, 1\], got Box\(0"),
    (lambda: gym.make("highway-v0"), "the actions of Discrete.* are not demands"),
    (lambda: LGMDObservation(gym.make("highway-v0", config=CONTINUOUS)), r"policy_frequency 1 Hz .*=30"),
    (lambda: gym.make("LGMD/CCRs-v0", fps=15), "fps 15 Hz is not that of agents, 30 Hz"),
    (lambda: SB3VecEnv(ID, fps=15), "fps 15 Hz is not that of agents, 30 Hz"),
])  # fmt: skip
def test_an_environment_that_is_not_that_of_an_agent_is_refused(make, words, tmp_path):
    with pytest.raises(ValueError, match=words):
        save_card(tmp_path / "model.zip", make(), "ppo")


def test_save_policy_needs_an_environment(model, tmp_path):
    model.save(tmp_path / "model.zip")
    with pytest.raises(ValueError, match="pass the training environment as env"):
        save_policy(PPO.load(tmp_path / "model.zip", device="cpu"), tmp_path / "again.zip")


def test_cards_without_infinity(tmp_path):
    """A brake that latches has an infinite `release_s`, the default, which JSON cannot state."""
    brake = {"full_odds": 1.0}
    card = PolicyCard(algo="ppo", camera="fovea", features={"inputs": ["ego_speed"]}, brake=brake)
    assert card.brake.release_s == inf
    file = tmp_path / "policy.zip"
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("policy.pth", b"")
    card_module.write_card(file, card.to_dict())
    with zipfile.ZipFile(file) as archive:
        text = archive.read("lgmd_gym.json").decode()
    assert "Infinity" not in text
    assert "release_s" not in json.loads(text)["brake"]
    assert card_module.policy_card(file) == card
