"""`BatchAgent`: an agent that acts in many environments at once."""

from collections.abc import Mapping
from typing import Any

import numpy as np


class BatchAgent:
    """One agent in N environments, with a state per environment; see `Agent.batch`.

    Its actions and alerts equal those of N separate agents. Subclasses implement `reset` and `demands`.

    Args:
        num_envs: Number of environments N.

    Attributes:
        alerts: Whether the agent warns, after the last `act_batch`, bool, shape (N,).
    """

    def __init__(self, num_envs: int) -> None:
        self.num_envs = num_envs
        self.alerts = np.zeros(num_envs, np.bool_)

    def reset(self, index: int, seed: int | None = None) -> None:
        """Start a new episode in environment `index`; `seed` seeds random agents."""
        raise NotImplementedError

    def act_batch(
        self, observations: Mapping[str, np.ndarray], infos: Mapping[str, Any], active: np.ndarray
    ) -> np.ndarray:
        """Return the actions for one observation of every active environment.

        Args:
            observations: Batch of observations of `LGMDObservation`, arrays of shape (N, …). The rows of
                other environments are undefined.
            infos: Batch of infos, arrays of shape (N,). ``lgmd/trace`` is absent, or a tuple of one
                `TraceFrame` with arrays of shape (N,) and (N, cameras).
            active: Selection of the environments, bool, shape (N,).

        Returns:
            Actions in [-1, 1], float32, shape (N, 1). The rows of other environments are undefined.
        """
        self.alerts = np.array(infos["lgmd/alert"], np.bool_)
        demands = self.demands(observations, infos, active)
        return np.asarray(demands, np.float64).astype(np.float32).reshape(self.num_envs, 1)

    def demands(
        self, observations: Mapping[str, np.ndarray], infos: Mapping[str, Any], active: np.ndarray
    ) -> np.ndarray:
        """Return the longitudinal demands in [-1, 1], shape (N,); arguments as of `act_batch`."""
        raise NotImplementedError
