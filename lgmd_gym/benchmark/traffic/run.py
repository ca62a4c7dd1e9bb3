"""The traffic suite: agents × kinds of traffic × seeds, and how often each brakes without need.

An IDM driver is at the wheel, the agent may only add braking. A brake counts if it slows the car by more
than 0.25 g beyond what the driver does. It is false if, had the agent not braked from that moment on, the
ego would have touched nobody within 10 s (with whatever part of it, whoever's fault) and the driver would
not have had to brake by 5 m/s² or more either. It is premature, and counted apart, if that emergency was
more than 4 s away. The 5 m/s² are where UN R152 begins to speak of an emergency; the driver himself never
brakes harder than 6.

What a seed's traffic is like is settled by highway-env's drivers, which are no people: they neither look
away nor drift, so that contacts are rare. A rate says how an agent does in such traffic, not on a road.
"""

import traceback
from collections.abc import Callable, Collection, Iterable, Iterator
from pathlib import Path
from typing import Any, cast

from joblib import delayed

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.config import FILE, RunConfig
from lgmd_gym.benchmark.executor import check_pool, open_pool
from lgmd_gym.benchmark.folder import RunFolder
from lgmd_gym.benchmark.sensors import CLEAR, SensorConfig
from lgmd_gym.benchmark.session import Session
from lgmd_gym.benchmark.traffic.recording import record
from lgmd_gym.benchmark.traffic.replay import Ride
from lgmd_gym.benchmark.traffic.rows import SUITE, case_name, error_row, make_row
from lgmd_gym.envs.traffic.registration import KINDS, find_kind, make_traffic

FULL_SEEDS = 110  # of every kind: 300 km and more without braking


def run_traffic(
    agents: Iterable[str],
    kinds: Iterable[str] = tuple(KINDS),
    seeds: Iterable[int] = range(FULL_SEEDS),
    jobs: int = 1,
    sensor_config: SensorConfig | None = None,
    done: Collection[tuple[str, str]] = (),
    cluster: str | None = None,
) -> Iterator[dict[str, Any]]:
    """Play every agent in every kind of traffic with every seed; yield each row as it comes.

    Each seed's traffic is driven once without an agent for every eye, and the recording serves all agents
    that see through it, in one process.

    Args:
        agents: Agent strings.
        kinds: Names in `lgmd_gym.envs.traffic.registration.KINDS`.
        seeds: Of every kind.
        jobs: Processes; 1 plays in this one.
        sensor_config: Camera and neuron parameters.
        done: Pairs of agent and case that need not be played.
        cluster: Address of a Dask scheduler to play on, in place of processes.

    Raises:
        ValueError: For an unknown name, or none at all; before anything is played.
    """
    agents, kinds, sensor_config = (
        list(dict.fromkeys(agents)),
        list(dict.fromkeys(kinds)),
        sensor_config or SensorConfig(),
    )
    seeds = list(seeds)
    _check(agents, kinds, seeds, sensor_config)
    check_pool(jobs, cluster)
    # Seed by seed rather than kind by kind, so that what Ctrl-C leaves is a fair sample.
    wanted = [
        ([agent for agent in agents if (agent, case_name(kind, seed)) not in done], kind, seed)
        for seed in seeds
        for kind in kinds
    ]
    return _play([task for task in wanted if task[0]], jobs, sensor_config, cluster)


def _play(
    wanted: list[tuple[list[str], str, int]], jobs: int, sensor_config: SensorConfig, cluster: str | None
) -> Iterator[dict[str, Any]]:
    tasks = (delayed(drive_all)(*task, sensor_config) for task in wanted)
    with open_pool(jobs, cluster) as parallel:
        for rows in cast(Iterator[list[dict[str, Any]]], parallel(tasks)):
            yield from rows


def _check(agents: list[str], kinds: list[str], seeds: list[int], sensor_config: SensorConfig) -> None:
    for name, given in (("agents", agents), ("kinds", kinds), ("seeds", seeds)):
        if not given:
            raise ValueError(f"{name} needs at least one, got none")
    made = [make_agent(agent) for agent in agents]
    for kind in kinds:
        find_kind(kind)
    # Refuses an unusable camera or parameter here rather than once per drive.
    for agent in made:
        make_traffic(kinds[0], **sensor_config.of(agent).arguments).close()


def drive_all(agents: list[str], kind: str, seed: int, sensor_config: SensorConfig) -> list[dict[str, Any]]:
    """Return the row of every agent in one seed's traffic; whatever fails becomes an error row.

    Args:
        agents: Agent strings.
        kind: Of the traffic.
        seed: Of the traffic and the agents.
        sensor_config: Camera and neuron parameters.
    """
    rows = []
    for seen, names in _by_eye(agents, sensor_config):
        try:
            trace = record(kind, seed, seen)
        except Exception:
            rows += [error_row(agent, kind, seed, traceback.format_exc()) for agent in names]
            continue
        for agent in names:
            try:
                row = make_row(agent, trace, Ride(trace, make_agent(agent)).play())
                rows.append(row | {"camera": seen.label})
            except Exception:
                rows.append(error_row(agent, kind, seed, traceback.format_exc()))
    return rows


def _by_eye(agents: list[str], sensor_config: SensorConfig) -> list[tuple[SensorConfig, list[str]]]:
    """Return the agents in groups that see the same, so that one recording serves all of a group."""
    groups: list[tuple[SensorConfig, list[str]]] = []
    for agent in agents:
        seen = sensor_config.of(make_agent(agent))
        for known, names in groups:
            if known == seen:
                names.append(agent)
                break
        else:
            groups.append((seen, [agent]))
    return groups


class TrafficRun(Session):
    """One run of the traffic suite into a run folder; the counterpart of `Run`.

    Args:
        agents: Agent strings.
        kinds: Names in `lgmd_gym.envs.traffic.registration.KINDS`.
        seeds: Number of seeds per kind.
        jobs: Processes; 1 plays in this one.
        out: The run folder, which must not exist; or an open one, whose drives are not played again.
        sensor_config: Camera and neuron parameters.
        conditions: One camera condition by name.
        cluster: Address of a Dask scheduler to play on, in place of processes.
        first_seed: Seeds are played from this one on.

    Raises:
        ValueError: As `run_traffic`, for several conditions, or for a folder that exists or cannot be made;
            before anything is played.
    """

    def __init__(
        self,
        agents: Iterable[str],
        kinds: Iterable[str],
        seeds: int,
        jobs: int,
        out: Path | RunFolder,
        sensor_config: SensorConfig | None = None,
        conditions: Iterable[str] = (CLEAR,),
        cluster: str | None = None,
        first_seed: int = 0,
    ) -> None:
        conditions = tuple(conditions)
        if len(conditions) != 1:
            raise ValueError(f"traffic is played under one condition, got {', '.join(conditions) or 'none'}")
        plain = (sensor_config or SensorConfig()).plain
        self.kinds = list(dict.fromkeys(kinds))
        # What failed is played again.
        held = out.rows if isinstance(out, RunFolder) else []
        done = {(row["agent"], row["case"]) for row in held}
        agents = tuple(dict.fromkeys(agents))
        config = RunConfig(
            suite=SUITE,
            agents=agents,
            seeds=seeds,
            conditions=conditions,
            camera=plain.camera,
            params=plain.params,
            first_seed=first_seed,
        )
        under = plain.under(conditions[0])
        self._coming = run_traffic(agents, self.kinds, config.played, jobs, under, done, cluster)
        folder = out if isinstance(out, RunFolder) else RunFolder.create(out)
        if not (folder.path / FILE).exists():
            config.save(folder.path / FILE)
        super().__init__(config, folder, list(held), jobs, cluster)

    @property
    def total(self) -> int:
        """Number of drives that will be played."""
        return len(self.agents) * len(self.kinds) * self.seeds

    def _play(self, keep: Callable[[dict[str, Any]], None]) -> None:
        for row in self._coming:
            keep(row)

    def _more_settings(self) -> dict[str, Any]:
        return {"kinds": self.kinds}
