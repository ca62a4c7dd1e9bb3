# pyright: standard
# Not strict: joblib states few types.
"""Objective of the parameter search: impact energy avoided in threats, and false activations elsewhere.

A latching rule drives as `no-brake` does until it brakes, and then brakes to a standstill. Episodes without
braking are therefore recorded once for each sensor configuration. Replaying the rule on a recording gives the
decision at which it brakes. The episode that brakes from this decision on is simulated with a minimal camera.
Rules without a latch are simulated in closed loop.
"""

import json
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from math import inf
from typing import Any

import numpy as np
from joblib import delayed

from lgmd_gym.agents import BRAKE, HOLD, Agent, BatchAgent, Rule, make_agent
from lgmd_gym.agents.base import Infos, Observations, rows_of
from lgmd_gym.aliases import Values
from lgmd_gym.benchmark.case import Row, level_case
from lgmd_gym.benchmark.metrics import Counterfactual, make_row
from lgmd_gym.benchmark.player import play_agent, run_task
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import find_suite
from lgmd_gym.benchmark.task import NO_BRAKE, Task
from lgmd_gym.camera.worlds import SPLIT_WORLDS
from lgmd_gym.engine.first_use import compile_kernels
from lgmd_gym.envs.appearance import MIXED
from lgmd_gym.envs.families.distribution import LEVELS
from lgmd_gym.errors import check_known, check_whole
from lgmd_gym.processes.pool import run_parallel

FIRST_SEED = {"train": 1000, "validation": 2000}  # of the false-reaction suite; reports use seeds from 0
MAX_SEEDS = 1000  # the seeds of the splits do not overlap
MAX_CACHED = 4  # sensor configurations whose recordings are kept
AGENT_SENSORS = SensorConfig()  # each agent's own cameras
MINIMAL_SENSORS = SensorConfig(camera={"name": "wide", "shape": [8, 8]})  # for agents without sensors


@dataclass(frozen=True, slots=True)
class ObjectiveValue:
    """Performance of a rule with certain parameters."""

    # mean share of the impact energy that is avoided in threats; 0 for premature braking
    avoided_energy: float
    false_rate: float  # share of the other episodes with a false activation
    threats: int  # number of episodes with a threat
    non_threats: int  # number of episodes without a threat

    def total(self, false_cost: float) -> float:
        """Return the value that tuning maximises: avoided_energy − false_cost · false_rate."""
        return self.avoided_energy - false_cost * self.false_rate

    @classmethod
    def from_rows(cls, rows: Iterable[Row]) -> "ObjectiveValue":
        """Return the value for the rows of all episodes."""
        rows = list(rows)
        energy = [avoided_energy(row) for row in rows if row["threat"]]
        false = [float(row["false_activation"]) for row in rows if not row["threat"]]
        energy_mean, false_rate = (float(np.mean(values or [0.0])) for values in (energy, false))
        return cls(energy_mean, false_rate, len(energy), len(false))


def avoided_energy(row: Row) -> float:
    """Return the share of the relative impact energy that braking avoided; 0 for premature braking."""
    if row["premature_brake"]:
        return 0.0
    impact_speed = row["relative_impact_speed"] or 0.0
    unbraked_speed = row["speed_reduction"] + impact_speed
    return 1.0 - (impact_speed / unbraked_speed) ** 2 if unbraked_speed > 0.0 else 1.0


@dataclass(frozen=True, slots=True)
class NoBrakeRecording:
    """Recording of one episode without braking through one sensor configuration."""

    seed: int  # seed of the episode
    counterfactual: Counterfactual  # outcome of the episode
    # observation and `lgmd/` keys of `info` at every decision, including the last one
    steps: list[tuple[Values, Values]]


class ObservationRecorder(BatchAgent):
    """Agent of one environment that never brakes and records its observations."""

    def __init__(self) -> None:
        super().__init__()
        self.steps: list[tuple[Values, Values]] = []

    def demands(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Record the observation and return `HOLD`."""
        sensor_info = {key: value for key, value in infos.row(0).items() if key.startswith("lgmd/")}
        self.steps.append((rows_of(observations, 0), sensor_info))
        return np.full(1, HOLD)


class FixedOnsetBrake(BatchAgent):
    """Agent that brakes fully from the decision with index `onset` on; never for None."""

    reads_neuron = False

    def __init__(self, onset: int | None) -> None:
        super().__init__()
        self._onset = inf if onset is None else onset

    def initial(self) -> Values:
        """Return the index of the decision before the first one."""
        return {"decision": -1}

    def demands(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return `BRAKE` from the onset on, `HOLD` before."""
        self.state["decision"] = self.state["decision"] + active
        return np.where(self.state["decision"] >= self._onset, BRAKE, HOLD)


class Objective:
    """Evaluation of rules on random levels and false-reaction cases, each in a world of its own.

    The worlds are those of the split; false-reaction cases have the camera condition of their world.

    Args:
        split: "train" or "validation".
        levels: Number of levels of the split, starting at 0.
        seeds: Number of seeds of the false-reaction suite; 0 to omit the suite.
        jobs: Number of processes; 1 runs in this process.
    """

    def __init__(self, split: str, levels: int, seeds: int, jobs: int = 1) -> None:
        check_known("split", split, FIRST_SEED)
        self.jobs = check_whole("jobs", jobs, 1)
        levels, seeds = check_whole("levels", levels, 0, LEVELS), check_whole("seeds", seeds, 0, MAX_SEEDS)
        worlds, first = SPLIT_WORLDS[split], FIRST_SEED[split]
        # A level has a world of its own, whatever the world of the task.
        self.tasks = [
            Task(NO_BRAKE, level_case(split, split, number), number, MINIMAL_SENSORS, world=worlds.start)
            for number in range(levels)
        ]
        for seed in range(first, first + seeds):
            for index, case in enumerate(find_suite("false-reaction").cases):
                world = int(np.random.default_rng([7, seed, index]).integers(worlds.start, worlds.stop))
                task = Task(NO_BRAKE, case, seed, MINIMAL_SENSORS, condition=MIXED, world=world)
                self.tasks.append(task)
        self._cache: dict[str, list[NoBrakeRecording]] = {}  # by sensor configuration, latest used last
        self._rows: dict[tuple[int, int | None], Row] = {}  # by episode and onset of braking

    def evaluate(self, agent: str, sensor_config: SensorConfig = AGENT_SENSORS) -> ObjectiveValue:
        """Return the value for an agent.

        Raises:
            RuntimeError: If an episode in closed loop fails; the message is the traceback.
        """
        rule = make_agent(agent)
        sensors = sensor_config.for_agent(rule)
        if not is_latching(rule):
            return ObjectiveValue.from_rows(self.closed_loop_rows(agent, sensors))
        recordings = self.recordings(sensors)
        keys = list(enumerate(find_onset(rule, recording) for recording in recordings))
        missing = [key for key in keys if key not in self._rows]
        arguments = ((self.tasks[i], recordings[i].counterfactual, onset) for i, onset in missing)
        self._rows.update(zip(missing, self._map(simulate_onset, arguments), strict=True))
        return ObjectiveValue.from_rows(self._rows[key] for key in keys)

    def recordings(self, sensors: SensorConfig) -> list[NoBrakeRecording]:
        """Return the recordings for a sensor configuration, from the cache if present."""
        key = json.dumps(asdict(sensors.plain))
        recordings = self._cache.pop(key, None)
        if recordings is None:
            recordings = self._map(record, ((replace(task, sensor_config=sensors),) for task in self.tasks))
        self._cache = dict([*self._cache.items(), (key, recordings)][-MAX_CACHED:])
        return recordings

    def closed_loop_rows(self, agent: str, sensors: SensorConfig) -> list[Row]:
        """Simulate an agent in closed loop and return one row for each episode."""
        counterfactuals = self._map(simulate_no_brake, ((task,) for task in self.tasks))
        tasks = (
            (replace(task, agent=agent, sensor_config=sensors, counterfactual=counterfactual),)
            for task, counterfactual in zip(self.tasks, counterfactuals, strict=True)
        )
        rows = [result.row for result in self._map(run_task, tasks)]
        error = next((row["error"] for row in rows if row["error"] is not None), None)
        if error is not None:
            raise RuntimeError(error)
        return rows

    def _map(self, function: Callable[..., Any], arguments: Iterable[tuple[Any, ...]]) -> list[Any]:
        compile_kernels()  # before the processes, which would all do so
        return list(run_parallel((delayed(function)(*each) for each in arguments), self.jobs))


def is_latching(agent: Agent) -> bool:
    """Return whether an agent brakes fully to the end of the episode once it brakes."""
    return isinstance(agent.agent, Rule)


def record(task: Task) -> NoBrakeRecording:
    """Simulate an episode without braking and return its recording."""
    recorder = ObservationRecorder()
    episode = play_agent(task, recorder)
    return NoBrakeRecording(task.seed, Counterfactual.of(episode), recorder.steps)


def find_onset(rule: Agent, recording: NoBrakeRecording) -> int | None:
    """Replay a latching rule; return the index of the decision at which it brakes, or None."""
    rule.reset(recording.seed)
    for index, (observation, info) in enumerate(recording.steps):
        if float(rule.act(observation, info)[0]) < HOLD:
            return index
    return None


def simulate_onset(task: Task, counterfactual: Counterfactual, onset: int | None) -> Row:
    """Return the row of an episode with full braking from a decision on."""
    episode = play_agent(task, FixedOnsetBrake(onset))
    return make_row("", task.case, task.seed, episode, counterfactual)


def simulate_no_brake(task: Task) -> Counterfactual:
    """Return the outcome of an episode without braking."""
    return Counterfactual.of(play_agent(task, FixedOnsetBrake(None)))
