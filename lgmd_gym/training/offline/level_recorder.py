"""`LevelRecorder`: records the episodes of `EpisodeRecorder` with the compiled engine."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import gymnasium as gym
import numpy as np

from lgmd_gym.agents.base import HOLD
from lgmd_gym.engine import BrakingVectorEnv
from lgmd_gym.engine.simulation import Simulation, Snapshot
from lgmd_gym.training.offline.braking_outcomes import STRIDE, BrakingOutcome, batch_outcomes
from lgmd_gym.training.offline.episodes import Observation, RecordedEpisode, select_signals

NUM_ENVS = 4  # environments with cameras; more are slower, because fewer tables fit in the cache
NUM_REPLAYS = 128  # environments without cameras that replay braking


@dataclass
class _Run:
    """One episode without braking; a snapshot is taken at every `STRIDE`-th decision."""

    family: str
    observations: list[Observation] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)
    snapshots: list[Snapshot] = field(default_factory=list)
    threat: bool = False

    def to_episode(self, outcomes: list[BrakingOutcome]) -> RecordedEpisode:
        """Return the episode with the outcomes of braking."""
        return RecordedEpisode.from_outcomes(
            self.observations, self.rewards, outcomes, self.threat, self.family
        )


@dataclass(frozen=True)
class LevelRecorder:
    """Records episodes of an environment that the engine covers, one per seed.

    The episodes equal those of `EpisodeRecorder` for the same seeds.

    Attributes:
        env_id: Id of braking environments.
        arguments: Arguments of `gym.make_vec`; `camera` is required.
        brake: Demand that brakes, < 0.
        shrink: See `select_signals`.
    """

    env_id: str
    arguments: dict[str, Any]
    brake: float = -1.0
    shrink: int | None = None

    def record(self, seeds: range) -> list[list[RecordedEpisode]]:
        """Return a list with one episode for each seed."""
        if not seeds:
            return []
        runs = self._record_runs(seeds)
        replays = self._make_envs(NUM_REPLAYS, camera=None, include_frame=False)
        try:
            outcomes = batch_outcomes(
                [len(run.rewards) for run in runs],
                lambda pairs: self._replay(
                    replays.simulation, [(runs[index], onset) for index, onset in pairs]
                ),
            )
        finally:
            replays.close()
        return [[run.to_episode(found)] for run, found in zip(runs, outcomes, strict=True)]

    def _make_envs(self, num_envs: int, **changes: Any) -> BrakingVectorEnv:
        arguments = self.arguments | changes
        envs: Any = gym.make_vec(self.env_id, num_envs=num_envs, autoreset_mode="Disabled", **arguments)
        return envs.unwrapped

    def _record_runs(self, seeds: range) -> list[_Run]:
        """Return the episodes without braking; an environment starts the next one as soon as it is free."""
        envs = self._make_envs(min(NUM_ENVS, len(seeds)))
        simulation, demands = envs.simulation, np.full(envs.num_envs, HOLD)
        runs: list[_Run] = []
        waiting, running = deque(seeds), dict[int, _Run]()
        observations: Any = None
        try:
            while waiting or running:
                free = [index for index in range(envs.num_envs) if index not in running]
                if waiting and free:
                    observations = _start(envs, free, waiting, running, runs)
                self._append(running, observations, simulation)
                simulation.step(demands, _mask(running, envs.num_envs))
                observations = envs.read_observations()
                _finish(running, simulation)
        finally:
            envs.close()
        return runs

    def _append(self, running: dict[int, _Run], observations: Any, simulation: Simulation) -> None:
        """Append the present observations to the running episodes."""
        for index, run in running.items():
            if len(run.observations) % STRIDE == 0:
                run.snapshots.append(simulation.save(index))
            row = {name: values[index] for name, values in observations.items()}
            run.observations.append(select_signals(row, self.shrink))

    def _replay(self, simulation: Simulation, requests: list[tuple[_Run, int]]) -> Iterator[BrakingOutcome]:
        """Yield the outcome of braking for pairs of an episode and a decision."""
        for start in range(0, len(requests), NUM_REPLAYS):
            yield from self._replay_batch(simulation, requests[start : start + NUM_REPLAYS])

    def _replay_batch(
        self, simulation: Simulation, requests: list[tuple[_Run, int]]
    ) -> Iterator[BrakingOutcome]:
        """Yield the outcomes of at most `NUM_REPLAYS` requests."""
        for index, (run, onset) in enumerate(requests):
            simulation.restore(index, run.snapshots[onset // STRIDE])
        onsets = np.zeros(simulation.num_envs, np.int64)
        onsets[: len(requests)] = [onset % STRIDE for _, onset in requests]
        active = np.arange(simulation.num_envs) < len(requests)
        returns, contacts = np.zeros(simulation.num_envs), np.zeros(simulation.num_envs, np.bool_)
        outcome, step = simulation.outcome, 0
        while active.any():
            braking = step >= onsets
            simulation.step(np.where(braking, self.brake, HOLD), active, rendering=False)
            counted = active & braking
            returns[counted] += outcome.rewards[counted]
            ended = active & (outcome.terminated | outcome.truncated)
            contacts[ended] = outcome.infos["collision"][ended]
            active &= ~ended
            step += 1
        for index in range(len(requests)):
            yield BrakingOutcome(float(returns[index]), bool(contacts[index]))


def _mask(indices: Any, size: int) -> np.ndarray:
    mask = np.zeros(size, np.bool_)
    mask[list(indices)] = True
    return mask


def _start(
    envs: BrakingVectorEnv, free: list[int], waiting: deque[int], running: dict[int, _Run], runs: list[_Run]
) -> Any:
    """Start the next episodes in the free environments; return the observations of all environments."""
    started = free[: len(waiting)]
    seeds: list[int | None] = [None] * envs.num_envs
    for index in started:
        seeds[index] = waiting.popleft()
    observations, _ = envs.reset(seed=seeds, options={"reset_mask": _mask(started, envs.num_envs)})
    for index in started:
        running[index] = _Run(envs.scenario_of(index).family)
        runs.append(running[index])
    return observations


def _finish(running: dict[int, _Run], simulation: Simulation) -> None:
    """Append the rewards of the last decision and remove the episodes that have ended."""
    outcome = simulation.outcome
    ended = outcome.terminated | outcome.truncated
    for index, run in list(running.items()):
        run.rewards.append(float(outcome.rewards[index]))
        if ended[index]:
            run.threat = bool(outcome.infos["collision"][index])
            del running[index]
