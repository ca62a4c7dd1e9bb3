"""Suites × agents × seeds, in parallel, each row on disk as it finishes."""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from joblib import Parallel, delayed

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.cases import Case
from lgmd_gym.benchmark.episode import make_env
from lgmd_gym.benchmark.eyesight import Eyesight
from lgmd_gym.benchmark.folder import RunFolder
from lgmd_gym.benchmark.rows import Counterfactual
from lgmd_gym.benchmark.suites import find_suite
from lgmd_gym.benchmark.tasks import NO_BRAKE, Result, Task, run_task

DEFAULT_AGENTS = (NO_BRAKE, "always-brake", "random-brake", "spike-threshold", "ttc-oracle")
TRACED_SEED = 0  # whose time series are kept for the plots


class Run:
    """One benchmark run.

    `no-brake` is always played first: it decides what is a threat (the counterfactual), and its rows are
    kept whether or not it was asked for.

    Args:
        suite: Name of a suite.
        agents: Agent strings.
        seeds: Number of seeds, played from 0 on.
        jobs: Processes; 1 plays in this one.
        out: The run folder, which must not exist; or an open one, whose episodes are not played again.
        eyesight: Camera, neuron parameters and condition; each agent's own eye by default.

    Raises:
        ValueError: For an unknown name, a count below 1, or a folder that exists or cannot be made; before
            anything is played.
    """

    def __init__(
        self,
        suite: str,
        agents: Iterable[str],
        seeds: int,
        jobs: int,
        out: Path | RunFolder,
        eyesight: Eyesight | None = None,
    ) -> None:
        self.cases: tuple[Case, ...] = find_suite(suite).cases
        self.agents = list(dict.fromkeys(agents))
        made = [make_agent(agent) for agent in self.agents]
        if not self.agents:
            raise ValueError("agents needs at least one name, got none")
        for name, count in (("seeds", seeds), ("jobs", jobs)):
            if count < 1:
                raise ValueError(f"{name} must be >= 1, got {count!r}")
        self.suite, self.seeds, self.jobs = suite, seeds, jobs
        self.eyesight = eyesight or Eyesight()
        # Refuses an unusable camera or parameter here rather than once per episode.
        for agent in made:
            make_env(self.cases[0], self.eyesight.of(agent)).close()
        self.folder = out if isinstance(out, RunFolder) else RunFolder.create(out)
        # What failed is played again.
        self.rows: list[dict[str, Any]] = [row for row in self.folder.rows if row["error"] is None]

    @property
    def total(self) -> int:
        """Number of episodes that will be played."""
        others = [agent for agent in self.agents if agent != NO_BRAKE]
        return len(self.cases) * self.seeds * (1 + len(others))

    def play(self, progress: Callable[[dict[str, Any]], None] | None = None) -> bool:
        """Play everything; every finished row is on disk, also if interrupted.

        Args:
            progress: Called with each row as it finishes.

        Returns:
            Whether all was played; False after Ctrl-C.
        """
        started = time.perf_counter()
        complete = True
        self.folder.describe(self._settings(False, 0.0))
        try:
            self._play(progress or (lambda row: None))
        except KeyboardInterrupt:
            complete = False
        finally:
            self.folder.describe(self._settings(complete, time.perf_counter() - started))
            self.folder.close()
        return complete

    def _play(self, progress: Callable[[dict[str, Any]], None]) -> None:
        with Parallel(n_jobs=self.jobs, return_as="generator_unordered") as parallel:
            first = [
                Task(NO_BRAKE, case, seed, self.eyesight) for case in self.cases for seed in range(self.seeds)
            ]
            done = {(row["agent"], row["case"], row["seed"]): row for row in self.rows}
            truths = {key[1:]: Counterfactual.of_row(row) for key, row in done.items() if key[0] == NO_BRAKE}
            for result in self._results(parallel, _without(first, done), progress):
                if result.truth is not None:
                    truths[result.task.case.name, result.task.seed] = result.truth
            rest = [
                replace(task, agent=agent, truth=truths[task.case.name, task.seed])
                for agent in self.agents
                if agent != NO_BRAKE
                for task in first
                if (task.case.name, task.seed) in truths
            ]
            for _ in self._results(parallel, _without(rest, done), progress):
                pass

    def _results(
        self, parallel: Parallel, tasks: list[Task], progress: Callable[[dict[str, Any]], None]
    ) -> Iterator[Result]:
        """Play tasks and yield their results, each kept before it is yielded."""
        results = cast(Iterator[Result], parallel(delayed(run_task)(task) for task in tasks))
        for result in results:
            self.rows.append(result.row)
            self.folder.add(result.row)
            if result.task.seed == TRACED_SEED and result.series is not None:
                self.folder.add_series(trace_name(result.task.case.name, result.task.agent), result.series)
            progress(result.row)
            yield result

    def _settings(self, complete: bool, wall_time: float) -> dict[str, Any]:
        return {
            "suite": self.suite,
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


def _without(tasks: list[Task], done: dict[tuple[str, str, int], Any]) -> list[Task]:
    """Return the tasks that are not among the finished (agent, case, seed)."""
    return [task for task in tasks if (task.agent, task.case.name, task.seed) not in done]


def trace_name(case: str, agent: str) -> str:
    """Return the file stem under which an episode's time series are kept."""
    return f"{case}__{agent}".replace("/", "_").replace(":", "_").replace(",", "_")
