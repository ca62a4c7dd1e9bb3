"""Suites × agents × seeds × conditions, in parallel, each row on disk as it finishes."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from joblib import Parallel, delayed

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.config import FILE, OWN_SUITE, RunConfig
from lgmd_gym.benchmark.episode import make_env
from lgmd_gym.benchmark.executor import check_pool, open_pool
from lgmd_gym.benchmark.folder import RunFolder
from lgmd_gym.benchmark.metrics import Counterfactual
from lgmd_gym.benchmark.rows import key_of
from lgmd_gym.benchmark.sensors import CLEAR, SensorConfig
from lgmd_gym.benchmark.session import Session
from lgmd_gym.benchmark.suite_file import get_suite, save_suite
from lgmd_gym.benchmark.task import NO_BRAKE, Result, Task, run_task

DEFAULT_AGENTS = (
    NO_BRAKE,
    "always-brake",
    "random-brake",
    "spike-threshold",
    "stopping-zone",
    "ttc-oracle",
)


class Run(Session):
    """One benchmark run.

    `no-brake` is always played first: it decides what is a threat (the counterfactual), and its rows are
    kept whether or not it was asked for. Its time series are the open-loop traces of the neuron, and all of
    them are kept.

    Args:
        suite: Name of a suite, or the path of a suite file (see `own_suites`).
        agents: Agent strings.
        seeds: Number of seeds.
        jobs: Processes; 1 plays in this one.
        out: The run folder, which must not exist; or an open one, whose episodes are not played again.
        sensor_config: Camera and neuron parameters; each agent's own eye by default.
        conditions: Camera conditions by name; the suite is played once under each.
        cluster: Address of a Dask scheduler to play on, in place of processes.
        first_seed: Seeds are played from this one on; its time series are kept of every agent.

    Raises:
        ValueError: For an unknown name, a count below 1, a cluster that does not answer, or a folder that
            exists or cannot be made; before anything is played.
    """

    def __init__(
        self,
        suite: str,
        agents: Iterable[str],
        seeds: int,
        jobs: int,
        out: Path | RunFolder,
        sensor_config: SensorConfig | None = None,
        conditions: Iterable[str] = (CLEAR,),
        cluster: str | None = None,
        first_seed: int = 0,
    ) -> None:
        found = get_suite(suite)
        self.cases: tuple[Case, ...] = found.cases
        agents, conditions = tuple(dict.fromkeys(agents)), tuple(dict.fromkeys(conditions))
        made = [make_agent(agent) for agent in agents]
        for name, given in (("agents", agents), ("conditions", conditions)):
            if not given:
                raise ValueError(f"{name} needs at least one name, got none")
        plain = (sensor_config or SensorConfig()).plain
        own = suite.endswith(".toml")
        config = RunConfig(
            suite=OWN_SUITE if own else suite,
            agents=agents,
            seeds=seeds,
            conditions=conditions,
            camera=plain.camera,
            params=plain.params,
            first_seed=first_seed,
        )
        self.conditions = {condition: plain.under(condition) for condition in conditions}
        for under in self.conditions.values():
            # Refuses an unusable camera or parameter here rather than once per episode.
            for agent in made:
                make_env(self.cases[0], under.of(agent)).close()
        check_pool(jobs, cluster)
        folder = out if isinstance(out, RunFolder) else RunFolder.create(out)
        if own and not (folder.path / OWN_SUITE).exists():
            save_suite(found, folder.path / OWN_SUITE)
        if not (folder.path / FILE).exists():
            config.save(folder.path / FILE)
        super().__init__(config, folder, list(folder.rows), jobs, cluster)
        self.suite = found.name

    @property
    def total(self) -> int:
        """Number of episodes that will be played."""
        others = [agent for agent in self.agents if agent != NO_BRAKE]
        return len(self.cases) * self.seeds * len(self.conditions) * (1 + len(others))

    def _play(self, keep: Callable[[dict[str, Any]], None]) -> None:
        first = [
            Task(NO_BRAKE, case, seed, sensor_config, condition=condition)
            for condition, sensor_config in self.conditions.items()
            for case in self.cases
            for seed in self.config.played
        ]
        done = {key_of(row): row for row in self.rows}
        truths = {key[1:]: Counterfactual.of_row(row) for key, row in done.items() if key[0] == NO_BRAKE}
        with open_pool(self.jobs, self.cluster) as parallel:
            for result in self._results(parallel, [task for task in first if task.key not in done], keep):
                if result.truth is not None:
                    truths[result.task.key[1:]] = result.truth
            rest = [
                replace(task, agent=agent, truth=truths[task.key[1:]])
                for agent in self.agents
                if agent != NO_BRAKE
                for task in first
                if task.key[1:] in truths
            ]
            for _ in self._results(parallel, [task for task in rest if task.key not in done], keep):
                pass

    def _results(
        self, parallel: Parallel, tasks: list[Task], keep: Callable[[dict[str, Any]], None]
    ) -> Iterator[Result]:
        """Play tasks and yield their results, each kept before it is yielded."""
        results = cast(Iterator[Result], parallel(delayed(run_task)(task) for task in tasks))
        for result in results:
            task, traced = (
                result.task,
                result.task.agent == NO_BRAKE or result.task.seed == self.config.first_seed,
            )
            # Before the row: what has a row is never played again.
            if traced and result.series is not None:
                self.folder.add_series(trace_name(*task.key), result.series)
            keep(result.row)
            yield result


def trace_name(agent: str, case: str, seed: int, condition: str = CLEAR) -> str:
    """Return the file stem under which an episode's time series are kept."""
    name = f"{case}__{agent}__seed{seed}" + ("" if condition == CLEAR else f"__{condition}")
    return name.replace("/", "_").replace(":", "_").replace(",", "_")
