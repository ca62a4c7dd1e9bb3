"""Networks of vectors only are run without the checks of stable-baselines3, with the same values."""

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from support import policies
from support.policies import write_policy

from lgmd_gym.agents import make_agent
from lgmd_gym.agents.policies.dense import DenseNetwork
from lgmd_gym.agents.policies.network import NetworkSpec, dense_layers, dense_steps, layer_values
from lgmd_gym.agents.policies.policy import Policy, action_values

INPUTS = {"columns": (6,), "ego_speed": (1,)}
FRAME = INPUTS | {"frame": (1, 36, 36)}


def network(policy="MultiInputPolicy", algo="ppo", actions=2, inputs=INPUTS, **kwargs):
    return NetworkSpec(policy=policy, inputs=inputs, policy_kwargs=kwargs).build(algo, actions)


def dense_network(policy, names=tuple(INPUTS)):
    """Return the network without torch that decides in place of a policy."""
    steps = dense_steps(dense_layers(policy))
    assert steps is not None
    return DenseNetwork(steps, names)


@pytest.mark.parametrize("count", [1, 5])
def test_margins_between_the_actions_of_the_shipped_policy_are_the_same(count):
    policy = Policy("all-round")
    names, rng = tuple(policy.network.observation_space.spaces), np.random.default_rng(3)
    spaces = policy.network.observation_space.spaces
    inputs = {key: rng.random((count, *space.shape), np.float32) for key, space in spaces.items()}
    direct, reference = dense_network(policy.network, names)(inputs), action_values(policy.network, inputs)
    assert direct.shape == reference.shape == (count, policy.network.action_space.n)
    assert np.allclose(np.diff(direct), np.diff(reference), rtol=1e-5, atol=1e-5)


def test_q_values_are_the_same():
    policy = network(algo="dqn", actions=3, net_arch=[8])
    inputs = {"columns": np.ones((2, 6), np.float32), "ego_speed": np.full((2, 1), 0.5, np.float32)}
    values = dense_network(policy)(inputs)
    assert np.allclose(values, action_values(policy, inputs), atol=1e-6)


@pytest.mark.parametrize("activation", ["ReLU", "Tanh"])
def test_values_do_not_depend_on_the_number_of_environments(activation):
    """The number of inputs and of units does not fit the blocks of the kernel."""
    policy = network(actions=5, net_arch={"pi": [67, 30], "vf": []}, activation_fn=activation)
    values, rng = dense_network(policy), np.random.default_rng(0)
    inputs = {name: rng.normal(size=(37, *shape)).astype(np.float32) for name, shape in INPUTS.items()}
    together = values(inputs)
    assert np.allclose(np.diff(together), np.diff(action_values(policy, inputs)), atol=1e-5)
    for count in (1, 2, 3):
        for row in range(37 - count):
            part = values({name: item[row : row + count] for name, item in inputs.items()})
            assert np.array_equal(part, together[row : row + count])


def test_torch_runs_other_activations():
    layers, rng = dense_layers(policy := network(activation_fn="ELU")), np.random.default_rng(0)
    assert dense_steps(layers) is None
    inputs = {name: rng.normal(size=(5, *shape)).astype(np.float32) for name, shape in INPUTS.items()}
    values = layer_values(layers, tuple(INPUTS), inputs)
    assert np.allclose(np.diff(values), np.diff(action_values(policy, inputs)), atol=1e-5)


@pytest.mark.parametrize("count", [5, 9])
def test_another_number_of_inputs_is_rejected(count):
    """A kernel would read beyond the end of the inputs."""
    inputs = {"columns": np.ones((1, count), np.float32), "ego_speed": np.ones((1, 1), np.float32)}
    with pytest.raises(ValueError, match=f"requires 7 inputs, got {count + 1}; compare"):
        dense_network(network(actions=2))(inputs)


def test_networks_with_frames_or_continuous_actions_are_left_to_stable_baselines3():
    assert dense_layers(network(inputs=FRAME)) is None
    assert dense_layers(network(actions=None)) is None


@pytest.mark.parametrize("algo", ["ppo", "dqn"])
def test_own_classes_are_left_to_stable_baselines3(algo):
    from stable_baselines3.common.torch_layers import CombinedExtractor

    class Squared(CombinedExtractor):
        def forward(self, observations):
            return super().forward(observations) ** 2

    policy = network(algo=algo)
    assert dense_layers(policy) is not None
    owner = policy.q_net if algo == "dqn" else policy
    owner.features_extractor = Squared(policy.observation_space)
    assert dense_layers(policy) is None


def test_a_margin_changes_only_its_own_policy(tmp_path):
    file = str(write_policy(tmp_path / "small.zip"))
    plain, late, again = (Policy(file, margin) for margin in (0.0, 2.0, 0.0))
    bias, brake = plain.network.action_net.bias, int(np.argmin(plain.card.demands))
    assert late.network.action_net.bias[brake].item() == pytest.approx(bias[brake].item() - 2.0)
    assert again.network.action_net.bias.tolist() == bias.tolist()


def test_a_changed_file_is_loaded_again(tmp_path, monkeypatch):
    file = write_policy(tmp_path / "mine.zip")
    first = make_agent(f"policy:{file}").agent.network.action_net.weight.shape
    monkeypatch.setattr(policies, "LAYERS", {"pi": [8], "vf": []})
    write_policy(file)
    assert make_agent(f"policy:{file}").agent.network.action_net.weight.shape != first
