"""Gymnasium wrappers that add the neuron to an environment."""

from lgmd_gym.wrappers.observation import LGMDObservation, TraceFrame

__all__ = ["LGMDObservation", "TraceFrame"]
