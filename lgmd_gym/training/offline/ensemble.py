"""Ensembles of networks, merged into one network whose log odds are their mean."""

from collections.abc import Sequence
from typing import Any

import torch

from lgmd_gym.errors import shown


def extracts_features(network: Any) -> bool:
    """Return whether a network computes its features with weights of its own, as from frames."""
    return any(True for _ in network.features_extractor.parameters())


def check_without_frames(network: Any, name: str, required: object) -> None:
    """Raise ValueError for a network that processes frames, where a hyperparameter requires vectors."""
    if extracts_features(network):
        value = str(required).lower()
        raise ValueError(f"{name} must be {value} for a policy on frames; set {name}: {value}")


def merged_layers(policy_kwargs: dict[str, Any], count: int) -> dict[str, Any]:
    """Return the arguments of a network that is as wide as `count` networks together.

    Raises:
        ValueError: If `net_arch` does not contain the layers of the policy.
    """
    layers = policy_kwargs["net_arch"]
    if isinstance(layers, dict) and "pi" not in layers:
        raise ValueError(f"net_arch of an ensemble must contain 'pi', got {shown(layers)}; use pi: [64, 64]")
    units = layers["pi"] if isinstance(layers, dict) else layers
    return policy_kwargs | {"net_arch": {"pi": [count * size for size in units], "vf": []}}


@torch.no_grad()
def merge_networks(networks: Sequence[Any], merged: Any) -> None:
    """Write networks into one with the arguments of `merged_layers`.

    Each layer contains the layers of the networks side by side: hidden layers are block diagonal, and the
    outputs are the means of those of the networks.
    """
    layers = [linear_layers(network) for network in networks]
    targets = linear_layers(merged)
    for depth, (target, *parts) in enumerate(zip(targets, *layers, strict=True)):
        weights, biases = [part.weight for part in parts], [part.bias for part in parts]
        if depth == len(targets) - 1:
            joined = torch.cat(weights, 1) if depth else torch.stack(weights).sum(0)
            target.weight.copy_(joined / len(parts))
            target.bias.copy_(torch.stack(biases).mean(0))
        else:
            target.weight.copy_(torch.block_diag(*weights) if depth else torch.cat(weights))
            target.bias.copy_(torch.cat(biases))


def linear_layers(network: Any) -> list[torch.nn.Linear]:
    """Return the layers from the inputs to the outputs of the actions."""
    hidden = [item for item in network.mlp_extractor.policy_net if isinstance(item, torch.nn.Linear)]
    return [*hidden, network.action_net]
