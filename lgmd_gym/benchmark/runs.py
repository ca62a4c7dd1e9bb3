"""A run of any suite, new, broken off or repeated: suites of cases are a `Run`, traffic is a `TrafficRun`."""

from collections.abc import Iterable
from pathlib import Path

from lgmd_gym.benchmark.config import OWN_SUITE, RunConfig
from lgmd_gym.benchmark.folder import RunFolder
from lgmd_gym.benchmark.run_cases import Run
from lgmd_gym.benchmark.sensors import CLEAR, SensorConfig
from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.benchmark.traffic.rows import SUITE as TRAFFIC
from lgmd_gym.benchmark.traffic.run import TrafficRun
from lgmd_gym.envs.traffic.registration import KINDS
from lgmd_gym.errors import unknown_name

SUITE_NAMES = (*SUITES, TRAFFIC)


def start_run(
    suite: str,
    agents: Iterable[str],
    seeds: int,
    jobs: int,
    out: Path,
    sensor_config: SensorConfig | None = None,
    conditions: Iterable[str] = (CLEAR,),
    cluster: str | None = None,
    first_seed: int = 0,
) -> Run | TrafficRun:
    """Return a new run, to be played.

    Args:
        suite: A name in `SUITE_NAMES`, or the path of a suite file, which ends in ".toml".
        agents: Agent strings.
        seeds: Number of seeds; for traffic, of every kind.
        jobs: Processes; 1 plays in this one.
        out: The run folder, which must not exist.
        sensor_config: Camera and neuron parameters; each agent's own eye by default.
        conditions: Camera conditions by name; traffic is played under one.
        cluster: Address of a Dask scheduler to play on, in place of processes.
        first_seed: Seeds are played from this one on.

    Raises:
        ValueError: For an unknown name, a count below 1, a cluster that does not answer, or a folder that
            exists or cannot be made; before anything is played.
    """
    if suite == TRAFFIC:
        return TrafficRun(agents, KINDS, seeds, jobs, out, sensor_config, conditions, cluster, first_seed)
    if suite not in SUITES and not suite.endswith(".toml"):
        raise unknown_name("suite", suite, SUITE_NAMES)
    return Run(suite, agents, seeds, jobs, out, sensor_config, conditions, cluster, first_seed)


def repeat_run(config: RunConfig, jobs: int, out: Path, cluster: str | None = None) -> Run | TrafficRun:
    """Return a new run that plays what a config says.

    Raises:
        ValueError: As `start_run`.
    """
    return start_run(
        config.suite,
        config.agents,
        config.seeds,
        jobs,
        out,
        config.sensor_config,
        config.conditions,
        cluster,
        config.first_seed,
    )


def resume_run(path: Path, jobs: int, cluster: str | None = None) -> Run | TrafficRun:
    """Return the run of a folder that was broken off, to be played to its end.

    Raises:
        ValueError: If the folder holds no run, a damaged one, or one of another version.
    """
    folder = RunFolder.reopen(path)
    settings = folder.settings()
    sensor_config = SensorConfig(settings["camera"], settings["params"])
    agents, seeds, conditions = settings["agents"], settings["seeds"], settings["conditions"]
    first = settings.get("first_seed", 0)  # of a run broken off before there was a choice
    if settings["suite"] == TRAFFIC:
        return TrafficRun(
            agents, settings["kinds"], seeds, jobs, folder, sensor_config, conditions, cluster, first
        )
    suite = str(path / OWN_SUITE) if settings["suite"] == OWN_SUITE else settings["suite"]
    return Run(suite, agents, seeds, jobs, folder, sensor_config, conditions, cluster, first)
