# pyright: standard
# Not strict: torch and stable-baselines3 state few types.
"""Network that a training on recorded episodes starts from, also of a policy with fewer fields ahead."""

from dataclasses import replace
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from lgmd_gym.agents.policies.card import PolicyCard, policy_card
from lgmd_gym.agents.policies.evidence import TimeToBrakeParams
from lgmd_gym.agents.policies.features import NUM_LEVELS, FeatureConfig
from lgmd_gym.agents.policies.policy import Policy, find_policy, load_network
from lgmd_gym.agents.sides import NUM_SIDE_CAMERAS
from lgmd_gym.aliases import Values
from lgmd_gym.sensing.channel import make_channels, plain_values
from lgmd_gym.training.offline.networks import linear_layers

if TYPE_CHECKING:
    from stable_baselines3.common.policies import BasePolicy

    from lgmd_gym.neuron import NeuronSpec
    from lgmd_gym.sensing.channel import ChannelSpec

ALGO = "ppo"  # class of stable-baselines3 that has the networks of time-to-brake
COLUMNS, SIDES = "columns", "sides_ffi"
# Inputs of policies that can get more fields ahead: these add columns, and change no other of these inputs.
EXTENSIBLE = (COLUMNS, SIDES, "ego_speed", "ego_acceleration", "ego_yaw_rate", "known_deceleration")


def load_start(
    start: str,
    features: FeatureConfig,
    camera: "ChannelSpec",
    brake: TimeToBrakeParams,
    neuron: "NeuronSpec" = None,
) -> "BasePolicy":
    """Return the network of a policy for a training with the same cameras, or with more fields ahead.

    The weights of columns that the policy lacks are 0: they do not change its outputs.

    Args:
        start: Policy file, or name of a policy in the package.
        features: Inputs of the training. More fields require `columns`, and no other input of every camera.
        camera: Cameras of the training. Those of the policy must be among them in the same order, and with
            the input `sides_ffi` those at the sides must be the same ones, at the end.
        brake: Brake of the training.
        neuron: Neuron parameters of the training.

    Raises:
        ValueError: If the policy cannot be loaded, was not trained with time-to-brake, or has other inputs,
            cameras, neurons or intervals.
    """
    path = find_policy(start)
    card = policy_card(path)
    given, required = plain_values(make_channels(card.camera)), plain_values(make_channels(camera))
    if card.brake is None or card.algo != ALGO or card.vec_normalize is not None:
        raise ValueError(
            f"start {start!r} was not trained with time-to-brake; start from a policy that was, or omit start"
        )
    faults = {
        "inputs": card.features != features,
        "neurons": plain_values(card.neuron) != plain_values(neuron),
        "limits_s": card.brake.limits_s != brake.limits_s,
        "cameras": given != required and not _extensible(card, features, given, required),
    }
    fault = next((name for name, differs in faults.items() if differs), None)
    if fault is not None:
        fewer = f", or of {COLUMNS} with fewer fields ahead" if fault == "cameras" else ""
        raise ValueError(
            f"start {start!r} has other {fault} than the training; "
            f"start from a policy with the same {fault}{fewer}, or omit start"
        )
    if given == required:
        return Policy(start).network
    known = [channel in given for channel in required]
    columns = np.repeat(known, [channel["columns"] for channel in required])
    return _extended(path, card, np.tile(columns, NUM_LEVELS))


def _extensible(
    card: PolicyCard, features: FeatureConfig, given: list[Values], required: list[Values]
) -> bool:
    """Return whether the required channels are the given ones with more fields ahead."""
    if card.network is None or COLUMNS not in features.inputs or not {*features.inputs} <= {*EXTENSIBLE}:
        return False
    if SIDES in features.inputs and given[-NUM_SIDE_CAMERAS:] != required[-NUM_SIDE_CAMERAS:]:
        return False
    return given == [channel for channel in required if channel in given]


@torch.no_grad()
def _extended(path: Path, card: PolicyCard, known: np.ndarray) -> Any:
    """Return the network of a policy with more columns.

    Args:
        path: Policy file.
        card: Its card, with a network.
        known: Which values of the input `columns` the policy has, bool.

    Raises:
        ValueError: If the file cannot be loaded, or its network has other inputs than the card.
    """
    assert card.network is not None
    assert card.features is not None
    source, inputs = load_network(path, card), card.network.inputs
    if inputs.keys() != {*card.features.inputs} or inputs[COLUMNS] != (np.sum(known),):
        raise ValueError(
            f"policy {str(path)!r}: the network of the card has other inputs than its features and cameras; "
            "correct the card, or train it again"
        )
    target = replace(card.network, inputs=inputs | {COLUMNS: known.shape}).build(card.algo, card.num_actions)
    # stable-baselines3 concatenates the inputs in the order of their names
    parts = [known if name == COLUMNS else np.ones(prod(inputs[name]), np.bool_) for name in sorted(inputs)]
    first, *others = linear_layers(target)
    given, *rest = linear_layers(source)
    first.weight.zero_()
    first.weight[:, torch.from_numpy(np.concatenate(parts))] = given.weight
    first.bias.copy_(given.bias)
    for layer, other in zip(others, rest, strict=True):
        layer.load_state_dict(other.state_dict())
    return target
