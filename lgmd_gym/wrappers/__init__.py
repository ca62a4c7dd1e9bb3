"""Gymnasium wrappers that add cameras and neurons to highway-env environments."""

from lgmd_gym.wrappers.observation import LGMDObservation, TraceFrame

__all__ = ["LGMDObservation", "TraceFrame"]
