"""Oracles: agents on ground truth, as references without errors of perception."""

from math import exp, hypot, inf, isfinite
from typing import Any

import numpy as np

from lgmd_gym.agents.base import FPS, LatchingAgent
from lgmd_gym.agents.zones import CAMERA_SETBACK, FULL_DECELERATION, stopping_distance
from lgmd_gym.errors import check_positive

TARGET_WIDTH = 1.712  # ISO 19206-3 [m]; `info` has no width
DECISION_INTERVAL = 1 / FPS  # [s]


class TTCOracle(LatchingAgent):
    """Brakes fully when the true time to contact falls to a threshold: TTC ≤ `ttc`.

    Observes `info["ttc"]`.

    Args:
        ttc: Threshold, > 0 [s]. The default avoids all contacts of the protocol suites with the default
            brake, except with oncoming cars (CCFhos, CCFhol), which no braking avoids. The critical case is a
            lead car 40 m ahead that brakes at 0.5 g from 80 km/h, in which 1.8 s is too late.
    """

    name = "ttc-oracle"
    reads_neuron = False

    def __init__(self, ttc: float = 2.0) -> None:
        self.ttc = check_positive("ttc", ttc)

    def brake_condition(self, observation: dict[str, Any], info: dict[str, Any]) -> bool:
        """Return whether the time to contact is at or below the threshold; False without a contact ahead."""
        return bool(info["ttc"] <= self.ttc)


class StoppingDistanceOracle(LatchingAgent):
    """Brakes fully at the latest time at which the ego can stop behind the car ahead.

    Condition: gap ≤ d(v − w) + `margin`, with ego speed v, target speed w < v and the stopping distance
    d(u) = u² / (2 · `deceleration`) + u · `reaction`. If the target decelerates by a > 1 m/s², the right side
    is at least d(v) − w² / (2a) + `margin`; a is the difference of the last two target speeds. Only targets
    on the ego's path count, so that braking for crossing traffic begins late.

    Observes `info["gap"]`, `info["ego_speed"]`, `info["target_speed"]`.

    Args:
        deceleration: Deceleration of full braking, > 0 [m/s²].
        reaction: Time from the demand to full braking, > 0 [s].
        margin: Remaining distance to the target, > 0 [m].
    """

    name = "stopping-distance-oracle"
    reads_neuron = False

    def __init__(
        self, deceleration: float = FULL_DECELERATION, reaction: float = 0.4, margin: float = 1.5
    ) -> None:
        self.deceleration = check_positive("deceleration", deceleration)
        self.reaction = check_positive("reaction", reaction)
        self.margin = check_positive("margin", margin)
        self._previous_target_speed = inf

    def reset(self, seed: int | None = None) -> None:
        """Release the brake and clear all state."""
        super().reset(seed)
        self._previous_target_speed = inf

    def brake_condition(self, observation: dict[str, Any], info: dict[str, Any]) -> bool:
        """Return whether the gap is at or below the required distance."""
        speed, target_speed, gap = info["ego_speed"], info["target_speed"], info["gap"]
        target_deceleration = (self._previous_target_speed - target_speed) / DECISION_INTERVAL
        self._previous_target_speed = target_speed
        if not (isfinite(gap) and isfinite(target_speed)) or speed <= target_speed:
            return False
        required = stopping_distance(speed - target_speed, self.deceleration, self.reaction)
        if 1.0 < target_deceleration < inf:  # both cars come to a standstill
            ego_distance = stopping_distance(speed, self.deceleration, self.reaction)
            required = max(required, ego_distance - target_speed**2 / (2 * target_deceleration))
        return bool(gap <= required + self.margin)


def _visual_angle(info: dict[str, Any]) -> tuple[float, float]:
    """Return the target's visual angle θ at the lens [rad] and θ′ [rad/s]; zeros without a target."""
    if not (isfinite(info["gap"]) and isfinite(info["target_speed"])):
        return 0.0, 0.0
    distance, half_width = info["gap"] + CAMERA_SETBACK, TARGET_WIDTH / 2
    closing_speed = info["ego_speed"] - info["target_speed"]
    theta = 2 * float(np.arctan2(half_width, distance))
    return theta, 2 * half_width * closing_speed / hypot(distance, half_width) ** 2


class EtaOracle(LatchingAgent):
    """Brakes fully when the looming model η = θ′ · e^(−αθ) reaches a threshold (Gabbiani et al.).

    θ is the true visual angle of the target on the ego's path. η peaks at the angular size 2·atan(1/α) for
    every approach speed, as the locust's DCMD neuron does.

    Observes `info["gap"]`, `info["ego_speed"]`, `info["target_speed"]`.

    Args:
        threshold: Threshold of η, > 0 [rad/s].
        alpha: Weight α of the size-dependent inhibition, > 0 [1/rad].
    """

    name = "eta-oracle"
    reads_neuron = False

    def __init__(self, threshold: float = 0.03, alpha: float = 2.0) -> None:
        self.threshold, self.alpha = check_positive("threshold", threshold), check_positive("alpha", alpha)

    def brake_condition(self, observation: dict[str, Any], info: dict[str, Any]) -> bool:
        """Return whether η is at or above the threshold."""
        theta, rate = _visual_angle(info)
        return rate * exp(-self.alpha * theta) >= self.threshold


class TauOracle(LatchingAgent):
    """Brakes fully when the optical time to contact τ = θ/θ′ (Lee) falls to a threshold: τ ≤ `tau`.

    θ is the true visual angle of the target on the ego's path.

    Observes `info["gap"]`, `info["ego_speed"]`, `info["target_speed"]`.

    Args:
        tau: Threshold, > 0 [s].
    """

    name = "tau-oracle"
    reads_neuron = False

    def __init__(self, tau: float = 1.8) -> None:
        self.tau = check_positive("tau", tau)

    def brake_condition(self, observation: dict[str, Any], info: dict[str, Any]) -> bool:
        """Return whether τ is at or below the threshold; False unless θ grows."""
        theta, rate = _visual_angle(info)
        return rate > 0.0 and theta / rate <= self.tau
