"""Agents that are told the truth: bounds of what any eye could reach."""

from typing import Any

from lgmd_gym.agents.base import BRAKE, HOLD, Agent
from lgmd_gym.agents.options import positive


class TTCOracle(Agent):
    """Brakes fully once the true time to contact falls to a threshold, and keeps braking.

    Args:
        ttc: Threshold, > 0 [s]. The default holds for all the protocol suites with the default brake; the
            hardest is a lead car that brakes at 0.5 g from 80 km/h 40 m ahead (1.8 s is too late there).
    """

    name = "ttc-oracle"

    def __init__(self, ttc: float = 2.0) -> None:
        super().__init__()
        self.ttc = positive("ttc", ttc)
        self.reset()

    @property
    def alert(self) -> bool:
        """Whether it has begun to brake."""
        return self._latched

    def reset(self, seed: int | None = None) -> None:
        """Release the brake."""
        super().reset(seed)
        self._latched = False

    def choose(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Brake fully if latched; NaN (no contact ahead) never latches."""
        self._latched = self._latched or info["ttc"] <= self.ttc
        return BRAKE if self._latched else HOLD
