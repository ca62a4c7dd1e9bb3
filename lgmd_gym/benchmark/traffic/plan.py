"""The episodes of the traffic suite: all agents with the same camera share one recording."""

import traceback
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import gymnasium as gym

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.executor import TaskMap
from lgmd_gym.benchmark.plan import Plan
from lgmd_gym.benchmark.rows import Row, key_of, new_row
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.task import Result
from lgmd_gym.benchmark.traffic.recording import record_traffic
from lgmd_gym.benchmark.traffic.replay import Replay
from lgmd_gym.benchmark.traffic.rows import KEYS, measure, traffic_case
from lgmd_gym.camera import CLEAR
from lgmd_gym.envs.traffic.registration import traffic_id


@dataclass(frozen=True, slots=True)
class TrafficTask:
    """All agents in one seed of a kind of traffic.

    Attributes:
        agents: Agent strings.
        kind: Kind of traffic.
        seed: Seed of the traffic and the agents.
        sensor_config: Camera and neuron parameters under the condition.
        condition: Name of the camera condition, for the rows.
    """

    agents: tuple[str, ...]
    kind: str
    seed: int
    sensor_config: SensorConfig
    condition: str = CLEAR


class TrafficPlan(Plan):
    """The episodes of the traffic suite."""

    def __init__(self, config: RunConfig) -> None:
        super().__init__(config)
        self.suite = config.suite
        self.kinds: tuple[str, ...] = config.kinds or ()

    @property
    def total(self) -> int:
        """Number of episodes."""
        config = self.config
        return len(config.agents) * len(self.kinds) * config.seeds * len(config.conditions)

    def play(self, run_tasks: TaskMap, rows: Iterable[Row]) -> Iterator[Result]:
        """Run the missing episodes and yield their results as they finish.

        Seeds come before kinds, so that an interrupted run holds a balanced sample.
        """
        done = {key_of(row) for row in rows}
        tasks = []
        for condition, sensor_config in self.sensor_configs.items():
            for seed in self.config.seed_range:
                for kind in self.kinds:
                    key = (traffic_case(kind, seed).name, seed, condition)
                    agents = tuple(agent for agent in self.config.agents if (agent, *key) not in done)
                    if agents:
                        tasks.append(TrafficTask(agents, kind, seed, sensor_config, condition))
        for rows_of_task in run_tasks(run_traffic_task, tasks):
            yield from map(Result, rows_of_task)

    def _make_env(self, sensor_config: SensorConfig) -> gym.Env:
        return gym.make(traffic_id(self.kinds[0]), **sensor_config.arguments)


def run_traffic_task(task: TrafficTask) -> list[Row]:
    """Return the row of every agent; an exception becomes an error row."""
    rows = []
    case = traffic_case(task.kind, task.seed)
    for sensor_config, agents in _by_sensor_config(task):
        recording = None
        for agent in agents:
            values = {}
            try:
                recording = recording or record_traffic(task.kind, task.seed, sensor_config)
                values = measure(recording, Replay(recording, make_agent(agent)).play())
                values["camera"] = sensor_config.label
            except Exception:
                values = {"error": traceback.format_exc()}
            rows.append(new_row(KEYS, agent, case, task.seed, task.condition, **values))
    return rows


def _by_sensor_config(task: TrafficTask) -> list[tuple[SensorConfig, list[str]]]:
    """Return the agents grouped by camera and neuron parameters."""
    groups: list[tuple[SensorConfig, list[str]]] = []
    for agent in task.agents:
        sensor_config = task.sensor_config.for_agent(make_agent(agent))
        for known, agents in groups:
            if known == sensor_config:
                agents.append(agent)
                break
        else:
            groups.append((sensor_config, [agent]))
    return groups
