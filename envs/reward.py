"""Reward of the braking environments: progress, minus contact, needless braking and jerk."""

import numpy as np

from lgmd_gym.envs.dynamics.bodies import ego_braking
from lgmd_gym.fields import Record, number, record
from lgmd_gym.kernels import kernel

REWARD = np.dtype(
    [(name, np.float64) for name in ("contact", "impact", "progress", "brake", "jerk", "need_ttc")]
)
"""`RewardParams` for the compiled functions."""


@record
class RewardParams(Record):
    """Weights of the reward; see `BrakingEnv` for the formula."""

    contact: float = number(10.0, "[0, 1e6]", "", "Cost of a contact.")
    impact: float = number(
        10.0,
        "[0, 1e6]",
        "",
        "Additional cost of a contact at a relative impact speed of at least the scripted speed; below, "
        "proportional to the square of the relative impact speed, as the energy is.",
    )
    progress: float = number(1.0, "[0, 1e6]", "1/s", "Gain per second at the scripted speed.")
    brake: float = number(
        2.0, "[0, 1e6]", "1/s", "Cost of full braking while no contact is within `need_ttc`."
    )
    jerk: float = number(0.05, "[0, 1e6]", "", "Cost of a change of the acceleration by `max_deceleration`.")
    need_ttc: float = number(
        4.0, "[0, 1e6]", "s", "Time to contact below which braking has no cost; T0 of the protocols."
    )

    def record(self) -> np.ndarray:
        """Return the weights as a `REWARD` record of shape ()."""
        weights = np.zeros((), REWARD)
        for name, value in self.to_dict().items():
            weights[name] = value
        return weights


@kernel(exact=True)
def step_reward(
    body: np.record,
    ego: np.record,
    episode: np.record,
    brake: np.record,
    weights: np.record,
    ttc: float,
    dt: float,
) -> float:
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
