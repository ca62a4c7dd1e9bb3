"""Players of tasks: the episodes of one agent, played at once on the engine."""

import traceback
from collections import deque
from collections.abc import Hashable, Iterator, Sequence

import numpy as np

from lgmd_gym.agents import BatchAgent, make_agent
from lgmd_gym.agents.base import InfoArrays
from lgmd_gym.aliases import Arguments, Values
from lgmd_gym.benchmark.case import key_of
from lgmd_gym.benchmark.episode import Episode, with_config
from lgmd_gym.benchmark.fcw_driver import FCWDriver
from lgmd_gym.benchmark.recorder import SeriesRecorder
from lgmd_gym.benchmark.task import Result, Task, error_result, make_result
from lgmd_gym.benchmark.units import Unit, group_key, make_once
from lgmd_gym.engine.batch import BrakingBatch
from lgmd_gym.envs.info import INFO_KEYS
from lgmd_gym.envs.registration import make_source

SHARED = ("config", "fps")  # arguments of a case that a simulation shares
WIDTH = 32  # environments of a player; more gain little, and fewer leave more time in Python


def run_task(task: Task) -> Result:
    """Play one task; an exception in the agent or the environment becomes an error row."""
    try:
        (result,) = BatchPlayer(task, 1).play([task])
    except (Exception, SystemExit):  # an agent that calls exit() would end the worker process
        return error_result(task, traceback.format_exc())
    return result


def play_agent(task: Task, agent: BatchAgent) -> Episode:
    """Play one task with an agent in place of that of the task."""
    ((_, episode),) = BatchPlayer(task, 1, agent).episodes([task])
    if isinstance(episode, str):
        raise RuntimeError(f"{agent.name} failed: {episode}")
    return episode


def play_unit(unit: Unit) -> Iterator[Result]:
    """Play the tasks of a unit, and yield their results as they end.

    The results equal those of `run_task`. If the player fails, for example because of an agent for the wrong
    cameras, the remaining tasks run one by one, so that the error belongs to the tasks that cause it.
    """
    make_once(unit.agents)
    left = {task.key: task for task in unit.tasks}
    try:
        for result in _player(unit).play(unit.tasks):
            del left[key_of(result.row)]
            yield result
    except (Exception, SystemExit):
        yield from map(run_task, left.values())


class BatchPlayer:
    """Plays tasks of one group in the environments of a `BrakingBatch`.

    Args:
        task: A task of the group.
        num_envs: Number of environments.
        agent: An agent in place of that of the task; None for that of the task.
        by_channel: Whether the series of episodes have the spike frequency of each channel, too.

    Raises:
        ValueError: If the agent, a camera or an argument is invalid.
    """

    def __init__(
        self, task: Task, num_envs: int, agent: BatchAgent | None = None, *, by_channel: bool = False
    ) -> None:
        agent = agent or make_agent(task.agent).agent
        arguments = with_config(task.arguments, agent.config)
        self._sensor_config = task.sensor_config.for_agent(agent)
        source = make_source(task.case.environment, _scenario_arguments(arguments))
        shared = {name: arguments[name] for name in SHARED if name in arguments}
        self._batch = BrakingBatch([source] * num_envs, **self._sensor_config.arguments | shared)
        channels = [channel.name for channel in self._sensor_config.channels] if by_channel else ()
        self._recorder = SeriesRecorder(num_envs, self._batch.simulation.rates.policy, channels)
        self._agent = self._make_agent(agent, task.has_driver)
        self._tasks: list[Task | None] = [None] * num_envs
        self._returns = np.zeros(num_envs)

    def play(self, tasks: Sequence[Task]) -> Iterator[Result]:
        """Play tasks and yield their results as they end; the next task takes the place of one that ended."""
        for task, episode in self.episodes(tasks):
            if isinstance(episode, str):
                yield error_result(task, episode)
            else:
                yield make_result(task, episode, self._sensor_config)

    def episodes(self, tasks: Sequence[Task]) -> Iterator[tuple[Task, Episode | str]]:
        """Play tasks and yield their episodes as they end, or the traceback of an agent that failed."""
        waiting, batch, outcome = deque(tasks), self._batch, self._batch.simulation.outcome
        self._tasks = [None] * batch.num_envs  # of an earlier call that did not end
        while waiting or self._active.any():
            self._start_episodes(waiting)
            observations, infos = batch.observations(), BatchInfos(batch)
            demands = self._agent.act(observations, infos, self._active)
            for index, error in self._agent.failures.items():
                yield self._release(index), "".join(traceback.format_exception(error))
            active = self._active
            self._recorder.add(active, observations, infos, self._agent.alerts, demands)
            for index in np.flatnonzero(active & (outcome.terminated | outcome.truncated)).tolist():
                yield self._release(index), self._episode(index)
            active = self._active
            batch.simulation.step(batch.read_demands(np.where(active, demands, 0.0)), active)
            self._returns[active] += outcome.rewards[active]

    @property
    def _active(self) -> np.ndarray:
        """Environments with a task, bool, shape (N,)."""
        return np.array([task is not None for task in self._tasks])

    def _start_episodes(self, waiting: "deque[Task]") -> None:
        """Start waiting tasks in the free environments."""
        fresh, seeds = np.zeros(len(self._tasks), np.bool_), np.zeros(len(self._tasks), np.int64)
        for index in np.flatnonzero(~self._active).tolist()[: len(waiting)]:
            task, queue = waiting.popleft(), self._batch.queue
            queue.sources[index] = make_source(task.case.environment, _scenario_arguments(task.arguments))
            queue.seed(index, task.seed)
            seeds[index] = task.seed
            self._recorder.start(index)
            self._returns[index], self._tasks[index], fresh[index] = 0.0, task, True
        if fresh.any():
            self._batch.start(fresh)
            self._agent.reset(fresh, seeds)

    def _episode(self, index: int) -> Episode:
        """Return the episode of an environment, which has ended."""
        prepared = self._batch.episodes[index]
        assert prepared is not None
        placement = prepared.draw.placement
        target = placement.bodies[placement.target]
        info = self._batch.simulation.outcome.infos[index]
        return Episode.of(
            self._recorder.series(index),
            dict(zip(INFO_KEYS, info.tolist(), strict=True)),
            placement.scenario,
            float(target["shade"]) if placement.target else float("nan"),
            self._batch.fps,
            float(self._returns[index]),
            prepared.draw.info["world"],
        )

    def _release(self, index: int) -> Task:
        task, self._tasks[index] = self._tasks[index], None
        assert task is not None
        return task

    def _make_agent(self, agent: BatchAgent, has_driver: bool) -> BatchAgent:
        """Return the agent of all environments, inside the FCW driver where the case has one."""
        batch, simulation = agent.for_envs(self._batch.num_envs), self._batch.simulation
        if simulation.rates.steps != simulation.stride:
            self._batch.record_traces()
        limits = simulation.brakes["max_deceleration"]
        return FCWDriver(batch, lambda: limits, simulation.rates.policy) if has_driver else batch


class BatchInfos(InfoArrays):
    """The present infos of a `BrakingBatch` for agents, whose rows have the keys of single environments.

    Args:
        batch: The environments; their traces start anew.
    """

    def __init__(self, batch: BrakingBatch) -> None:
        super().__init__(batch.infos())
        self["lgmd/trace"] = batch.take_trace()
        self._batch = batch

    def row(self, index: int) -> Values:
        """Return the info of one environment."""
        return self._batch.info_of(super().row(index), index)


_players: dict[Hashable, BatchPlayer] = {}  # at most one, because it is large


def _player(unit: Unit) -> BatchPlayer:
    """Return the player for a unit: that of the unit before if it belongs to the same group and run."""
    task = unit.tasks[0]
    key = unit.run, WIDTH, group_key(task)
    if key not in _players:
        _players.clear()
        _players[key] = BatchPlayer(task, WIDTH)
    return _players[key]


def _scenario_arguments(arguments: Arguments) -> Arguments:
    """Return the arguments without those that a simulation shares."""
    return {name: value for name, value in arguments.items() if name not in SHARED}
