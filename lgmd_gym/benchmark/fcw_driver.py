"""The driver of Euro NCAP's warning tests, who brakes on the agent's alert."""

from typing import Any

import numpy as np

REACTION = 1.2  # [s] from the alert to the brake, Euro NCAP AEB C2C v4.3.1, 8.4.6
LEVEL = 4.0  # [m/s²], the same


class FCWDriver:
    """Brakes at 4 m/s², 1.2 s after an agent's first alert; the agent's own demands do nothing.

    Args:
        agent: Who warns.
        max_deceleration: Of full braking [m/s²].
        decision_hz: Decisions per second [Hz].
    """

    def __init__(self, agent: Any, max_deceleration: float, decision_hz: float) -> None:
        self.agent = agent
        self.name = f"{agent.name} (warned driver)"
        self._demand = -LEVEL / max_deceleration
        self._wait = round(REACTION * decision_hz)
        self._since_alert: int | None = None

    @property
    def alert(self) -> bool:
        """Whether the agent warns."""
        return bool(self.agent.alert)

    def reset(self, seed: int | None = None) -> None:
        """Forget the last episode."""
        self.agent.reset(seed)
        self._since_alert = None

    def act(self, observation: dict[str, Any], info: dict[str, Any]) -> np.ndarray:
        """Return the driver's demand, shape (1,), float32."""
        self.agent.act(observation, info)
        if self._since_alert is not None:
            self._since_alert += 1
        elif self.agent.alert:
            self._since_alert = 0
        brakes = self._since_alert is not None and self._since_alert >= self._wait
        return np.array([self._demand if brakes else 0.0], dtype=np.float32)
