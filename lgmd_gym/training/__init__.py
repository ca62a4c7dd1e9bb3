"""Policies that learn with stable-baselines3: what they see, how they are trained, how good they are."""

from lgmd_gym.training.policy_wrapper import PolicyView

__all__ = ["PolicyView"]
