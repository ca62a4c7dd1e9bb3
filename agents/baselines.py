"""Agents that ignore the observation: the counterfactual without braking and two lower bounds."""

from collections.abc import Sequence

import numpy as np

from lgmd_gym.agents.base import BRAKE, FPS, HOLD, BatchAgent, Infos, Observations, State
from lgmd_gym.errors import check_positive


class NoBrake(BatchAgent):
    """Never brakes. A contact of this agent defines a threat."""

    name = "no-brake"
    reads_neuron = False

    def demands(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return `HOLD` for all environments."""
        return np.full(self.num_envs, HOLD)


class AlwaysBrake(BatchAgent):
    """Brakes fully from the first decision: avoids every contact and brakes prematurely in every episode."""

    name = "always-brake"
    reads_neuron = False

    def demands(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return `BRAKE` for all environments."""
        return np.full(self.num_envs, BRAKE)


class RandomBrake(BatchAgent):
    """Brakes fully from a random time on, as a chance-level baseline. The onset time T ~ Exp(rate).

    Args:
        rate: Mean number of onsets per second, > 0 [1/s].
        fps: Decision rate, > 0 [Hz].
    """

    name = "random-brake"
    reads_neuron = False

    def __init__(self, rate: float = 0.2, fps: float = FPS) -> None:
        self.rate = check_positive("rate", rate)
        self._decision_rate = check_positive("fps", fps)
        super().__init__()

    def initial(self) -> State:
        """Return an onset time, which `reset` draws [s], and the number of decisions."""
        return {"onset": 0.0, "decisions": 0}

    def reset(
        self, mask: np.ndarray | None = None, seeds: Sequence[int | None] | np.ndarray | None = None
    ) -> None:
        """Draw a new onset time in each selected environment from its seed."""
        super().reset(mask, seeds)
        for index in range(self.num_envs) if mask is None else np.flatnonzero(mask).tolist():
            rng = np.random.default_rng(None if seeds is None else seeds[index])
            self.state["onset"][index] = rng.exponential(1.0 / self.rate)

    def demands(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return `BRAKE` from the onset time on, `HOLD` before."""
        times = self.state["decisions"] / self._decision_rate
        self.state["decisions"] += 1
        return np.where(times >= self.state["onset"], BRAKE, HOLD)
