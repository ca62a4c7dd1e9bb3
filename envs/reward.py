"""Reward of the braking environments: progress, minus contact, needless braking and jerk."""

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from lgmd_gym.envs.dynamics.units import check_within
from lgmd_gym.envs.surrogate_safety import time_to_contact

if TYPE_CHECKING:
    from lgmd_gym.envs.braking import BrakingEnv


@dataclass(frozen=True, slots=True, kw_only=True)
class RewardParams:
    """Weights of the reward, each >= 0; see `BrakingEnv` for the formula.

    Attributes:
        contact: Cost of a contact.
        impact: Additional cost of a contact at a relative impact speed equal to the scripted speed;
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


def step_reward(env: "BrakingEnv", params: RewardParams, speed: float, acceleration: float) -> float:
    """Return the reward of the last decision.

    Args:
        env: The environment after the step.
        params: Weights.
        speed: Ego speed before the step [m/s].
        acceleration: Ego acceleration before the step [m/s²].
    """
    ego, contact = env.ego, env.road.contact
    scripted = env.scenario.top_speed
    dt = 1.0 / env.config["policy_frequency"]
    reward = params.progress * dt * min((speed + ego.speed) / (2.0 * scripted), 1.0)
    reward -= params.jerk * abs(ego.acceleration - acceleration) / ego.brake.max_deceleration
    if contact is not None:
        return reward - params.contact - params.impact * (contact.relative_impact_speed / scripted) ** 2
    if ego.braking > 0.0 and time_to_contact(ego, env.road.obstacles) >= params.need_ttc:
        reward -= params.brake * dt * ego.braking / ego.brake.max_deceleration
    return reward
