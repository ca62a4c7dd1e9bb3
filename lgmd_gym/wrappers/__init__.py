"""Gymnasium wrappers that add cameras and neurons to highway-env environments."""

from lgmd_gym.sensing.assembly import TraceFrame
from lgmd_gym.wrappers.observation import LGMDObservation

__all__ = ["LGMDObservation", "TraceFrame"]
