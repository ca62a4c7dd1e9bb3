"""One task: one agent in one case with one seed, played in whatever process picks it up."""

import traceback
from dataclasses import dataclass
from typing import Any

import numpy as np

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.episode import Episode, make_env, play
from lgmd_gym.benchmark.fcw_driver import FCWDriver
from lgmd_gym.benchmark.metrics import Counterfactual
from lgmd_gym.benchmark.rows import RowKey, error_row, make_row
from lgmd_gym.benchmark.sensors import CLEAR, SensorConfig

NO_BRAKE = "no-brake"


@dataclass(frozen=True, slots=True)
class Task:
    """What to play.

    Attributes:
        agent: The agent's string.
        case: The case.
        seed: Of the environment and the agent.
        sensor_config: Camera and neuron parameters, or the agent's own; the condition included.
        truth: What `no-brake` met; None for `no-brake` itself.
        condition: Name of the camera's condition, for the row.
    """

    agent: str
    case: Case
    seed: int
    sensor_config: SensorConfig
    truth: Counterfactual | None = None
    condition: str = CLEAR

    @property
    def key(self) -> RowKey:
        """What tells it from all others of its run, see `rows.key_of`."""
        return self.agent, self.case.name, self.seed, self.condition


@dataclass(frozen=True, slots=True)
class Result:
    """What came of a task.

    Attributes:
        task: The task.
        row: The row of `episodes.jsonl`.
        series: The episode's time series; None after an error.
        truth: The counterfactual, if the task was `no-brake`'s.
    """

    task: Task
    row: dict[str, Any]
    series: dict[str, np.ndarray] | None = None
    truth: Counterfactual | None = None


def run_task(task: Task) -> Result:
    """Play a task; whatever an agent or environment raises becomes an error row."""
    try:
        agent: Any = make_agent(task.agent)
        sensor_config = task.sensor_config.of(agent)
        episode = _play(task, agent, sensor_config)
    except (Exception, SystemExit):  # an agent that calls exit() would take the worker with it
        error = traceback.format_exc()
        return Result(task, error_row(task.agent, task.case, task.seed, error, task.condition))
    truth = task.truth or Counterfactual.of(episode)
    row = make_row(task.agent, task.case, task.seed, episode, truth, condition=task.condition)
    row["camera"] = sensor_config.label
    return Result(task, row, episode.series, truth)


def _play(task: Task, agent: Any, sensor_config: SensorConfig) -> Episode:
    env = make_env(task.case, sensor_config)
    try:
        if task.case.fcw_driver and task.agent != NO_BRAKE:
            config = env.unwrapped.config  # type: ignore[attr-defined]
            agent = FCWDriver(agent, config["max_deceleration"], config["policy_frequency"])
        return play(env, agent, task.seed)
    finally:
        env.close()
