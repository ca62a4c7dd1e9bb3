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

import time
import traceback
from collections.abc import Callable, Collection, Iterable, Iterator
from pathlib import Path
from typing import Any, cast

from joblib import Parallel, delayed

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.eyesight import Eyesight
from lgmd_gym.benchmark.folder import RunFolder
from lgmd_gym.benchmark.traffic_drive import Ride
from lgmd_gym.benchmark.traffic_rows import SUITE, case_name, error_row, make_row
from lgmd_gym.benchmark.traffic_trace import record
from lgmd_gym.envs.traffic import KINDS, find_kind, make_traffic

FULL_SEEDS = 110  # of every kind: 300 km and more without braking


def run_traffic(
    agents: Iterable[str],
    kinds: Iterable[str] = tuple(KINDS),
    seeds: int = FULL_SEEDS,
    jobs: int = 1,
    eyesight: Eyesight | None = None,
    done: Collection[tuple[str, str]] = (),
) -> Iterator[dict[str, Any]]:
    """Play every agent in every kind of traffic with every seed; yield each row as it comes.

    Each seed's traffic is driven once without an agent for every eye, and the recording serves all agents
    that see through it, in one process.

    Args:
        agents: Agent strings.
        kinds: Names in `lgmd_gym.envs.traffic.KINDS`.
        seeds: Number of seeds per kind, played from 0 on.
        jobs: Processes; 1 plays in this one.
        eyesight: Camera and neuron parameters.
        done: Pairs of agent and case that need not be played.

    Raises:
        ValueError: For an unknown name, none at all, or a count below 1; before anything is played.
    """
    agents, kinds, eyesight = list(dict.fromkeys(agents)), list(dict.fromkeys(kinds)), eyesight or Eyesight()
    _check(agents, kinds, seeds, jobs, eyesight)
    # Seed by seed rather than kind by kind, so that what Ctrl-C leaves is a fair sample.
    wanted = [
        ([agent for agent in agents if (agent, case_name(kind, seed)) not in done], kind, seed)
        for seed in range(seeds)
        for kind in kinds
    ]
    return _play([task for task in wanted if task[0]], jobs, eyesight)


def _play(
    wanted: list[tuple[list[str], str, int]], jobs: int, eyesight: Eyesight
) -> Iterator[dict[str, Any]]:
    tasks = (delayed(drive_all)(*task, eyesight) for task in wanted)
    with Parallel(n_jobs=jobs, return_as="generator_unordered") as parallel:
        for rows in cast(Iterator[list[dict[str, Any]]], parallel(tasks)):
            yield from rows


def _check(agents: list[str], kinds: list[str], seeds: int, jobs: int, eyesight: Eyesight) -> None:
    for name, given in (("agents", agents), ("kinds", kinds)):
        if not given:
            raise ValueError(f"{name} needs at least one name, got none")
    made = [make_agent(agent) for agent in agents]
    for kind in kinds:
        find_kind(kind)
    for name, count in (("seeds", seeds), ("jobs", jobs)):
        if count < 1:
            raise ValueError(f"{name} must be >= 1, got {count!r}")
    # Refuses an unusable camera or parameter here rather than once per drive.
    for agent in made:
        make_traffic(kinds[0], **eyesight.of(agent).arguments).close()


def drive_all(agents: list[str], kind: str, seed: int, eyesight: Eyesight) -> list[dict[str, Any]]:
    """Return the row of every agent in one seed's traffic; whatever fails becomes an error row.

    Args:
        agents: Agent strings.
        kind: Of the traffic.
        seed: Of the traffic and the agents.
        eyesight: Camera and neuron parameters.
    """
    rows = []
    for seen, names in _by_eye(agents, eyesight):
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


def _by_eye(agents: list[str], eyesight: Eyesight) -> list[tuple[Eyesight, list[str]]]:
    """Return the agents in groups that see the same, so that one recording serves all of a group."""
    groups: list[tuple[Eyesight, list[str]]] = []
    for agent in agents:
        seen = eyesight.of(make_agent(agent))
        for known, names in groups:
            if known == seen:
                names.append(agent)
                break
        else:
            groups.append((seen, [agent]))
    return groups


class TrafficRun:
    """One run of the traffic suite into a run folder; the counterpart of `Run`.

    Args:
        agents: Agent strings.
        kinds: Names in `lgmd_gym.envs.traffic.KINDS`.
        seeds: Number of seeds per kind, played from 0 on.
        jobs: Processes; 1 plays in this one.
        out: The run folder, which must not exist; or an open one, whose drives are not played again.
        eyesight: Camera and neuron parameters.

    Raises:
        ValueError: As `run_traffic`, or for a folder that exists or cannot be made; before anything is
            played.
    """

    suite = SUITE

    def __init__(
        self,
        agents: Iterable[str],
        kinds: Iterable[str],
        seeds: int,
        jobs: int,
        out: Path | RunFolder,
        eyesight: Eyesight | None = None,
    ) -> None:
        self.agents, self.kinds = list(dict.fromkeys(agents)), list(dict.fromkeys(kinds))
        self.seeds, self.jobs, self.eyesight = seeds, jobs, eyesight or Eyesight()
        held = out.rows if isinstance(out, RunFolder) else []
        # What failed is played again.
        self.rows: list[dict[str, Any]] = [row for row in held if row["error"] is None]
        done = {(row["agent"], row["case"]) for row in self.rows}
        self._coming = run_traffic(self.agents, self.kinds, seeds, jobs, self.eyesight, done)
        self.folder = out if isinstance(out, RunFolder) else RunFolder.create(out)

    @property
    def total(self) -> int:
        """Number of drives that will be played."""
        return len(self.agents) * len(self.kinds) * self.seeds

    def play(self, progress: Callable[[dict[str, Any]], None] | None = None) -> bool:
        """Play everything; every finished row is on disk, also if interrupted.

        Args:
            progress: Called with each row as it finishes.

        Returns:
            Whether all was played; False after Ctrl-C.
        """
        started, complete = time.perf_counter(), True
        self.folder.describe(self._settings(False, 0.0))
        try:
            for row in self._coming:
                self.rows.append(row)
                self.folder.add(row)
                if progress is not None:
                    progress(row)
        except KeyboardInterrupt:
            complete = False
        finally:
            self.folder.describe(self._settings(complete, time.perf_counter() - started))
            self.folder.close()
        return complete

    def _settings(self, complete: bool, wall_time: float) -> dict[str, Any]:
        return {
            "suite": self.suite,
            "kinds": self.kinds,
            "agents": self.agents,
            "seeds": self.seeds,
            "jobs": self.jobs,
            "camera": self.eyesight.camera,
            "params": self.eyesight.params,
            "condition": self.eyesight.condition,
            "complete": complete,
            "episodes": len(self.rows),
            "wall_time": round(wall_time, 3),
        }
