"""Learned policies: the agent, its features, and the shipped policy files."""
