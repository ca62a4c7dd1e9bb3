"""The driver model of Euro NCAP's forward collision warning (FCW) tests."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from lgmd_gym.agents import Agent
from lgmd_gym.agents.batch import BatchAgent

REACTION = 1.2  # [s] from the alert to braking, Euro NCAP AEB C2C v4.3.1, 8.4.6
DECELERATION = 4.0  # [m/s²], same section
Limits = Callable[[], np.ndarray]


class FCWDriver:
    """Brakes at 4 m/s², 1.2 s after the first alert of an agent, and ignores the agent's demands.

    Args:
        agent: Agent that raises the alert.
        max_deceleration: Returns the deceleration of full braking in the present episodes, shape (N,) [m/s²].
        decision_hz: Decision rate [Hz].
    """

    def __init__(self, agent: Agent, max_deceleration: Limits, decision_hz: float) -> None:
        self.agent = agent
        self.name = f"{agent.name} (FCW driver)"
        self._arguments = max_deceleration, decision_hz
        self._reaction = _Reaction(1, *self._arguments)

    @property
    def alert(self) -> bool:
        """Whether the agent raises an alert."""
        return bool(self.agent.alert)

    def reset(self, seed: int | None = None) -> None:
        """Reset the agent and the reaction timer."""
        self.agent.reset(seed)
        self._reaction.reset(0)

    def act(self, observation: dict[str, Any], info: dict[str, Any]) -> np.ndarray:
        """Return the driver's demand, shape (1,), float32."""
        self.agent.act(observation, info)
        return self._reaction.demands(np.array([self.alert])).astype(np.float32)

    def batch(self, num_envs: int) -> "BatchAgent | None":
        """Return the driver for the agent in `num_envs` environments; see `Agent.batch`."""
        agent = self.agent.batch(num_envs)
        return None if agent is None else _FCWDriverBatch(agent, _Reaction(num_envs, *self._arguments))


class _FCWDriverBatch(BatchAgent):
    """`FCWDriver` in N environments."""

    def __init__(self, agent: BatchAgent, reaction: "_Reaction") -> None:
        super().__init__(agent.num_envs)
        self._agent, self._reaction = agent, reaction

    def reset(self, index: int, seed: int | None = None) -> None:
        self._agent.reset(index, seed)
        self._reaction.reset(index)

    def act_batch(
        self, observations: Mapping[str, np.ndarray], infos: Mapping[str, Any], active: np.ndarray
    ) -> np.ndarray:
        self._agent.act_batch(observations, infos, active)
        self.alerts = self._agent.alerts
        return self._reaction.demands(self.alerts).astype(np.float32)[:, None]


class _Reaction:
    """Reaction of N drivers to alerts."""

    def __init__(self, num_envs: int, max_deceleration: Limits, decision_hz: float) -> None:
        self._max_deceleration = max_deceleration
        self._delay = round(REACTION * decision_hz)
        self._since_alert = np.full(num_envs, -1)  # decisions; -1 before the first alert

    def reset(self, index: int) -> None:
        self._since_alert[index] = -1

    def demands(self, alerts: np.ndarray) -> np.ndarray:
        """Process one decision; return the drivers' demands."""
        waiting = self._since_alert < 0
        self._since_alert = np.where(waiting, np.where(alerts, 0, -1), self._since_alert + 1)
        limits, braking = self._max_deceleration(), self._since_alert >= self._delay
        return np.divide(-DECELERATION, limits, out=np.zeros(len(limits)), where=braking)
