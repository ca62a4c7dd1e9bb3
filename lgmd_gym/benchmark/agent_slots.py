"""The agent of the environments of a batch."""

import traceback

import numpy as np

from lgmd_gym.agents import BatchAgent
from lgmd_gym.benchmark.views import Views


class AgentSlots:
    """One agent for all environments.

    Args:
        agent: The agent.
        views: Observations and infos.

    Attributes:
        failures: Tracebacks of the environments in which a user's agent failed in the last `act`.
    """

    def __init__(self, agent: BatchAgent, views: Views) -> None:
        self._agent, self._views = agent, views
        self.failures: dict[int, str] = {}

    def start(self, index: int, seed: int) -> None:
        """Start an episode in environment `index`."""
        envs = np.arange(self._agent.num_envs)
        self._agent.reset(envs == index, np.full(len(envs), seed))

    def act(self, active: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the demands, float64, and the alerts of the active environments, both of shape (N,)."""
        demands = self._agent.act(self._views.observations, self._views.infos(), active)
        failures = self._agent.failures.items()
        self.failures = {index: "".join(traceback.format_exception(error)) for index, error in failures}
        return demands, self._agent.alerts
