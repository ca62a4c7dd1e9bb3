"""The driver model of Euro NCAP's forward collision warning (FCW) tests."""

from typing import Any

import numpy as np

from lgmd_gym.agents import Agent

REACTION = 1.2  # [s] from the alert to braking, Euro NCAP AEB C2C v4.3.1, 8.4.6
DECELERATION = 4.0  # [m/s²], same section


class FCWDriver:
    """Brakes at 4 m/s², 1.2 s after the first alert of an agent, and ignores the agent's demands.

    Args:
        agent: Agent that raises the alert.
        max_deceleration: Deceleration of full braking [m/s²].
        decision_hz: Decision rate [Hz].
    """

    def __init__(self, agent: Agent, max_deceleration: float, decision_hz: float) -> None:
        self.agent = agent
        self.name = f"{agent.name} (FCW driver)"
        self._demand = -DECELERATION / max_deceleration
        self._delay = round(REACTION * decision_hz)
        self._since_alert: int | None = None

    @property
    def alert(self) -> bool:
        """Whether the agent raises an alert."""
        return bool(self.agent.alert)

    def reset(self, seed: int | None = None) -> None:
        """Reset the agent and the reaction timer."""
        self.agent.reset(seed)
        self._since_alert = None

    def act(self, observation: dict[str, Any], info: dict[str, Any]) -> np.ndarray:
        """Return the driver's demand, shape (1,), float32."""
        self.agent.act(observation, info)
        if self._since_alert is not None:
            self._since_alert += 1
        elif self.agent.alert:
            self._since_alert = 0
        brakes = self._since_alert is not None and self._since_alert >= self._delay
        return np.array([self._demand if brakes else 0.0], dtype=np.float32)
