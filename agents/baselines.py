"""Agents that ignore the observation: the counterfactual without braking and two lower bounds."""

from typing import Any

import numpy as np

from lgmd_gym.agents.base import BRAKE, FPS, HOLD, Agent
from lgmd_gym.agents.options import positive


class NoBrake(Agent):
    """Never brakes. A contact of this agent defines a threat."""

    name = "no-brake"

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Return `HOLD`."""
        return HOLD


class AlwaysBrake(Agent):
    """Brakes fully from the first decision: avoids every contact and brakes prematurely in every episode."""

    name = "always-brake"

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Return `BRAKE`."""
        return BRAKE


class RandomBrake(Agent):
    """Brakes fully from a random time on, as a chance-level baseline. The onset time T ~ Exp(rate).

    Args:
        rate: Mean number of onsets per second, > 0 [1/s].
        fps: Decision rate, > 0 [Hz].
    """

    name = "random-brake"

    def __init__(self, rate: float = 0.2, fps: float = FPS) -> None:
        self.rate = positive("rate", rate)
        self.fps = positive("fps", fps)
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """Draw a new onset time from `seed`."""
        super().reset(seed)
        self._onset = np.random.default_rng(seed).exponential(1.0 / self.rate)
        self._decisions = 0

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Return `BRAKE` from the onset time on, `HOLD` before."""
        time = self._decisions / self.fps
        self._decisions += 1
        return BRAKE if time >= self._onset else HOLD
