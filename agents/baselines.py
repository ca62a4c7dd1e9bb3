"""Agents that do not look: the counterfactual, and two bounds that no sensible rule should come near."""

from typing import Any

import numpy as np

from lgmd_gym.agents.base import BRAKE, HOLD, Agent
from lgmd_gym.agents.options import positive


class NoBrake(Agent):
    """Never brakes; whether it touches decides what counts as a threat."""

    name = "no-brake"

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Hold the scripted speed."""
        return HOLD


class AlwaysBrake(Agent):
    """Brakes fully from the first moment: it avoids every contact and succeeds at nothing."""

    name = "always-brake"

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Brake fully."""
        return BRAKE


class RandomBrake(Agent):
    """Brakes fully, and keeps braking, from a random moment on: the chance level.

    Args:
        rate: Mean number of onsets per second of simulated time, > 0.
        fps: Decisions per second, > 0 [Hz].
    """

    name = "random-brake"

    def __init__(self, rate: float = 0.2, fps: float = 30.0) -> None:
        super().__init__()
        self.rate = positive("rate", rate)
        self.fps = positive("fps", fps)
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """Draw a new moment from `seed`."""
        super().reset(seed)
        self._onset = np.random.default_rng(seed).exponential(1.0 / self.rate)
        self._decisions = 0

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Brake fully once the moment has come."""
        time = self._decisions / self.fps
        self._decisions += 1
        return BRAKE if time >= self._onset else HOLD
