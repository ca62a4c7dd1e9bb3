"""The episodes of a run and their order."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import product

import gymnasium as gym

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.batch import play_unit
from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.episode import make_env
from lgmd_gym.benchmark.metrics import Counterfactual
from lgmd_gym.benchmark.rows import Row, RowKey, key_of
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suite_file import get_suite
from lgmd_gym.benchmark.task import NO_BRAKE, Result, Task
from lgmd_gym.benchmark.units import make_units
from lgmd_gym.benchmark.warm_up import compile_kernels
from lgmd_gym.processes.pool import TaskMap


class Plan(ABC):
    """The episodes of a run.

    Args:
        config: Configuration of the run.

    Attributes:
        suite: Name of the suite.
        sensor_configs: Camera and neuron parameters by condition.

    Raises:
        ValueError: If the suite is unknown or a camera does not support a condition.
    """

    suite: str

    def __init__(self, config: RunConfig) -> None:
        self.config = config
        self.sensor_configs = {name: config.sensors(name) for name in config.conditions}

    @property
    def total(self) -> int:
        """Number of episodes."""
        return len(self.keys())

    @abstractmethod
    def keys(self) -> set[RowKey]:
        """Return the keys of all rows of the complete run."""

    @abstractmethod
    def play(self, run_tasks: TaskMap, rows: Iterable[Row]) -> Iterator[Result]:
        """Run the episodes that are not among `rows`, and yield their results as they finish."""

    def warm_up(self) -> None:  # noqa: B027  (optional)
        """Compile in this process what worker processes would compile each by itself."""

    @abstractmethod
    def _make_env(self, sensor_config: SensorConfig) -> gym.Env:
        """Return an environment of the suite."""

    def check(self) -> None:
        """Build every agent, and an environment with each agent's sensors.

        Raises:
            ValueError: If an agent, camera or parameter is invalid.
        """
        agents = [make_agent(agent) for agent in self.config.agents]
        for sensor_config in self.sensor_configs.values():
            for agent in agents:
                self._make_env(sensor_config.for_agent(agent)).close()


class CasePlan(Plan):
    """The episodes of a suite of cases.

    `no-brake` is run first, even if it is not among the agents: it defines the counterfactual.
    """

    def __init__(self, config: RunConfig) -> None:
        super().__init__(config)
        suite = get_suite(config.suite, config.modules)
        self.suite, self.cases = suite.name, suite.cases

    def keys(self) -> set[RowKey]:
        """Return the keys of all rows, those of `no-brake` included."""
        config, cases = self.config, [case.name for case in self.cases]
        return set(product({NO_BRAKE, *config.agents}, cases, config.seed_range, config.conditions))

    def play(self, run_tasks: TaskMap, rows: Iterable[Row]) -> Iterator[Result]:
        """Run the missing episodes, `no-brake` first, and yield their results as they finish."""
        done = {key_of(row): row for row in rows}
        counterfactuals = {
            key[1:]: Counterfactual.of_row(row) for key, row in done.items() if key[0] == NO_BRAKE
        }
        first = [
            self._first_task(index, seed, condition)
            for condition in self.sensor_configs
            for index in range(len(self.cases))
            for seed in self.config.seed_range
        ]
        for result in self._play(run_tasks, [task for task in first if task.key not in done]):
            if result.counterfactual is not None:
                counterfactuals[key_of(result.row)[1:]] = result.counterfactual
            yield result
        others = [
            replace(task, agent=agent, counterfactual=counterfactuals[task.key[1:]])
            for agent in self.config.agents
            if agent != NO_BRAKE
            for task in first
            if task.key[1:] in counterfactuals
        ]
        yield from self._play(run_tasks, [task for task in others if task.key not in done])

    def warm_up(self) -> None:
        """Compile the kernels of cameras, neuron and motion."""
        compile_kernels(self._first_task(0, self.config.first_seed, next(iter(self.sensor_configs))))

    def _first_task(self, index: int, seed: int, condition: str) -> Task:
        """Return the task of `no-brake` in a case."""
        config = self.config
        return Task(
            NO_BRAKE,
            self.cases[index],
            seed,
            self.sensor_configs[condition],
            condition=condition,
            world=config.world(seed, index),
            road=config.road,
        )

    def _play(self, run_tasks: TaskMap, tasks: list[Task]) -> Iterator[Result]:
        return run_tasks.flatten(play_unit, make_units(tasks, run_tasks.workers, self.config.agents))

    def _make_env(self, sensor_config: SensorConfig) -> gym.Env:
        return make_env(self.cases[0], sensor_config)
