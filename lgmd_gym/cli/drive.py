"""The `drive` command."""

import sys
from math import isfinite
from traceback import format_exc, walk_tb

from lgmd_gym.agents import Agent, make_agent
from lgmd_gym.agents.adapter import AgentAdapter
from lgmd_gym.benchmark.failures import describe_failure
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.cli.console import activity
from lgmd_gym.cli.modules import find_target
from lgmd_gym.cli.options import Drive
from lgmd_gym.cli.params import note_unused_params, parse_arguments, parse_world, read_params
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.rendering.playback import play_episode


def run(options: Drive) -> int:
    """Run one episode and print how it ended."""
    agent = make_agent(options.agent)
    note_unused_params(options.params, [agent])
    target = find_target(options.target, options.case, options.module, options.trust)
    arguments = parse_arguments(options.set)
    sensors = SensorConfig(options.camera, read_params(options.params))
    surroundings = parse_world(options.world)
    if options.condition is not None:
        surroundings["condition"] = options.condition
    try:
        with activity("preparing the episode") as show:
            result = play_episode(
                target,
                agent,
                options.seed,
                arguments,
                video=options.video,
                live=options.live,
                overlays=options.overlays,
                sensors=sensors,
                surroundings=surroundings,
                progress=lambda time: show(f"{time:.1f} s simulated"),
            )
    except Exception as error:
        if not _is_of_agent(agent, error):
            raise
        failure = describe_failure(format_exc())
        raise ValueError(f"agent {agent.name!r} failed: {failure}") from error
    if result.stopped:
        print(f"window closed after {result.duration:.2f} s")
    elif result.collision:
        print(f"contact at {result.impact_speed / KMH:.1f} km/h relative speed after {result.duration:.2f} s")
    else:
        gap = f"free distance ahead {result.gap:.2f} m" if isfinite(result.gap) else "no vehicle ahead"
        print(f"no contact: {result.ego_speed / KMH:.1f} km/h after {result.duration:.2f} s, {gap}")
    if options.video is not None:
        print(f"video: {options.video}")
    return 0


def _is_of_agent(agent: Agent, error: Exception) -> bool:
    """Return whether an exception passed through the module of a user's agent."""
    if not isinstance(agent, AgentAdapter):
        return False
    module = getattr(sys.modules[type(agent.agent).__module__], "__file__", None)
    return any(frame.f_code.co_filename == module for frame, _ in walk_tb(error.__traceback__))
