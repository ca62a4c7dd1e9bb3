# pyright: standard
# Not strict: torch and stable-baselines3 state few types.
"""Network that a training on recorded episodes starts from, also of a policy with fewer cameras."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from lgmd_gym.agents.policies.card import policy_card
from lgmd_gym.agents.policies.evidence import TimeToBrakeParams
from lgmd_gym.agents.policies.features import NUM_LEVELS, FeatureConfig
from lgmd_gym.agents.policies.policy import Policy, find_policy
from lgmd_gym.agents.sides import NEURONS, NUM_SIDE_FIELDS
from lgmd_gym.sensing.channel import make_channels, plain_values
from lgmd_gym.training.offline.networks import linear_layers

if TYPE_CHECKING:
    from stable_baselines3.common.policies import BasePolicy

    from lgmd_gym.sensing.channel import ChannelSpec

COLUMNS = "columns"
# Inputs of policies that may get more cameras: further fields ahead add columns, and change no other input.
EXTENSIBLE = (COLUMNS, "sides_ffi", "ego_speed", "ego_acceleration", "ego_yaw_rate", "known_deceleration")
NUM_SIDE_CAMERAS = NUM_SIDE_FIELDS * len(NEURONS)


def load_start(
    start: str, features: FeatureConfig, camera: "ChannelSpec", brake: TimeToBrakeParams
) -> "BasePolicy":
    """Return the network of a policy for a training with the same cameras, or with more fields ahead.

    The weights of columns that the policy lacks are 0: they do not change its outputs.

    Args:
        start: Policy file, or name of a policy in the package.
        features: Inputs of the training.
        camera: Cameras of the training. Those of the policy must be among them in the same order, with the
            same cameras at the sides at the end.
        brake: Brake of the training.

    Raises:
        ValueError: If the policy cannot be loaded, or has other inputs, cameras or intervals.
    """
    path = find_policy(start)
    card = policy_card(path)
    given, required = _channels(card.camera), _channels(camera)
    own = np.array([channel in given for channel in required])
    extended = bool(card.network and not own.all() and {*features.inputs} <= {*EXTENSIBLE})
    if extended:
        same = given == [channel for channel in required if channel in given]
        same = same and given[-NUM_SIDE_CAMERAS:] == required[-NUM_SIDE_CAMERAS:]
    else:
        same = given == required
    faults = {
        "inputs": card.features != features,
        "cameras": not same,
        "limits_s": card.brake is None or card.brake.limits_s != brake.limits_s,
    }
    for name in (name for name, differs in faults.items() if differs):
        raise ValueError(
            f"start {start!r} has other {name} than the training; "
            f"start from a policy with the same {name}, or omit start"
        )
    if card.network is None or not extended:
        return Policy(start).network
    known = np.tile(np.repeat(own, [channel["columns"] for channel in required]), NUM_LEVELS)
    inputs = card.network.inputs | {COLUMNS: (len(known),)}
    network = replace(card.network, inputs=inputs).build(card.algo, card.num_actions)
    # stable-baselines3 concatenates the inputs in the order of their names
    parts = [known if name == COLUMNS else np.ones(inputs[name], np.bool_) for name in sorted(inputs)]
    _copy(card.network.load(path, card.algo, card.num_actions), network, np.concatenate(parts))
    return network


def _channels(camera: "ChannelSpec") -> list[Any]:
    """Return channels as plain values."""
    return plain_values(make_channels(camera))


@torch.no_grad()
def _copy(source: Any, target: Any, known: np.ndarray) -> None:
    """Copy the weights of the layers; `known` has the inputs of the target that the source has, bool."""
    first, *others = zip(linear_layers(source), linear_layers(target), strict=True)
    first[1].weight.zero_()
    first[1].weight[:, torch.from_numpy(known)] = first[0].weight
    first[1].bias.copy_(first[0].bias)
    for given, own in others:
        own.load_state_dict(given.state_dict())
