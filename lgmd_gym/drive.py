"""Play one case and make a video of the eye's view."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym

import lgmd_gym  # noqa: F401  (registers the ids)
from lgmd_gym.agents import Agent
from lgmd_gym.benchmark.suites import SUITES, find_case
from lgmd_gym.envs import env_id
from lgmd_gym.envs.registration import IDS
from lgmd_gym.errors import unknown_name
from lgmd_gym.video import VideoWriter
from lgmd_gym.view import View


@dataclass(frozen=True, slots=True)
class Drive:
    """How a drive ended.

    Attributes:
        collision: Whether the ego touched anybody.
        impact_speed: Relative, NaN without contact [m/s].
        ego_speed: At the end [m/s].
        gap: At the end; NaN with nothing ahead [m].
        duration: Simulated time [s].
    """

    collision: bool
    impact_speed: float
    ego_speed: float
    gap: float
    duration: float


def resolve(target: str, arguments: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Return the environment id and arguments of an id such as LGMD/CCRs-v0 or a case's name.

    Raises:
        ValueError: For an unknown id or case; the nearest is named.
    """
    ids = [env_id(family) for family in IDS]
    if target in ids:
        return target, arguments
    cases = [case.name for suite in SUITES.values() for case in suite.cases]
    if target not in cases:
        raise unknown_name("environment or case", target, [*ids, *cases])
    case = find_case(target)
    return env_id(case.family), {**dict(case.arguments), **arguments}


def drive(
    target: str, agent: Agent, video: Path | None, seed: int, arguments: dict[str, Any], **eyesight: Any
) -> Drive:
    """Play one episode, writing the composed view if `video` is given.

    Args:
        target: An environment id or the name of a case.
        agent: Who brakes.
        video: The file to write, which must not exist; None to write none.
        seed: Of the environment and the agent.
        arguments: The scenario's arguments, over those of the case.
        **eyesight: `camera` and `params` of `LGMDObservation`.
    """
    identity, arguments = resolve(target, arguments)
    env = gym.make(identity, render_mode="rgb_array" if video else None, **eyesight, **arguments)
    try:
        if video is None:
            return _play(env, agent, seed, None, None)
        rate = float(env.unwrapped.config["policy_frequency"])  # type: ignore[attr-defined]
        with VideoWriter(video, rate) as writer:
            return _play(env, agent, seed, View(env, f"{target}   agent: {agent.name}"), writer)
    finally:
        env.close()


def _play(env: gym.Env, agent: Agent, seed: int, view: View | None, writer: VideoWriter | None) -> Drive:
    observation, info = env.reset(seed=seed)
    agent.reset(seed)
    done, decisions = False, 0
    while True:
        action = agent.act(observation, info)
        if view is not None and writer is not None:
            writer.write(view.draw(observation, info, float(action[0]) < 0.0, agent.alert))
        if done:
            break
        observation, _, terminated, truncated, info = env.step(action)
        done = terminated or truncated
        decisions += 1
    duration = decisions / env.unwrapped.config["policy_frequency"]  # type: ignore[attr-defined]
    speed = info["relative_impact_speed"]
    return Drive(bool(info["collision"]), speed, info["ego_speed"], info["gap"], duration)
