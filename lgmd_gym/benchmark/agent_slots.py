"""Agents of the environments of a batch: one agent for all of them, or one agent per environment."""

import traceback
from collections.abc import Callable
from typing import Any

import numpy as np

from lgmd_gym.agents.batch import BatchAgent
from lgmd_gym.benchmark.views import Views


class BatchSlots:
    """One `BatchAgent` for all environments.

    Args:
        agent: The agent.
        views: Observations and infos.
    """

    def __init__(self, agent: BatchAgent, views: Views) -> None:
        self._agent, self._views = agent, views
        self.failures: dict[int, str] = {}

    def start(self, index: int, seed: int) -> None:
        """Start an episode in environment `index`."""
        self._agent.reset(index, seed)

    def act(self, active: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the demands, float64, and the alerts of the active environments, both of shape (N,)."""
        actions = self._agent.act_batch(self._views.observations, self._views.batch_infos(), active)
        return actions[:, 0].astype(np.float64), self._agent.alerts


class SingleSlots:
    """One agent per environment, made anew for every episode.

    Args:
        make: Makes an agent for the environment with a given index.
        views: Observations and infos.

    Attributes:
        failures: Tracebacks of the agents that failed in the last `act`, by environment.
    """

    def __init__(self, make: Callable[[int], Any], views: Views) -> None:
        self._make, self._views = make, views
        num_envs = views.num_envs
        self._agents: list[Any] = [None] * num_envs
        self._demands, self._alerts = np.zeros(num_envs), np.zeros(num_envs, np.bool_)
        self.failures: dict[int, str] = {}
        views.record_traces()

    def start(self, index: int, seed: int) -> None:
        """Start an episode in environment `index`."""
        self._agents[index] = self._make(index)
        self._agents[index].reset(seed)

    def act(self, active: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the demands, float64, and the alerts of the active environments, both of shape (N,)."""
        self.failures.clear()
        for index in np.flatnonzero(active).tolist():
            agent = self._agents[index]
            try:
                action = agent.act(self._views.observation(index), self._views.info(index))
                self._demands[index], self._alerts[index] = _demand(action), bool(agent.alert)
            except (Exception, SystemExit):  # an agent that calls exit() would end the worker process
                self.failures[index] = traceback.format_exc()
        return self._demands, self._alerts


def _demand(action: Any) -> float:
    """Return the demand of an action; raise ValueError unless it is one finite number."""
    values = np.asarray(action, np.float64).reshape(-1)
    if values.size != 1 or not np.isfinite(values[0]):
        raise ValueError(f"action must be one finite number in [-1, 1], got {action!r}")
    return float(values[0])
