"""Episodes: one agent in one environment with one seed."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np

from lgmd_gym.agents.base import Driver
from lgmd_gym.aliases import Arguments, Config, Info, Values
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.envs import env_id
from lgmd_gym.envs.families.scenario import Scenario


class Step(NamedTuple):
    """Result of a reset or of one step of an environment."""

    observation: Values
    info: Info
    reward: float = 0.0
    done: bool = False


@dataclass(frozen=True, slots=True)
class Episode:
    """Time series and outcome of one episode."""

    # arrays of shape (decisions + 1,) by name, the first value from the reset; inf where undefined
    series: dict[str, np.ndarray]
    collision: bool  # whether the ego had contact
    impact_speed: float  # ego speed at contact [m/s]; inf without contact
    # impact speed minus the target's speed along the ego's heading [m/s]; inf without contact
    relative_impact_speed: float
    target_width: float  # width of the first actor [m]; NaN on an empty road
    fps: float  # camera frame rate [Hz]
    target_shade: float = float("nan")  # grey level of the first actor in [0, 255]; NaN on an empty road
    reward_sum: float = float("nan")  # undiscounted return of the environment
    world: int | None = None  # number of the world; None for the laboratory

    @classmethod
    def of(
        cls,
        series: dict[str, np.ndarray],
        info: Mapping[str, Any],
        scenario: Scenario,
        shade: float,
        fps: float,
        reward_sum: float,
        world: int,
    ) -> "Episode":
        """Return an episode from its series, last info, scenario, return and world.

        `shade` is the grey level of the first solid actor, or NaN; `world` is -1 for the laboratory.
        """
        return cls(
            series=series,
            collision=bool(info["collision"]),
            impact_speed=info["impact_speed"],
            relative_impact_speed=info["relative_impact_speed"],
            target_width=scenario.actors[0].width if scenario.actors else float("nan"),
            fps=fps,
            target_shade=shade,
            reward_sum=reward_sum,
            world=None if world < 0 else world,
        )


def with_config(arguments: Mapping[str, Any], config: Config) -> Arguments:
    """Return arguments of an environment with further keys of its configuration."""
    if not config:
        return dict(arguments)
    return {**arguments, "config": {**(arguments.get("config") or {}), **config}}


def make_env(case: Case, sensor_config: SensorConfig, arguments: Mapping[str, Any] | None = None) -> gym.Env:
    """Return the environment of a case, with its arguments or others in their place."""
    chosen = dict(case.arguments) if arguments is None else dict(arguments)
    return gym.make(env_id(case.environment), trace=True, **sensor_config.for_agent().arguments | chosen)


def rollout(env: gym.Env, agent: Driver, seed: int) -> Iterator[tuple[Step, np.ndarray]]:
    """Yield every step of an episode, including the final one, and the agent's action on it."""
    step = Step(*env.reset(seed=seed))
    agent.reset(seed)
    while True:
        action = agent.act(step.observation, step.info)
        yield step, action
        if step.done:
            return
        observation, reward, terminated, truncated, info = env.step(action)
        step = Step(observation, info, float(reward), terminated or truncated)
