"""The episodes of the traffic suite."""

from collections.abc import Iterable, Iterator
from itertools import product

import gymnasium as gym

from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.plan import Plan
from lgmd_gym.benchmark.rows import Row, RowKey, key_of
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import TRAFFIC
from lgmd_gym.benchmark.task import Result
from lgmd_gym.benchmark.traffic.batch import Drive, TrafficTask, run_traffic_task
from lgmd_gym.benchmark.traffic.rows import traffic_case
from lgmd_gym.camera.worlds import LABORATORY
from lgmd_gym.envs.appearance import Appearance
from lgmd_gym.envs.registration import traffic_id
from lgmd_gym.processes.pool import TaskMap

DRIVES_PER_TASK = 10  # two seeds of every kind; more drives delay the rows and use more memory


class TrafficPlan(Plan):
    """The episodes of the traffic suite."""

    def __init__(self, config: RunConfig) -> None:
        super().__init__(config)
        self.suite = TRAFFIC
        self.kinds: tuple[str, ...] = config.kinds or ()

    def keys(self) -> set[RowKey]:
        """Return the keys of all rows of the complete run."""
        config = self.config
        return {
            (agent, traffic_case(kind, seed).name, seed, condition)
            for agent, kind, seed, condition in product(
                config.agents, self.kinds, config.seed_range, config.conditions
            )
        }

    def play(self, run_tasks: TaskMap, rows: Iterable[Row]) -> Iterator[Result]:
        """Run the missing episodes and yield their results as they finish.

        Seeds come before kinds, so that an interrupted run holds a balanced sample.
        """
        done = {key_of(row) for row in rows}
        tasks = []
        for condition, sensor_config in self.sensor_configs.items():
            drives = []
            for seed in self.config.seed_range:
                for index, kind in enumerate(self.kinds):
                    key = (traffic_case(kind, seed).name, seed, condition)
                    agents = tuple(agent for agent in self.config.agents if (agent, *key) not in done)
                    if agents:
                        world = self.config.world(seed, index)
                        chosen = LABORATORY if world is None else world
                        appearance = Appearance(world=chosen, condition=condition, road=self.config.road)
                        drives.append(Drive(kind, seed, agents, appearance))
            for first in range(0, len(drives), DRIVES_PER_TASK):
                batch = tuple(drives[first : first + DRIVES_PER_TASK])
                tasks.append(TrafficTask(batch, sensor_config, condition))
        for rows_of_task in run_tasks(run_traffic_task, tasks):
            yield from map(Result, rows_of_task)

    def _make_env(self, sensor_config: SensorConfig) -> gym.Env:
        return gym.make(traffic_id(self.kinds[0]), **sensor_config.arguments)
