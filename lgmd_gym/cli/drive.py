"""The `drive` command."""

from math import isfinite

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.cli.modules import find_target
from lgmd_gym.cli.options import Drive
from lgmd_gym.cli.params import note_unused_params, parse_arguments, read_params
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.rendering.playback import play_episode


def run(options: Drive) -> int:
    """Run one episode and print how it ended."""
    agent = make_agent(options.agent)
    note_unused_params(options.params, [agent])
    result = play_episode(
        find_target(options.target, options.case, options.module, options.trust),
        agent,
        options.seed,
        parse_arguments(options.set),
        video=options.video,
        live=options.live,
        overlays=options.overlays,
        sensors=SensorConfig(options.camera, read_params(options.params)),
    )
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
