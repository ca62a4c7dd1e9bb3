"""Play one case, and show or record the composed picture of it."""

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym

import lgmd_gym  # noqa: F401  (registers the ids)
from lgmd_gym.agents import Agent
from lgmd_gym.benchmark.suites import SUITES, find_case
from lgmd_gym.benchmark.suites import TRAFFIC
from lgmd_gym.envs import FAMILIES, env_id
from lgmd_gym.envs.registration import RANDOM
from lgmd_gym.envs.traffic.registration import KINDS, make_traffic
from lgmd_gym.errors import unknown_name
from lgmd_gym.rendering.dashboard import SIZE
from lgmd_gym.rendering.view import LGMDView
from lgmd_gym.rendering.window import Window
from lgmd_gym.video import VideoWriter

LINGER = 1.0  # [s] for which the last picture stays


@dataclass(frozen=True, slots=True)
class Drive:
    """How a drive ended.

    Attributes:
        collision: Whether the ego touched anybody.
        impact_speed: Relative, NaN without contact [m/s].
        ego_speed: At the end [m/s].
        gap: At the end; NaN with nothing ahead [m].
        duration: Simulated time [s].
        stopped: Whether the window was closed before the end.
    """

    collision: bool
    impact_speed: float
    ego_speed: float
    gap: float
    duration: float
    stopped: bool = False


def make_target(target: str, arguments: dict[str, Any], **options: Any) -> gym.Env:
    """Return the environment of an id, a case's name, or a kind of traffic.

    Args:
        target: As "LGMD/CCRs-v0", "quick/CCRs/v30" or "traffic/merge".
        arguments: The scenario's arguments, over those of the case; traffic takes none.
        **options: `camera`, `params` and `render_mode`.

    Raises:
        ValueError: For an unknown target (the nearest is named) or argument.
    """
    ids = [env_id(family) for family in (*FAMILIES, RANDOM)]
    if target in ids:
        return gym.make(target, **options, **arguments)
    kinds = [f"{TRAFFIC}/{kind}" for kind in KINDS]
    if target in kinds:
        if arguments:
            raise ValueError(f"{target} takes no scenario arguments, got {', '.join(arguments)}")
        return make_traffic(target.removeprefix(f"{TRAFFIC}/"), **options)
    cases = [case.name for suite in SUITES.values() for case in suite.cases]
    if target not in cases:
        raise unknown_name("environment or case", target, [*ids, *cases, *kinds])
    case = find_case(target)
    return gym.make(env_id(case.family), **options, **{**dict(case.arguments), **arguments})


def drive(
    target: str,
    agent: Agent,
    seed: int,
    arguments: dict[str, Any],
    video: Path | None = None,
    live: bool = False,
    overlays: tuple[str, ...] = (),
    **sensor_config: Any,
) -> Drive:
    """Play one episode, and show or write the composed picture if asked to.

    Args:
        target: See `make_target`.
        agent: Who brakes.
        seed: Of the environment and the agent.
        arguments: The scenario's arguments, over those of the case.
        video: The file to write, which must not exist; None to write none.
        live: Whether to show a window, in real time.
        overlays: See `LGMDView`.
        **sensor_config: `camera` and `params` of `LGMDObservation`.

    Raises:
        ValueError: For an unknown name, a video that cannot be written, or no display.
    """
    with ExitStack() as stack:
        env = make_target(target, arguments, **sensor_config)
        stack.callback(env.close)
        if video is None and not live:
            return _play(env, agent, seed, None)
        view = LGMDView(env, title=f"{target}   {agent.name}   seed {seed}", overlays=overlays)
        rate = float(view.metadata["render_fps"])
        writer = stack.enter_context(VideoWriter(video, rate)) if video is not None else None
        window = stack.enter_context(Window(target, SIZE, rate)) if live else None
        return _play(view, agent, seed, Screen(view, writer, window))


class Screen:
    """Where the pictures of a view go: a file, a window, or both."""

    def __init__(self, view: LGMDView, writer: VideoWriter | None, window: Window | None) -> None:
        self._view, self._writer, self._window = view, writer, window

    def show(self, alert: bool) -> bool:
        """Draw the present picture and pass it on; return whether anybody still watches."""
        self._view.agent_alert = alert
        picture = self._view.render()
        if self._writer is not None:
            self._writer.write(picture)
        return self._window is None or self._window.show(picture)


def _play(env: gym.Env, agent: Agent, seed: int, screen: Screen | None) -> Drive:
    observation, info = env.reset(seed=seed)
    agent.reset(seed)
    rate = env.unwrapped.config["policy_frequency"]  # type: ignore[attr-defined]
    done, watched, decisions = False, True, 0
    while True:
        # The agent judges what it has seen before the picture is drawn, so that its alert belongs to it.
        action = agent.act(observation, info)
        if screen is not None:
            watched = screen.show(agent.alert)
        if done or not watched:
            break
        observation, _, terminated, truncated, info = env.step(action)
        done = terminated or truncated
        decisions += 1
    for _ in range(round(LINGER * rate)):
        if screen is None or not watched:
            break
        watched = screen.show(agent.alert)
    impact = info["relative_impact_speed"]
    ended = bool(info["collision"]), impact, info["ego_speed"], info["gap"], decisions / rate
    return Drive(*ended, stopped=not done)
