"""A small policy file with random weights, for tests of files, cards and networks."""

from dataclasses import asdict
from pathlib import Path

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from lgmd_gym.agents.policies.card import write_card
from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.agents.policies.network import describe_network
from lgmd_gym.agents.zones import zone_cameras

INPUTS = {"ego_speed": [1], "ego_yaw_rate": [1], "zones": [68]}
LAYERS = {"pi": [64, 64], "vf": []}


class _Spaces(gym.Env):
    """Environment that has nothing but spaces."""

    observation_space = spaces.Dict({name: spaces.Box(-5.0, 5.0, shape) for name, shape in INPUTS.items()})
    action_space = spaces.Discrete(2)


def write_policy(path: Path) -> Path:
    """Write a policy with the cameras of `stopping-zone` that holds the speed or brakes, and latches."""
    import torch
    from stable_baselines3 import PPO

    model = PPO("MultiInputPolicy", _Spaces(), seed=0, device="cpu", policy_kwargs={"net_arch": LAYERS})
    with torch.no_grad():
        model.policy.action_net.weight.mul_(1000.0)  # log odds of either sign, beyond the margins of tests
    features = FeatureConfig(inputs=("zones", "ego_speed", "ego_yaw_rate"), history=1, repeat=2, latch=True)
    model.save(path)
    write_card(
        path,
        {
            "algo": "ppo",
            "camera": zone_cameras(),
            "features": features.to_dict(),
            "demands": [0.0, -1.0],
            "network": asdict(describe_network(model)),
        },
    )
    return path


def random_inputs(count: int, seed: int = 0) -> dict[str, np.ndarray]:
    """Return random inputs of the policy, float32, (count, ...) each."""
    rng = np.random.default_rng(seed)
    return {name: rng.normal(size=(count, *shape)).astype(np.float32) for name, shape in INPUTS.items()}
