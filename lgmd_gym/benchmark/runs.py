"""A run of any suite, new or broken off: suites of cases are a `Run`, traffic is a `TrafficRun`."""

from collections.abc import Iterable
from pathlib import Path

from lgmd_gym.benchmark.eyesight import Eyesight
from lgmd_gym.benchmark.folder import RunFolder
from lgmd_gym.benchmark.runner import Run
from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.benchmark.traffic import TrafficRun
from lgmd_gym.benchmark.traffic_rows import SUITE as TRAFFIC
from lgmd_gym.envs.traffic import KINDS
from lgmd_gym.errors import unknown_name

SUITE_NAMES = (*SUITES, TRAFFIC)


def start_run(
    suite: str,
    agents: Iterable[str],
    seeds: int,
    jobs: int,
    out: Path,
    eyesight: Eyesight | None = None,
) -> Run | TrafficRun:
    """Return a new run, to be played.

    Args:
        suite: A name in `SUITE_NAMES`.
        agents: Agent strings.
        seeds: Number of seeds, played from 0 on; for traffic, of every kind.
        jobs: Processes; 1 plays in this one.
        out: The run folder, which must not exist.
        eyesight: Camera, neuron parameters and condition; each agent's own eye by default.

    Raises:
        ValueError: For an unknown name, a count below 1, or a folder that exists or cannot be made; before
            anything is played.
    """
    if suite == TRAFFIC:
        return TrafficRun(agents, KINDS, seeds, jobs, out, eyesight)
    if suite not in SUITES:
        raise unknown_name("suite", suite, SUITE_NAMES)
    return Run(suite, agents, seeds, jobs, out, eyesight)


def resume_run(path: Path, jobs: int) -> Run | TrafficRun:
    """Return the run of a folder that was broken off, to be played to its end.

    Raises:
        ValueError: If the folder holds no run, a damaged one, or one of another version.
    """
    folder = RunFolder.reopen(path)
    settings = folder.settings()
    eyesight = Eyesight(settings["camera"], settings["params"], settings["condition"])
    if settings["suite"] == TRAFFIC:
        return TrafficRun(settings["agents"], settings["kinds"], settings["seeds"], jobs, folder, eyesight)
    return Run(settings["suite"], settings["agents"], settings["seeds"], jobs, folder, eyesight)
