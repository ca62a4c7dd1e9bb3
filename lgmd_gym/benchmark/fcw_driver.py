"""The driver model of Euro NCAP's forward collision warning (FCW) tests."""

from collections.abc import Callable, Sequence

import numpy as np

from lgmd_gym.agents.base import BatchAgent, Infos, Observations
from lgmd_gym.aliases import Values

REACTION = 1.2  # [s] from the alert to braking, Euro NCAP AEB C2C v4.3.1, 8.4.6
DECELERATION = 4.0  # [m/s²], same section


class FCWDriver(BatchAgent):
    """Brakes at 4 m/s², 1.2 s after the first alert of an agent, and ignores the agent's demands.

    Args:
        agent: Agent that raises the alert, in N environments.
        max_deceleration: Returns the deceleration of full braking in the present episodes, shape (N,) [m/s²].
        decision_hz: Decision rate [Hz].
    """

    def __init__(
        self, agent: BatchAgent, max_deceleration: Callable[[], np.ndarray], decision_hz: float
    ) -> None:
        self.agent = agent
        self.name = f"{agent.name} (FCW driver)"
        self._max_deceleration = max_deceleration
        self._delay = round(REACTION * decision_hz)
        self._allocate(agent.num_envs)

    def initial(self) -> Values:
        """Return the number of decisions since the first alert, -1 before it."""
        return {"since_alert": -1}

    def reset(
        self, mask: np.ndarray | None = None, seeds: Sequence[int | None] | np.ndarray | None = None
    ) -> None:
        """Reset the agent and the reaction timers."""
        super().reset(mask, seeds)
        self.agent.reset(mask, seeds)

    def demands(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return the drivers' demands."""
        self.agent.act(observations, infos, active)
        self.alerts, self.failures = self.agent.alerts, self.agent.failures
        since = self.state["since_alert"]
        since = self.state["since_alert"] = np.where(since < 0, np.where(self.alerts, 0, -1), since + 1)
        limits = self._max_deceleration()
        usable = (since >= self._delay) & (limits > 0.0)  # 0: no episode yet
        return np.divide(-DECELERATION, limits, out=np.zeros(len(limits)), where=usable)
