"""Batches of tasks: the episodes of one agent, played at once on the engine."""

from collections import deque
from collections.abc import Hashable, Iterator, Sequence
from typing import Any

import numpy as np

from lgmd_gym.agents import Agent, BatchAgent, make_agent
from lgmd_gym.benchmark.agent_slots import AgentSlots
from lgmd_gym.benchmark.case import key_of
from lgmd_gym.benchmark.episode import Episode
from lgmd_gym.benchmark.fcw_driver import FCWDriver
from lgmd_gym.benchmark.recorder import SeriesRecorder
from lgmd_gym.benchmark.task import Result, Task, error_result, make_result, run_task
from lgmd_gym.benchmark.units import Unit, group_key, make_once
from lgmd_gym.benchmark.views import Views
from lgmd_gym.engine.actions import Demands
from lgmd_gym.engine.episodes import EpisodeQueue, Prepared
from lgmd_gym.engine.simulation import Rates, Simulation
from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.info import INFO_KEYS
from lgmd_gym.envs.registration import make_source
from lgmd_gym.neuron import LGMDParams
from lgmd_gym.sensing.frame_rate import camera_rate
from lgmd_gym.sensing.sensor_array import SensorArray
from lgmd_gym.sensing.spaces import SIGNALS

WIDTH = 32  # environments of a simulation; more gain little, and fewer leave more time in Python


def play_unit(unit: Unit) -> Iterator[Result]:
    """Play the tasks of a unit, and yield their results as they end.

    The results equal those of `run_task`. If the batch fails, for example because of an agent for the wrong
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
    """Plays tasks of one group in the environments of a simulation.

    Args:
        task: A task of the group.
        num_envs: Number of environments.

    Raises:
        ValueError: If a camera is a top view, which the engine does not draw.
    """

    def __init__(self, task: Task, num_envs: int) -> None:
        arguments = task.arguments
        agent = make_agent(task.agent)
        self._sensor_config = task.sensor_config.for_agent(agent)
        source = make_source(task.case.environment, _scenario_arguments(arguments))
        self._env = env = BrakingEnv(source, config=arguments.get("config"))
        if self._sensor_config.has_top_view:
            raise ValueError("the engine does not draw top views")
        self._simulation = self._make_simulation(env, arguments.get("fps"), num_envs)
        self._demands = Demands(env.action_type)
        self._recorder = SeriesRecorder(num_envs, self._simulation.rates.policy)
        params = LGMDParams.make(self._sensor_config.params)
        self._views = Views(self._simulation, params, self._sensor_config.include_frame)
        self._slots = AgentSlots(self._make_agent(task, agent), self._views)
        self._queue = EpisodeQueue([source] * num_envs, ahead=False)
        self._tasks: list[Task | None] = [None] * num_envs
        self._episodes: list[Prepared | None] = [None] * num_envs
        self._returns = np.zeros(num_envs)

    def play(self, tasks: Sequence[Task]) -> Iterator[Result]:
        """Play tasks and yield their results as they end; the next task takes the place of one that ended."""
        waiting, outcome = deque(tasks), self._simulation.outcome
        self._tasks = [None] * len(self._tasks)  # of an earlier call that did not end
        while waiting or self._active.any():
            self._start_episodes(waiting)
            self._views.read()
            demands, alerts = self._slots.act(self._active)
            for index, error in self._slots.failures.items():
                yield error_result(self._release(index), error)
            self._record(demands, alerts)
            done = self._active & (outcome.terminated | outcome.truncated)
            for index in np.flatnonzero(done).tolist():
                yield self._finish(index)
            active = self._active
            self._simulation.step(self._demands.read(np.where(active, demands, 0.0), len(active)), active)
            self._returns[active] += outcome.rewards[active]

    @property
    def _active(self) -> np.ndarray:
        """Environments with a task, bool, shape (N,)."""
        return np.array([task is not None for task in self._tasks])

    def _start_episodes(self, waiting: "deque[Task]") -> None:
        """Start waiting tasks in the free environments."""
        fresh = np.zeros(len(self._tasks), np.bool_)
        for index in np.flatnonzero(~self._active).tolist()[: len(waiting)]:
            task = waiting.popleft()
            arguments = _scenario_arguments(task.arguments)
            self._queue.sources[index] = make_source(task.case.environment, arguments)
            self._queue.seed(index, task.seed)
            prepared = self._queue.next(index)
            draw = prepared.draw
            brake = self._env.episode_brake(draw.brake)
            self._simulation.load(index, draw, prepared.network, brake)
            self._views.start(index, draw.info)
            self._slots.start(index, task.seed)
            self._recorder.start(index)
            self._returns[index] = 0.0
            self._tasks[index], self._episodes[index] = task, prepared
            fresh[index] = True
        if fresh.any():
            self._simulation.start(fresh)

    def _record(self, demands: np.ndarray, alerts: np.ndarray) -> None:
        envs = np.flatnonzero(self._active)
        infos: Any = self._simulation.outcome.infos[envs]
        observations = {name: self._views.observations[name][envs] for name in SIGNALS}
        self._recorder.add(envs, observations, infos, alerts[envs], demands[envs])

    def _finish(self, index: int) -> Result:
        """Return the result of an episode that has ended, and release its environment."""
        prepared = self._episodes[index]
        assert prepared is not None
        placement = prepared.draw.placement
        target = placement.bodies[placement.target]
        info = self._simulation.outcome.infos[index]
        episode = Episode.of(
            self._recorder.series(index),
            dict(zip(INFO_KEYS, info.tolist(), strict=True)),
            placement.scenario,
            float(target["shade"]) if placement.target else float("nan"),
            self._simulation.rates.camera,
            float(self._returns[index]),
            prepared.draw.info["world"],
        )
        return make_result(self._release(index), episode, self._sensor_config)

    def _release(self, index: int) -> Task:
        task, self._tasks[index] = self._tasks[index], None
        assert task is not None
        return task

    def _make_simulation(self, env: BrakingEnv, fps: float | None, num_envs: int) -> Simulation:
        arguments, settings = self._sensor_config.arguments, env.config
        simulation_frequency, policy = settings["simulation_frequency"], settings["policy_frequency"]
        camera = camera_rate(fps, simulation_frequency)
        rates = Rates(simulation=simulation_frequency, policy=policy, camera=camera)
        params = LGMDParams.make(arguments["params"])
        sensors = SensorArray(arguments["camera"], camera, params, num_envs)
        simulation = Simulation(num_envs, rates, sensors, settings["throttle"])
        simulation.weights[:] = env.weights
        return simulation

    def _make_agent(self, task: Task, agent: Agent) -> BatchAgent:
        rates, limits = self._simulation.rates, self._simulation.brakes["max_deceleration"]
        batch = agent.agent.for_envs(len(limits))
        return FCWDriver(batch, lambda: limits, rates.policy) if task.has_driver else batch


_players: dict[Hashable, BatchPlayer] = {}  # at most one, because it is large


def _player(unit: Unit) -> BatchPlayer:
    """Return the player for a unit: that of the unit before if it belongs to the same group and run."""
    task = unit.tasks[0]
    key = unit.run, WIDTH, group_key(task)
    if key not in _players:
        _players.clear()
        _players[key] = BatchPlayer(task, WIDTH)
    return _players[key]


def _scenario_arguments(arguments: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments without those that a simulation shares."""
    return {name: value for name, value in arguments.items() if name not in ("config", "fps")}
