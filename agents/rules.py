"""Rules that brake on the neuron."""

from typing import Any

import numpy as np

from lgmd_gym.agents.base import BRAKE, HOLD, Agent
from lgmd_gym.agents.options import positive, whole


class SpikeThreshold(Agent):
    """Brakes fully once the spike frequency has stood at a threshold, and keeps braking to a standstill.

    It latches because silence is not clearance: when a flat-shaded car fills a narrow field nothing moves
    in the image any more and the neuron falls silent at the worst moment.

    Args:
        threshold: Spike frequency from which a camera frame counts, > 0 [spikes/s]; read it with the frame
            rate, it was chosen at 30 Hz.
        frames: Number of consecutive camera frames at the threshold that start braking, >= 1. Between two
            decisions all frames count if `info` carries `lgmd/trace`, else the last one.
    """

    name = "spike-threshold"

    def __init__(self, threshold: float = 30.0, frames: int = 1) -> None:
        super().__init__()
        self.threshold = positive("threshold", threshold)
        self.frames = whole("frames", frames, 1)
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """Release the brake."""
        super().reset(seed)
        self._above = 0
        self._latched = False

    def choose(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Brake fully if latched; any camera's frequency counts."""
        for frequency in _frequencies(observation, info):
            self._above = self._above + 1 if frequency >= self.threshold else 0
            self._latched = self._latched or self._above >= self.frames
        return BRAKE if self._latched else HOLD


def _frequencies(observation: dict[str, Any], info: dict[str, Any]) -> list[float]:
    """Return the highest spike frequency of every camera frame since the last decision."""
    trace = info.get("lgmd/trace")
    if trace is not None:
        return [float(np.max(frame.response.spike_frequency)) for frame in trace]
    return [float(np.max(observation["spike_frequency"]))]
