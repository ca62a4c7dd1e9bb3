"""stable-baselines3 models of the networks that `OfflineLearner` trains."""

from typing import TYPE_CHECKING, Any

import torch

if TYPE_CHECKING:
    from stable_baselines3 import PPO
    from stable_baselines3.common.type_aliases import GymEnv


def make_model(policy: str, env: "GymEnv", seed: int, policy_kwargs: dict[str, Any]) -> "PPO":
    """Return a PPO model; only its network and its file format are used."""
    from stable_baselines3 import PPO

    torch.set_num_threads(1)
    return PPO(policy, env, 2e-3, 2, 2, seed=seed, device="cpu", policy_kwargs=policy_kwargs)


def network_arguments(changes: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments of a network: the defaults of `OfflineLearner` with some changes."""
    return {"activation_fn": torch.nn.ReLU, "net_arch": {"pi": [64, 64], "vf": []}} | changes
