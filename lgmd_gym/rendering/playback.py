# pyright: standard
# Not strict: highway-env states few types.
"""Playback of one episode, with the dashboard in a window or a video file."""

from collections.abc import Callable, Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym

import lgmd_gym  # noqa: F401  (registers the ids)
from lgmd_gym.agents import Agent
from lgmd_gym.aliases import Arguments
from lgmd_gym.benchmark.case import TRAFFIC_SUITES, Case
from lgmd_gym.benchmark.episode import with_config
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import SUITES, find_case
from lgmd_gym.clips import VideoWriter
from lgmd_gym.envs import env_id
from lgmd_gym.envs.registration import TRAFFIC_KINDS, traffic_id
from lgmd_gym.errors import unknown_name
from lgmd_gym.rendering.dashboard import SIZE
from lgmd_gym.rendering.display import checked_overlays
from lgmd_gym.rendering.view import LGMDView
from lgmd_gym.rendering.window import Window

FINAL_SECONDS = 1.0  # [s], for which the last picture stays


@dataclass(frozen=True, slots=True)
class PlaybackResult:
    """Result of an episode; undefined values are infinite.

    Attributes:
        collision: Whether the ego had contact.
        impact_speed: Relative speed at contact [m/s].
        ego_speed: Ego speed at the end [m/s].
        gap: Free distance ahead at the end [m].
        duration: Simulated time [s].
        stopped: Whether the window was closed before the end of the episode.
    """

    collision: bool
    impact_speed: float
    ego_speed: float
    gap: float
    duration: float
    stopped: bool = False


def make_target(target: str | Case, arguments: Arguments, **options: Any) -> gym.Env:
    """Return the environment of an id, a benchmark case or a kind of traffic.

    Args:
        target: For example "LGMD/CCRs-v0", "quick/CCRs/v30" or "traffic/merge"; or a case, such as that of a
            file, see `find_own_case`.
        arguments: Scenario arguments, which override those of the case; not for traffic.
        **options: Further arguments of `gym.make`, for example `camera`, `params` or `render_mode`.

    Raises:
        ValueError: For an unknown target or argument.
    """
    if isinstance(target, Case):
        chosen = {**dict(target.arguments), **arguments}
        return gym.make(env_id(target.environment), **options | chosen)  # a case may state world and weather
    traffic = {
        f"{suite}/{kind}": (kind, attention)
        for suite, attention in TRAFFIC_SUITES.items()
        for kind in TRAFFIC_KINDS
    }
    if target in traffic:
        kind, attention = traffic[target]
        target, options = traffic_id(kind), options | {"attention": attention}
    if target in map(traffic_id, TRAFFIC_KINDS) and arguments:
        raise ValueError(f"{target} must have no scenario arguments, got {', '.join(arguments)}; remove them")
    ids = [name for name in gym.registry if name.startswith("LGMD/")]
    if target in ids:
        return gym.make(target, **options, **arguments)
    cases = [case.name for suite in SUITES.values() for case in suite.cases]
    if target not in cases:
        hint = (
            "lgmd-gym list envs and lgmd-gym list cases print all names; "
            "a family of your own requires --module"
        )
        raise unknown_name("environment or case", target, [*ids, *cases, *traffic], hint)
    return make_target(find_case(target), arguments, **options)


def play_episode(
    target: str | Case,
    agent: Agent,
    seed: int,
    arguments: Arguments,
    video: Path | None = None,
    live: bool = False,
    overlays: tuple[str, ...] = (),
    sensors: SensorConfig | None = None,
    surroundings: Mapping[str, object] | None = None,
    progress: Callable[[float], None] | None = None,
) -> PlaybackResult:
    """Run one episode, and optionally show or record the dashboard.

    Args:
        target: See `make_target`.
        agent: The agent that controls the ego.
        seed: Seed of the environment and the agent.
        arguments: Scenario arguments, which override those of the case.
        video: Path of the video file, which must not exist; None for no video.
        live: Whether to open a window, in real time.
        overlays: See `LGMDView`.
        sensors: Cameras and neurons; None for those of the agent.
        surroundings: Arguments `world` and `weather` of the environment; None for its defaults.
        progress: Called after every decision with the simulated time [s].

    Raises:
        ValueError: For an unknown name, a video that cannot be written, or a missing display.
    """
    if seed < 0:
        raise ValueError(f"seed must be >= 0, got {seed}")
    checked_overlays(overlays)
    sensors = (sensors or SensorConfig()).for_agent(agent)
    with ExitStack() as stack:
        config = agent.config
        if _is_traffic(target) and config:
            raise ValueError(
                f"agent {agent.name} requires braking environments, got traffic {target}; use ttc-oracle"
            )
        options = with_config({**sensors.arguments, **(surroundings or {})}, config)
        env = make_target(target, arguments, **options)
        stack.callback(env.close)
        if video is None and not live:
            return _play(env, agent, seed, lambda: True, progress)
        name = target.name if isinstance(target, Case) else target
        view = LGMDView(env, title=f"{name}   {agent.name}   seed {seed}", overlays=overlays)
        rate = float(view.metadata["render_fps"])
        writer = stack.enter_context(VideoWriter(video, rate)) if video is not None else None
        window = stack.enter_context(closing(Window(name, SIZE, rate))) if live else None

        def show() -> bool:
            view.agent_alert = agent.alert
            picture = view.render()
            assert picture is not None  # mode "rgb_array"
            if writer is not None:
                writer.write(picture)
            return window is None or window.show(picture)

        result = _play(view, agent, seed, show, progress)
        if not result.stopped:
            any(not show() for _ in range(round(FINAL_SECONDS * rate)))
        return result


def _is_traffic(target: str | Case) -> bool:
    """Return whether a target is traffic, which takes no configuration of `BrakingEnv`."""
    if isinstance(target, Case):
        return False
    return target.partition("/")[0] in TRAFFIC_SUITES or target in map(traffic_id, TRAFFIC_KINDS)


def _play(
    env: gym.Env,
    agent: Agent,
    seed: int,
    show: Callable[[], bool],
    progress: Callable[[float], None] | None,
) -> PlaybackResult:
    """Run one episode until it ends, or until `show` returns False; see `play_episode`."""
    observation, info = env.reset(seed=seed)
    agent.reset(seed)
    done, decisions = False, 0
    rate: float = env.unwrapped.config["policy_frequency"]  # type: ignore[attr-defined]
    while True:
        # The agent acts before the picture is drawn, because the picture shows its alert.
        action = agent.act(observation, info)
        is_open = show()
        if done or not is_open:
            break
        observation, _, terminated, truncated, info = env.step(action)
        done = terminated or truncated
        decisions += 1
        if progress is not None:
            progress(decisions / rate)
    return PlaybackResult(
        collision=bool(info["collision"]),
        impact_speed=info["relative_impact_speed"],
        ego_speed=info["ego_speed"],
        gap=info["gap"],
        duration=decisions / rate,
        stopped=not done,
    )
