# pyright: standard
# Not strict: torch and stable-baselines3 state few types.
"""`NetworkSpec`: the network of a policy as plain values, so that loading it executes no code of the file."""

import json
from dataclasses import MISSING
from itertools import pairwise
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import spaces

from lgmd_gym.agents.policies.dense import (
    ACTIVATIONS,
    Linear,
    Step,
    check_shapes,
    shapes_of,
    side_by_side,
)
from lgmd_gym.agents.policies.features import FRAME
from lgmd_gym.agents.policies.weights import weights_file
from lgmd_gym.aliases import Arguments
from lgmd_gym.errors import check_items, check_keys, check_known, check_type, check_whole
from lgmd_gym.fields import Record, record, text, value

if TYPE_CHECKING:
    import torch
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.policies import BasePolicy

MAX_UNITS = 10_000  # of a layer or an input, so that a damaged card does not fill the memory
MAX_WEIGHTS = 50_000_000  # of a network, about
PLAIN_KWARGS = (
    "net_arch", "activation_fn", "ortho_init", "use_sde", "log_std_init", "full_std", "use_expln",
    "clip_mean", "squash_output", "features_extractor_kwargs", "share_features_extractor", "normalize_images",
    "n_critics",
)  # fmt: skip


def _check_inputs(name: str, inputs: object) -> dict[str, tuple[int, ...]]:
    return {
        key: tuple(
            check_whole(f"shape of {key}", side, 1, MAX_UNITS)
            for side in check_items(f"shape of {key}", shape, object, "whole numbers")
        )
        for key, shape in check_type(name, inputs, dict).items()
    }


def _check_kwargs(name: str, kwargs: object) -> Arguments:
    given = {} if kwargs is None else check_type(name, kwargs, dict)
    check_keys(f"key of {name}", given, PLAIN_KWARGS)
    _check_units(given)
    return given


@record
class NetworkSpec(Record):
    """Description of a network of stable-baselines3."""

    label = "network"

    policy: str = text(MISSING, 'stable-baselines3\'s name of the policy class, such as "MultiInputPolicy"')
    inputs: dict[str, tuple[int, ...]] = value(
        MISSING, _check_inputs, "Shape of each input; the input `frame` is uint8, others are float32"
    )
    policy_kwargs: Arguments = value(
        None,
        _check_kwargs,
        "Arguments of the policy class; the activation function by its name in `torch.nn`",
    )

    def check(self) -> None:
        """Raise ValueError for a network with too many weights, before it is built."""
        sizes = {name: prod(shape) for name, shape in self.inputs.items()}
        kwargs = self.policy_kwargs or {}
        features = sum(size for name, size in sizes.items() if name != FRAME)
        count = max(sizes.values(), default=0)
        if FRAME in sizes:  # a convolution, with about as many outputs as pixels, and a layer
            outputs = max(_whole(kwargs.get("features_extractor_kwargs"), 256))
            features += outputs
            count = max(count, sizes[FRAME] * outputs)
        arch = kwargs.get("net_arch")
        lists = list(arch.values()) if isinstance(arch, dict) else [arch]
        for layers in lists:
            units = [features, *_whole(layers, 0)]
            count += sum(before * after for before, after in pairwise(units))
        count *= max(_whole(kwargs.get("n_critics"), 1))
        if count > MAX_WEIGHTS:
            raise ValueError(f"the network must have at most {MAX_WEIGHTS} weights, got about {count}")

    @property
    def observation_space(self) -> spaces.Dict:
        """Space of the inputs."""
        return spaces.Dict({name: _box(name, shape) for name, shape in self.inputs.items()})

    def build(self, algo: str, num_actions: int | None) -> "BasePolicy":
        """Return the network with random weights.

        Args:
            algo: Algorithm of stable-baselines3, such as "ppo".
            num_actions: Number of discrete actions; None for one continuous demand.

        Raises:
            ValueError: For an unknown algorithm, policy or activation function.
        """
        import stable_baselines3
        from torch import nn, random

        algorithm = getattr(stable_baselines3, algo.upper(), None)
        aliases = getattr(algorithm, "policy_aliases", {})
        check_known(f"policy of {algo}", self.policy, aliases)
        kwargs = dict(self.policy_kwargs)
        if "activation_fn" in kwargs:
            known = nn.modules.activation.__all__
            kwargs["activation_fn"] = getattr(nn, check_known("activation", kwargs["activation_fn"], known))
        with random.fork_rng(devices=[]):  # a training that saves its policy draws the same numbers after it
            return aliases[self.policy](
                self.observation_space, _actions(num_actions), lambda _: 0.0, **kwargs
            )

    def load(self, path: Path, algo: str, num_actions: int | None) -> "BasePolicy":
        """Return the network with the weights in a model file; no code of the file is executed.

        Raises:
            ValueError: If the weights do not fit the network. Errors of zipfile and PyTorch pass through.
        """
        import torch

        weights = torch.load(weights_file(path), map_location="cpu", weights_only=True)
        network = self.build(algo, num_actions)
        check_shapes(shapes_of(network.state_dict()), shapes_of(weights))
        network.load_state_dict(weights)
        network.set_training_mode(False)
        return network


def dense_layers(network: Any) -> "torch.nn.Sequential | None":
    """Return the layers from the inputs, side by side, to the values of the actions.

    stable-baselines3 spends two thirds of the time of one decision on checks, copies and a distribution.

    Args:
        network: A policy of stable-baselines3.

    Returns:
        The layers, which share the weights of the network; None for a network with other inputs than
        vectors, without discrete actions, or of a class that is not stable-baselines3's.
    """
    from stable_baselines3.common.policies import MultiInputActorCriticPolicy
    from stable_baselines3.common.torch_layers import CombinedExtractor, MlpExtractor
    from stable_baselines3.dqn.policies import QNetwork
    from torch import nn

    q_net = getattr(network, "q_net", None)
    extractor = getattr(network if q_net is None else q_net, "features_extractor", None)
    # Exact types: a user's own class can compute anything from layers of the same names.
    if type(extractor) is not CombinedExtractor or not isinstance(network.action_space, spaces.Discrete):
        return None
    if not all(type(part) is nn.Flatten for part in extractor.extractors.values()):
        return None
    if type(q_net) is QNetwork:
        return q_net.q_net
    mlp = getattr(network, "mlp_extractor", None)
    if type(mlp) is MlpExtractor and type(network) is MultiInputActorCriticPolicy:
        return nn.Sequential(*mlp.policy_net, network.action_net)
    return None


def dense_steps(layers: "torch.nn.Sequential") -> list[Step] | None:
    """Return layers as steps of `DenseNetwork`, with copies of the weights; None for others than it has."""
    from torch import nn

    functions = {getattr(nn, name): function for name, function in ACTIVATIONS.items()}
    if not all(type(layer) in (nn.Linear, *functions) for layer in layers):
        return None
    return [
        Linear.of(layer.weight.detach().numpy(), layer.bias.detach().numpy())
        if isinstance(layer, nn.Linear)
        else functions[type(layer)]
        for layer in layers
    ]


def layer_values(
    layers: "torch.nn.Sequential", names: tuple[str, ...], inputs: dict[str, np.ndarray]
) -> np.ndarray:
    """Return the values of the actions of `dense_layers`, float32, shape (N, actions).

    Args:
        layers: Layers that `DenseNetwork` does not have.
        names: Names of the inputs, in the order of the network.
        inputs: Inputs by name, arrays of shape (N, …).
    """
    import torch

    with torch.inference_mode():
        return layers(torch.from_numpy(side_by_side(inputs, names))).numpy()


def describe_network(model: "BaseAlgorithm") -> NetworkSpec | None:
    """Return the description of a model's network.

    None for a network that it cannot describe, for example one with a feature extractor of one's own.
    """
    from torch import nn

    kwargs = {key: value for key, value in model.policy_kwargs.items() if not key.startswith("optimizer_")}
    kwargs |= {"use_sde": True} if model.use_sde else {}
    names = {getattr(nn, name): name for name in nn.modules.activation.__all__ if hasattr(nn, name)}
    if "activation_fn" in kwargs:
        kwargs["activation_fn"] = names.get(kwargs["activation_fn"], kwargs["activation_fn"])
    policies = {policy: name for name, policy in model.policy_aliases.items()}
    inputs = getattr(model.observation_space, "spaces", {})
    num_actions = getattr(model.action_space, "n", None)
    try:
        shapes = {name: tuple(map(int, space.shape or ())) for name, space in inputs.items()}
        plain = json.loads(json.dumps(kwargs))
        spec = NetworkSpec(policy=policies[type(model.policy)], inputs=shapes, policy_kwargs=plain)
        built = spec.build(type(model).__name__, num_actions)
    except (KeyError, TypeError, ValueError):  # an own class of policy, or values that are not plain
        return None
    same_types = all(space.dtype == inputs[name].dtype for name, space in spec.observation_space.items())
    same_actions = num_actions is not None or model.action_space == _actions(None)
    same_weights = shapes_of(built.state_dict()) == shapes_of(model.policy.state_dict())
    return spec if same_types and same_actions and same_weights else None


def _box(name: str, shape: tuple[int, ...]) -> spaces.Box:
    return spaces.Box(0, 255, shape, np.uint8) if name == FRAME else spaces.Box(-np.inf, np.inf, shape)


def _actions(count: int | None) -> spaces.Space:
    return spaces.Box(-1.0, 1.0, (1,)) if count is None else spaces.Discrete(count)


def _whole(values: object, default: int) -> list[int]:
    """Return the numbers in nested values; a default without one."""
    if isinstance(values, dict | list | tuple):
        items = values.values() if isinstance(values, dict) else values
        found = [number for item in items for number in _whole(item, -1) if number >= 0]
        return found or [default]
    return [int(values)] if isinstance(values, int | float) and values >= 0 else [default]


def _check_units(value: object) -> None:
    """Raise ValueError if a number in nested values exceeds the limit of layers."""
    if isinstance(value, dict | list | tuple):
        for item in value.values() if isinstance(value, dict) else value:
            _check_units(item)
    elif isinstance(value, int | float) and not abs(value) <= MAX_UNITS:
        raise ValueError(f"numbers of policy_kwargs must be at most {MAX_UNITS}, got {value}")
