"""One task of a run: one agent in one case with one seed."""

from dataclasses import dataclass

import numpy as np

from lgmd_gym.aliases import Arguments
from lgmd_gym.benchmark.case import NO_BRAKE, Case, Row, RowKey, new_row
from lgmd_gym.benchmark.episode import Episode
from lgmd_gym.benchmark.metrics import KEYS, Counterfactual, make_row
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.camera.scene import CLEAR
from lgmd_gym.camera.worlds import LABORATORY
from lgmd_gym.envs.registration import RANDOM


@dataclass(frozen=True, slots=True)
class Task:
    """One episode to run."""

    agent: str
    case: Case  # case to run
    seed: int  # seed of the environment and the agent
    sensor_config: SensorConfig  # camera and neuron parameters
    counterfactual: Counterfactual | None = None  # outcome of `no-brake`; None for `no-brake` itself
    condition: str = CLEAR  # name of the weather
    world: int | None = None  # number of the world; None for the laboratory
    road: str | None = None  # road that moves the car's body, see `Appearance`

    @property
    def arguments(self) -> Arguments:
        """Arguments of the environment: those of the case, and world, road and weather of the run."""
        chosen: Arguments = {} if self.road is None else {"road": self.road}
        own = self.case.environment == RANDOM  # a level has a world and a weather of its own
        if not own:
            chosen["weather"] = self.condition
        if self.world is None:
            chosen["world"] = LABORATORY
        elif not own:
            chosen["world"] = self.world
        return chosen | dict(self.case.arguments)

    @property
    def key(self) -> RowKey:
        """Key of the task's row, see `rows.key_of`."""
        return self.agent, self.case.name, self.seed, self.condition

    @property
    def has_driver(self) -> bool:
        """Whether the FCW driver brakes instead of the agent."""
        return self.case.fcw_driver and self.agent != NO_BRAKE


@dataclass(frozen=True, slots=True)
class Result:
    """Result of one episode."""

    row: Row  # row of `episodes.jsonl`
    series: dict[str, np.ndarray] | None = None  # time series; None for traffic and after an error
    # counterfactual of the row; None for traffic and after an error
    counterfactual: Counterfactual | None = None


def make_result(task: Task, episode: Episode, sensor_config: SensorConfig) -> Result:
    """Return the result of an episode that was played with a sensor configuration."""
    counterfactual = task.counterfactual or Counterfactual.of(episode)
    camera = sensor_config.label
    row = make_row(task.agent, task.case, task.seed, episode, counterfactual, task.condition, camera)
    return Result(row, episode.series, counterfactual)


def error_result(task: Task, error: str) -> Result:
    """Return the result of a task that failed with a traceback."""
    world = task.case.argument("world", task.world)
    world = None if world == LABORATORY else world
    return Result(new_row(KEYS, task.agent, task.case, task.seed, task.condition, world=world, error=error))
