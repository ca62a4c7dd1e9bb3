"""The `drive` command; the attribute docstrings of `Drive` are its help texts."""

import sys
from dataclasses import dataclass
from math import isfinite
from traceback import format_exc, walk_tb
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from lgmd_gym.cli.console import activity
from lgmd_gym.cli.values import (
    File,
    Name,
    Names,
    find_target,
    note_unused_params,
    parse_world,
    read_camera,
    read_params,
)

if TYPE_CHECKING:
    from lgmd_gym.agents import Agent
    from lgmd_gym.rendering.playback import PlaybackResult


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Run one episode and print how it ended; optionally show it in a window or write a video.

    Every picture shows the camera frame, the neuron's layers and spikes, and the road from above.
    """

    target: Annotated[Positional[str], arg(metavar="ENV|CASE|TRAFFIC|FILE")]
    """Environment id (LGMD/CCRs-v0), case (quick/CCRs/v30), kind of traffic (traffic/merge), or path of a
    scenario file, suite file or OpenSCENARIO file."""
    case: Name = None
    """Case of a file with several, for example CutIn/v70/gap8m."""
    agent: str = "spike-threshold"
    """Agent, with options as in spike-threshold:threshold=45."""
    video: File = None
    """Video file to write (.mp4, .gif, ...); must not exist."""
    live: bool = False
    """Show a window in real time; Escape closes it."""
    overlays: Annotated[tuple[str, ...], arg(metavar="[NAME ...]")] = ("zone", "targets")
    """Overlays on the camera frame: zone (lane ahead), targets (vehicles); --overlays alone for none."""
    seed: int = 0
    """Seed of the environment: start position and grey level of the target."""
    world: Annotated[str | None, arg(metavar="N|laboratory")] = None
    """World: a number from 0 to 9999, or laboratory. Default: a training world, drawn by the seed."""
    condition: Name = None
    """Weather: clear, night, night_upper_beam, fog, rain or low_sun, or mixed for that of the world;
    not for random levels, which draw their own. Default: clear."""
    camera: Name = None
    """Camera preset: wide, standard, tele, fovea, paper or birdseye; or a TOML file with the fields of a
    camera, or of several as [[camera]] tables. Default: the agent's own, else fovea."""
    params: File = None
    """TOML file of LGMD parameters."""
    neuron: Name = None
    """Neuron model of cameras without their own, with options, or MODULE:FACTORY. Default: lgmd."""
    module: Names = None
    """Modules with scenario families of your own: my_scenarios, or my_scenarios:MyFamily."""
    trust: bool = False
    """Load the modules that the file names; they can run any code."""
    set: Annotated[tuple[str, ...], arg(metavar="NAME=VALUE [...]")] = ()
    """Scenario arguments in SI units, for example --set ego_speed=8.3 shade=40 lying=true; for an
    OpenSCENARIO file, values of its parameters."""


def run(options: Drive) -> int:
    """Run one episode and print how it ended."""
    from lgmd_gym.agents import make_agent
    from lgmd_gym.benchmark.runner import describe_failure
    from lgmd_gym.benchmark.sensors import SensorConfig
    from lgmd_gym.engine.first_use import compile_kernels
    from lgmd_gym.rendering.playback import play_episode

    agent = make_agent(options.agent)
    note_unused_params(options.params, [agent])
    target, arguments = find_target(options.target, options.case, options.module, options.trust, options.set)
    sensors = SensorConfig(read_camera(options.camera), read_params(options.params), neuron=options.neuron)
    surroundings = parse_world(options.world)
    if options.condition is not None:
        surroundings["weather"] = options.condition
    try:
        with activity("preparing the episode") as show:
            compile_kernels()
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
    _print_result(result)
    if options.video is not None:
        print(f"video: {options.video}")
    return 0


def _print_result(result: "PlaybackResult") -> None:
    """Print how an episode ended."""
    from lgmd_gym.envs.dynamics.units import KMH

    if result.stopped:
        print(f"window closed after {result.duration:.2f} s")
    elif result.collision:
        print(f"contact at {result.impact_speed / KMH:.1f} km/h relative speed after {result.duration:.2f} s")
    else:
        gap = f"free distance ahead {result.gap:.2f} m" if isfinite(result.gap) else "no vehicle ahead"
        print(f"no contact: {result.ego_speed / KMH:.1f} km/h after {result.duration:.2f} s, {gap}")


def _is_of_agent(agent: "Agent", error: Exception) -> bool:
    """Return whether an exception passed through the module of a user's agent."""
    from lgmd_gym.agents.user_agents import UserAgents

    if not isinstance(agent.agent, UserAgents):
        return False
    module = getattr(sys.modules[type(agent.agent.objects[0]).__module__], "__file__", None)
    return any(frame.f_code.co_filename == module for frame, _ in walk_tb(error.__traceback__))
