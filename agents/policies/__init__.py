"""Learned policies: the agent, its input features, and the policy files of this package."""
