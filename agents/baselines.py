"""Agents that ignore the observation: the counterfactual without braking and two lower bounds."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from lgmd_gym.agents.base import BRAKE, FPS, HOLD, Agent
from lgmd_gym.agents.batch import BatchAgent
from lgmd_gym.errors import check_positive


class NoBrake(Agent):
    """Never brakes. A contact of this agent defines a threat."""

    name = "no-brake"
    reads_neuron = False

    def batch(self, num_envs: int) -> BatchAgent:
        """Return this agent for `num_envs` environments."""
        return _ConstantBatch(num_envs, HOLD)

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Return `HOLD`."""
        return HOLD


class AlwaysBrake(Agent):
    """Brakes fully from the first decision: avoids every contact and brakes prematurely in every episode."""

    name = "always-brake"
    reads_neuron = False

    def batch(self, num_envs: int) -> BatchAgent:
        """Return this agent for `num_envs` environments."""
        return _ConstantBatch(num_envs, BRAKE)

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
    reads_neuron = False

    def __init__(self, rate: float = 0.2, fps: float = FPS) -> None:
        self.rate = check_positive("rate", rate)
        self.fps = check_positive("fps", fps)
        self.reset()

    def batch(self, num_envs: int) -> BatchAgent:
        """Return this agent for `num_envs` environments."""
        return _RandomBrakeBatch(self, num_envs)

    def reset(self, seed: int | None = None) -> None:
        """Draw a new onset time from `seed`."""
        super().reset(seed)
        self._onset = self.draw_onset(seed)
        self._decisions = 0

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Return `BRAKE` from the onset time on, `HOLD` before."""
        time = self._decisions / self.fps
        self._decisions += 1
        return BRAKE if time >= self._onset else HOLD

    def draw_onset(self, seed: int | None) -> float:
        """Return the onset time for a seed [s]."""
        return np.random.default_rng(seed).exponential(1.0 / self.rate)


class _ConstantBatch(BatchAgent):
    """The same demand in N environments."""

    def __init__(self, num_envs: int, demand: float) -> None:
        super().__init__(num_envs)
        self._demands = np.full(num_envs, demand)

    def reset(self, index: int, seed: int | None = None) -> None:
        """Do nothing: the agent has no state."""

    def demands(
        self, observations: Mapping[str, np.ndarray], infos: Mapping[str, Any], active: np.ndarray
    ) -> np.ndarray:
        return self._demands


class _RandomBrakeBatch(BatchAgent):
    """`RandomBrake` in N environments."""

    def __init__(self, agent: RandomBrake, num_envs: int) -> None:
        super().__init__(num_envs)
        self._agent = agent
        self._onsets, self._decisions = np.zeros(num_envs), np.zeros(num_envs, np.int64)

    def reset(self, index: int, seed: int | None = None) -> None:
        self._onsets[index], self._decisions[index] = self._agent.draw_onset(seed), 0

    def demands(
        self, observations: Mapping[str, np.ndarray], infos: Mapping[str, Any], active: np.ndarray
    ) -> np.ndarray:
        times = self._decisions / self._agent.fps
        self._decisions += 1
        return np.where(times >= self._onsets, BRAKE, HOLD)
