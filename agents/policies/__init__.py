"""Learned policies: the agent, its card and inputs, and the policy files of this package."""

from lgmd_gym.agents.policies.card import PolicyCard, save_card, save_policy

__all__ = ["PolicyCard", "save_card", "save_policy"]
