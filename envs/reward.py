"""The reward: get along, do not touch, do not brake or jerk without need."""

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from lgmd_gym.envs import surrogate_safety as measures
from lgmd_gym.envs.dynamics.units import check_within

if TYPE_CHECKING:
    from lgmd_gym.envs.braking import BrakingEnv


@dataclass(frozen=True, slots=True, kw_only=True)
class RewardParams:
    """Weights of the reward, each >= 0.

    Attributes:
        contact: Cost of touching at all.
        impact: Further cost of a contact at the ego's scripted speed; falls with the square of the
            relative impact speed, as the energy does.
        progress: Gain per second at the scripted speed.
        brake: Cost per second of full braking while no contact is within `need_ttc`.
        jerk: Cost per change of the acceleration by its full range.
        need_ttc: Time to contact below which braking is free [s]; the protocols' T0.
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
    """Return the reward of the decision that has just been played.

    Args:
        env: After the step.
        params: The weights.
        speed: The ego's speed before the step [m/s].
        acceleration: The ego's acceleration before the step [m/s²].
    """
    ego, contact = env.ego, env.road.contact
    scripted = env.scenario.top_speed
    dt = 1.0 / env.config["policy_frequency"]
    reward = params.progress * dt * min((speed + ego.speed) / (2.0 * scripted), 1.0)
    reward -= params.jerk * abs(ego.acceleration - acceleration) / ego.brake.max_deceleration
    if contact is not None:
        return reward - params.contact - params.impact * (contact.relative_impact_speed / scripted) ** 2
    if ego.braking > 0.0:
        ttc = measures.time_to_contact(ego, env.road.obstacles)
        if not ttc < params.need_ttc:
            reward -= params.brake * dt * ego.braking / ego.brake.max_deceleration
    return reward
