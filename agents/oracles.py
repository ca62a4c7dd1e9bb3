"""Agents that are told the truth: bounds of what any eye could reach, and of what looming models could."""

from math import exp, hypot, isfinite, nan
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.agents.base import BRAKE, HOLD, Agent
from lgmd_gym.agents.options import positive
from lgmd_gym.agents.stopping_zone import stopping_distance

TARGET_WIDTH = 1.712  # [m], ISO 19206-3: the truth holds no width
DECISION = 1 / 30  # [s]


class Oracle(Agent):
    """Base of the oracles: brakes fully once `due`, and keeps braking."""

    def __init__(self) -> None:
        super().__init__()
        self._latched = False

    @property
    def alert(self) -> bool:
        """Whether it has begun to brake."""
        return self._latched

    def reset(self, seed: int | None = None) -> None:
        """Release the brake."""
        super().reset(seed)
        self._latched = False

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Brake fully if latched."""
        self._latched = self.due(info) or self._latched
        return BRAKE if self._latched else HOLD

    def due(self, info: dict[str, Any]) -> bool:
        """Return whether the present moment gives reason to brake."""
        raise NotImplementedError


class TTCOracle(Oracle):
    """Brakes fully once the true time to contact falls to a threshold, and keeps braking.

    Args:
        ttc: Threshold, > 0 [s]. The default holds for all the protocol suites with the default brake; the
            hardest is a lead car that brakes at 0.5 g from 80 km/h 40 m ahead (1.8 s is too late there).
    """

    name = "ttc-oracle"

    def __init__(self, ttc: float = 2.0) -> None:
        super().__init__()
        self.ttc = positive("ttc", ttc)

    def due(self, info: dict[str, Any]) -> bool:
        """Compare; NaN (no contact ahead) is never due."""
        return bool(info["ttc"] <= self.ttc)


class StoppingDistanceOracle(Oracle):
    """Brakes fully at the last moment at which stopping behind the car in the way is still possible.

    The other is taken to keep its deceleration, which is told by its last two speeds. Only what lies on the
    ego's path counts, so what crosses from the side is seen late.

    Args:
        deceleration: Of full braking, > 0 [m/s²].
        reaction: From the demand to full braking, > 0 [s].
        margin: Distance to spare, > 0 [m].
    """

    name = "stopping-distance-oracle"

    def __init__(self, deceleration: float = 9.0, reaction: float = 0.4, margin: float = 1.5) -> None:
        super().__init__()
        self.deceleration = positive("deceleration", deceleration)
        self.reaction = positive("reaction", reaction)
        self.margin = positive("margin", margin)
        self._before = nan

    def reset(self, seed: int | None = None) -> None:
        """Release the brake and forget the other's speed."""
        super().reset(seed)
        self._before = nan

    def due(self, info: dict[str, Any]) -> bool:
        """Return whether the gap is down to what stopping takes."""
        speed, other, gap = info["ego_speed"], info["target_speed"], info["gap"]
        slowing = (self._before - other) / DECISION
        self._before = other
        if not (isfinite(gap) and isfinite(other)) or speed <= other:
            return False
        closing = speed - other
        needed = stopping_distance(closing, self.deceleration, self.reaction)
        if slowing > 1.0:  # it stops first: both ways to standstill count
            stop = stopping_distance(speed, self.deceleration, self.reaction)
            needed = max(needed, stop - other**2 / (2 * slowing))
        return bool(gap <= needed + self.margin)


class _Angle(NamedTuple):
    """Angle under which what is ahead is seen from the lens [rad], and its rate of growth [rad/s]."""

    size: float
    growth: float


def _seen_angle(info: dict[str, Any], setback: float = 1.7) -> _Angle | None:
    """Return the angle of what lies on the ego's path; None if nothing does."""
    if not (isfinite(info["gap"]) and isfinite(info["target_speed"])):
        return None
    distance, half = info["gap"] + setback, TARGET_WIDTH / 2
    closing = info["ego_speed"] - info["target_speed"]
    size = 2 * float(np.arctan2(half, distance))
    return _Angle(size=size, growth=2 * half * closing / hypot(distance, half) ** 2)


class EtaOracle(Oracle):
    """The looming model η = θ′ · e^(−αθ) of Gabbiani et al. on the true angle θ of what is ahead.

    The locust's DCMD peaks at a fixed angular size, 2·atan(1/α), whatever the speed. It brakes once η reaches
    a threshold, so that what it misses the model misses, and no eye.

    Args:
        threshold: Of η, > 0 [rad/s].
        alpha: Weight of the inhibition by size, > 0 [1/rad].
    """

    name = "eta-oracle"

    def __init__(self, threshold: float = 0.03, alpha: float = 2.0) -> None:
        super().__init__()
        self.threshold, self.alpha = positive("threshold", threshold), positive("alpha", alpha)

    def due(self, info: dict[str, Any]) -> bool:
        """Compare η with the threshold."""
        seen = _seen_angle(info)
        return seen is not None and seen.growth * exp(-self.alpha * seen.size) >= self.threshold


class TauOracle(Oracle):
    """The looming model τ = θ/θ′ (Lee) on the true angle θ of what is ahead: time to contact by optics.

    Args:
        tau: Threshold, > 0 [s].
    """

    name = "tau-oracle"

    def __init__(self, tau: float = 1.8) -> None:
        super().__init__()
        self.tau = positive("tau", tau)

    def due(self, info: dict[str, Any]) -> bool:
        """Compare τ with the threshold; what does not grow is never due."""
        seen = _seen_angle(info)
        return seen is not None and seen.growth > 0.0 and seen.size / seen.growth <= self.tau
