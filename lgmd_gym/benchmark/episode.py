"""Play one agent through one case with one seed, and keep what happened."""

from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np

from lgmd_gym.agents import Agent
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.envs import env_id

# One value per decision each; `held` is 1 while a standing ego is kept from starting, which no deceleration
# shows.
SERIES = (
    "time",
    "ego_speed",
    "gap",
    "ttc",
    "drac",
    "deceleration",
    "target_speed",
    "spike_frequency",
    "membrane_potential",
    "ffi",
    "alert",
    "held",
)
TRUTHS = ("ego_speed", "gap", "ttc", "drac", "deceleration", "target_speed")  # of `info`
SIGNALS = ("spike_frequency", "membrane_potential", "ffi")  # of the observation, the highest of all cameras


@dataclass(frozen=True, slots=True)
class Episode:
    """What happened, one value per decision and the outcome.

    Attributes:
        series: Name to array of shape (decisions + 1,); NaN where undefined. The first value is the reset's.
        collision: Whether the ego touched anybody.
        impact_speed: The ego's speed at the touch [m/s]; NaN without one.
        relative_impact_speed: Less the other's along the ego's heading [m/s]; NaN without a touch.
        target_width: Width of the first actor [m]; NaN on an empty road.
        fps: Camera frames per second [Hz].
        target_shade: Body grey of the first actor in [0, 255]; NaN on an empty road.
        reward_sum: Sum of the environment's rewards, the return without discount.
    """

    series: dict[str, np.ndarray]
    collision: bool
    impact_speed: float
    relative_impact_speed: float
    target_width: float
    fps: float
    target_shade: float = float("nan")
    reward_sum: float = float("nan")


def make_env(case: Case, sensor_config: SensorConfig, **options: Any) -> gym.Env:
    """Return the environment of a case; `options` go to `gym.make`."""
    return gym.make(
        env_id(case.family),
        **sensor_config.of().arguments,
        trace=True,
        **dict(case.arguments),
        **options,
    )


def play(env: gym.Env, agent: Agent, seed: int) -> Episode:
    """Play one episode to its end.

    Args:
        env: A braking environment inside `LGMDObservation`.
        agent: Who acts.
        seed: Of the environment and of the agent.
    """
    observation, info = env.reset(seed=seed)
    agent.reset(seed)
    policy_hz = env.unwrapped.config["policy_frequency"]  # type: ignore[attr-defined]
    rows: list[tuple[float, ...]] = []
    done, total = False, 0.0
    while True:
        # The agent judges what it has seen before the moment is noted, so that its alert belongs to it.
        action = agent.act(observation, info)
        held = info["ego_speed"] == 0.0 and float(action[0]) < 0.0
        rows.append((len(rows) / policy_hz, *_moment(observation, info), float(agent.alert), float(held)))
        if done:
            break
        observation, reward, terminated, truncated, info = env.step(action)
        total += float(reward)
        done = terminated or truncated
    base: Any = env.unwrapped
    actors, seen = base.scenario.actors, base.road.obstacles
    return Episode(
        series={name: np.array(column) for name, column in zip(SERIES, zip(*rows, strict=True), strict=True)},
        collision=bool(info["collision"]),
        impact_speed=info["impact_speed"],
        relative_impact_speed=info["relative_impact_speed"],
        target_width=actors[0].width if actors else float("nan"),
        fps=env.get_wrapper_attr("fps"),
        target_shade=float(seen[0].shade) if seen else float("nan"),
        reward_sum=total,
    )


def _moment(observation: dict[str, Any], info: dict[str, Any]) -> tuple[float, ...]:
    """Return one value for each name in `SERIES` but time, alert and held."""
    return (*(info[name] for name in TRUTHS), *(float(np.max(observation[name])) for name in SIGNALS))
