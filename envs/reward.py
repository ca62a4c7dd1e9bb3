"""Reward of the braking environments: progress, minus contact, needless braking and jerk."""

from dataclasses import astuple, dataclass, fields
from typing import Any

import numpy as np

from lgmd_gym.envs.dynamics.bodies import ego_braking
from lgmd_gym.errors import check_within
from lgmd_gym.kernels import kernel

REWARD = np.dtype(
    [(name, np.float64) for name in ("contact", "impact", "progress", "brake", "jerk", "need_ttc")]
)
"""`RewardParams` for the compiled functions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RewardParams:
    """Weights of the reward, each >= 0; see `BrakingEnv` for the formula.

    Attributes:
        contact: Cost of a contact.
        impact: Additional cost of a contact at a relative impact speed of at least the scripted speed; below,
            proportional to the square of the relative impact speed, as the energy is.
        progress: Gain per second at the scripted speed [1/s].
        brake: Cost of full braking while no contact is within `need_ttc` [1/s].
        jerk: Cost of a change of the acceleration by `max_deceleration`.
        need_ttc: Time to contact below which braking has no cost [s]; T0 of the protocols.
    """

    contact: float = 10.0
    impact: float = 10.0
    progress: float = 1.0
    brake: float = 2.0
    jerk: float = 0.05
    need_ttc: float = 4.0

    def __post_init__(self) -> None:
        for item in fields(self):
            check_within(item.name, getattr(self, item.name), 0.0, 1e6)

    def record(self) -> np.ndarray:
        """Return the weights as a `REWARD` record of shape ()."""
        return np.array(astuple(self), REWARD)


@kernel(exact=True)
def step_reward(body: Any, ego: Any, episode: Any, brake: Any, weights: Any, ttc: float, dt: float) -> float:
    """Return the reward of the last decision.

    Args:
        body: The ego's `BODY` record after the decision.
        ego: `EGO_STATE` record.
        episode: `EPISODE` record.
        brake: `BRAKE` record.
        weights: `REWARD` record.
        ttc: Time to contact after the decision [s].
        dt: Duration of the decision [s].
    """
    scripted = episode.top_speed
    reward = weights.progress * dt * min((episode.last_speed + body.speed) / (2.0 * scripted), 1.0)
    reward -= weights.jerk * abs(body.acceleration - episode.last_acceleration) / brake.max_deceleration
    if episode.touched > 0:
        severity = min(episode.relative_impact_speed / scripted, 1.0)
        return reward - weights.contact - weights.impact * severity**2
    braking = ego_braking(body, ego)
    if braking > 0.0 and ttc >= weights.need_ttc:
        reward -= weights.brake * dt * braking / brake.max_deceleration
    return reward
