"""The episodes of a run and their order."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import replace

import gymnasium as gym

from lgmd_gym.agents import make_agent
from lgmd_gym.agents.base import FPS
from lgmd_gym.benchmark.case import Row, is_traffic, key_of, traffic_case
from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.episode import make_env
from lgmd_gym.benchmark.metrics import Counterfactual
from lgmd_gym.benchmark.player import play_unit
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.task import NO_BRAKE, Result, Task
from lgmd_gym.benchmark.traffic.batch import TrafficDrive, TrafficTask, run_traffic_task
from lgmd_gym.benchmark.units import make_units
from lgmd_gym.camera.worlds import LABORATORY
from lgmd_gym.envs.appearance import Appearance
from lgmd_gym.envs.registration import traffic_id
from lgmd_gym.processes.pool import TaskMap


class Plan(ABC):
    """The episodes of a run.

    Attributes:
        suite: The suite.
        sensor_configs: Camera and neuron parameters by condition.

    Raises:
        ValueError: If the suite is unknown or a camera does not support a condition.
    """

    def __init__(self, config: RunConfig) -> None:
        self.config, self.suite = config, config.get_suite()
        self.sensor_configs = {name: config.sensors(name) for name in config.conditions}

    @property
    def total(self) -> int:
        """Number of episodes."""
        return len(self.config.row_keys(self.suite))

    @abstractmethod
    def play(self, run_tasks: TaskMap, rows: Iterable[Row]) -> Iterator[Result]:
        """Run the episodes that are not among `rows`, and yield their results as they finish."""

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

    def play(self, run_tasks: TaskMap, rows: Iterable[Row]) -> Iterator[Result]:
        """Run the missing episodes, `no-brake` first, and yield their results as they finish."""
        done = {key_of(row): row for row in rows}
        counterfactuals = {
            key[1:]: Counterfactual.of_row(row) for key, row in done.items() if key[0] == NO_BRAKE
        }
        first = [
            self._first_task(index, seed, condition)
            for condition in self.sensor_configs
            for index in range(len(self.suite.cases))
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

    def _first_task(self, index: int, seed: int, condition: str) -> Task:
        """Return the task of `no-brake` in a case."""
        config = self.config
        return Task(
            NO_BRAKE,
            self.suite.cases[index],
            seed,
            self.sensor_configs[condition],
            condition=condition,
            world=config.world(seed, 0 if self.suite.cases[index].swept else index),
            road=config.road,
        )

    def _play(self, run_tasks: TaskMap, tasks: list[Task]) -> Iterator[Result]:
        return run_tasks.flatten(play_unit, make_units(tasks, run_tasks.workers, self.config.agents))

    def _make_env(self, sensor_config: SensorConfig) -> gym.Env:
        return make_env(self.suite.cases[0], sensor_config)


DRIVES_PER_TASK = 10  # two seeds of every kind; more drives delay the rows and use more memory


class TrafficPlan(Plan):
    """The episodes of a suite of traffic."""

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of traffic."""
        return self.config.kinds or ()

    def play(self, run_tasks: TaskMap, rows: Iterable[Row]) -> Iterator[Result]:
        """Run the missing episodes and yield their results as they finish.

        Seeds come before kinds, so that an interrupted run holds a balanced sample.
        """
        done = {key_of(row) for row in rows}
        tasks = list[TrafficTask]()
        for condition, sensor_config in self.sensor_configs.items():
            drives = list[TrafficDrive]()
            for seed in self.config.seed_range:
                for index, kind in enumerate(self.kinds):
                    key = (traffic_case(kind, seed, self.suite.name).name, seed, condition)
                    agents = tuple(agent for agent in self.config.agents if (agent, *key) not in done)
                    if agents:
                        world = self.config.world(seed, index)
                        chosen = LABORATORY if world is None else world
                        appearance = Appearance(world=chosen, weather=condition, road=self.config.road)
                        drives.append(TrafficDrive(kind, seed, agents, appearance, self.suite.name))
            for first in range(0, len(drives), DRIVES_PER_TASK):
                batch = tuple(drives[first : first + DRIVES_PER_TASK])
                tasks.append(TrafficTask(batch, sensor_config, condition))
        for rows_of_task in run_tasks(run_traffic_task, tasks):
            yield from map(Result, rows_of_task)

    def check(self) -> None:
        """Check that no agent requires what traffic does not have; see `Plan.check`."""
        for agent in map(make_agent, self.config.agents):
            if agent.config:
                raise ValueError(
                    f"agent {agent.name} requires braking environments, got suite {self.suite.name}; "
                    "omit the agent"
                )
            if agent.fps not in (None, FPS):
                raise ValueError(
                    f"agent {agent.name} has fps {agent.fps:g}, but the cameras of suite {self.suite.name} "
                    f"have {FPS:g} Hz; omit the agent"
                )
        super().check()

    def _make_env(self, sensor_config: SensorConfig) -> gym.Env:
        return gym.make(traffic_id(self.kinds[0]), **sensor_config.arguments)


def make_plan(config: RunConfig) -> Plan:
    """Return the plan of a configuration."""
    return TrafficPlan(config) if is_traffic(config.suite) else CasePlan(config)
