"""Recorders of episodes without braking, with the outcome of braking at each of their decisions.

With a latching brake, an episode is a drive at constant demand up to one braking decision. One recording
therefore contains every observation a policy can get before it brakes. Replays of copied environments
without sensors give the outcome of braking at each decision.
"""

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np

from lgmd_gym.agents.base import HOLD
from lgmd_gym.aliases import Arguments, Info
from lgmd_gym.engine import BrakingVectorEnv
from lgmd_gym.envs.simulation import Simulation
from lgmd_gym.training.offline.episodes import (
    TRAFFIC,
    BrakingOutcome,
    Observation,
    RecordedEpisode,
    select_signals,
    stack,
)

MINIMAL_CAMERA = {"name": "wide", "shape": (8, 8)}  # of the environment that is copied and replayed
STRIDE = 12  # largest distance of two replays [decisions], 0.4 s at 30 Hz
TOLERANCE = 0.05  # largest deviation of a replayed return from the linear interpolation


Rounds: TypeAlias = Generator[list[int], Iterable[BrakingOutcome], list[BrakingOutcome]]
"""Yields decisions to replay, receives their outcomes, and returns the outcome of every decision."""


def braking_outcomes(
    lengths: Sequence[int], replay: Callable[[list[tuple[int, int]]], Iterable[BrakingOutcome]]
) -> list[list[BrakingOutcome]]:
    """Return the outcome of braking at each decision of several episodes, with few calls of `replay`.

    Every twelfth decision is replayed, and the midpoint of each interval between two of them. If the return
    at the midpoint deviates from the linear interpolation by more than 0.05, or the three outcomes differ in
    contact, both halves are refined in the same way. Otherwise the interval is interpolated. Where contacts
    change once with the decision, that decision is exact; two changes between neighbouring replays, at most
    six decisions apart, are not noticed.

    Args:
        lengths: Number of decisions of each episode, >= 1.
        replay: Returns the outcomes of braking for pairs of an episode's index and a decision; no pair is
            replayed twice.
    """
    results: list[list[BrakingOutcome]] = [[] for _ in lengths]
    rounds = [_rounds(length) for length in lengths]
    requests = {index: next(item) for index, item in enumerate(rounds)}
    while requests:
        pairs = [(index, onset) for index, onsets in requests.items() for onset in onsets]
        found = dict(zip(pairs, replay(pairs), strict=True))
        following: dict[int, list[int]] = {}
        for index, onsets in requests.items():
            outcomes = [found[index, onset] for onset in onsets]
            try:
                following[index] = rounds[index].send(outcomes)
            except StopIteration as stop:
                results[index] = stop.value
        requests = following
    return results


def _rounds(length: int) -> Rounds:
    """Replay the grid, then the midpoints of all intervals that are not yet interpolated."""
    grid = [*range(0, length - 1, STRIDE), length - 1]
    known = dict(zip(grid, (yield grid), strict=True))
    intervals = list(pairwise(grid))
    while intervals := [(first, last) for first, last in intervals if last - first > 1]:
        middles = [(first + last) // 2 for first, last in intervals]
        known.update(zip(middles, (yield middles), strict=True))
        refined: list[tuple[int, int]] = []
        for (first, last), middle in zip(intervals, middles, strict=True):
            if not _interpolate(first, middle, last, known):
                refined += [(first, middle), (middle, last)]
        intervals = refined
    return [known[onset] for onset in range(length)]


def _interpolate(first: int, middle: int, last: int, known: dict[int, BrakingOutcome]) -> bool:
    """Add the outcomes of the decisions of an interval if they are linear; return whether they are."""
    low, mid, high = known[first], known[middle], known[last]
    slope = (high.episode_return - low.episode_return) / (last - first)
    deviation = abs(mid.episode_return - low.episode_return - slope * (middle - first))
    if deviation > TOLERANCE or not low.contact == mid.contact == high.contact:
        return False
    for onset in range(first + 1, last):
        interpolated = low.episode_return + slope * (onset - first)
        known.setdefault(onset, BrakingOutcome(interpolated, low.contact))
    return True


@dataclass
class _Run:
    """One episode without braking; a snapshot is taken at every `STRIDE`-th decision."""

    family: str
    observations: list[Observation] = field(default_factory=list[Observation])
    rewards: list[float] = field(default_factory=list[float])
    snapshots: list[Any] = field(default_factory=list[Any])
    threat: bool = False

    def to_episode(self, outcomes: list[BrakingOutcome]) -> RecordedEpisode:
        """Return the episode with the outcomes of braking, one per decision."""
        return RecordedEpisode(
            stack(self.observations),
            rewards=np.array(self.rewards, np.float32),
            braking_returns=np.array([item.episode_return for item in outcomes], np.float32),
            braking_contacts=np.array([item.contact for item in outcomes]),
            threat=self.threat,
            family=self.family,
        )


Requests: TypeAlias = list[tuple[_Run, int]]
"""Pairs of an episode and a decision at which braking begins."""


def _to_episodes(
    runs: Sequence[_Run], replay: Callable[[Requests], Iterable[BrakingOutcome]]
) -> list[list[RecordedEpisode]]:
    """Return a list with the episode of each run; `replay` returns the outcomes of braking."""
    outcomes = braking_outcomes(
        [len(run.rewards) for run in runs],
        lambda pairs: replay([(runs[index], onset) for index, onset in pairs]),
    )
    return [[run.to_episode(found)] for run, found in zip(runs, outcomes, strict=True)]


@dataclass(frozen=True)
class EpisodeRecorder:
    """Records episodes of an environment with a discrete demand and a latching brake, one per seed."""

    # picklable function that returns a new environment with `LGMDObservation`; its argument `camera` replaces
    # the cameras
    make_env: Callable[..., gym.Env]
    hold: int  # action that holds the speed
    brake: int  # action that brakes
    shrink: int | None = None  # see `select_signals`

    def record(self, seeds: range) -> list[list[RecordedEpisode]]:
        """Return a list with one episode for each seed."""
        env, twin = self.make_env(), self.make_env(camera=MINIMAL_CAMERA)
        try:
            return [
                _to_episodes([self._record_run(env, twin.unwrapped, seed)], self._replay)[0] for seed in seeds
            ]
        finally:
            env.close()
            twin.close()

    def _record_run(self, env: gym.Env, twin: Any, seed: int) -> _Run:
        """Record `env`, with copies of `twin`, the same environment without sensors, as snapshots."""
        observation, info = env.reset(seed=seed)
        twin.reset(seed=seed)
        run, done = _Run(_family_of(env)), False
        while not done:
            if len(run.observations) % STRIDE == 0:
                run.snapshots.append(deepcopy(twin))
            run.observations.append(select_signals(observation, self.shrink))
            observation, reward, terminated, truncated, info = env.step(self.hold)
            twin.step(self.hold)
            run.rewards.append(float(reward))
            done = terminated or truncated
        run.threat = bool(info["collision"])
        return run

    def _replay(self, requests: Requests) -> Iterator[BrakingOutcome]:
        """Yield the outcome of braking for pairs of an episode and a decision."""
        for run, onset in requests:
            copy = deepcopy(run.snapshots[onset // STRIDE])
            for _ in range(onset % STRIDE):
                copy.step(self.hold)
            yield _brake_to_end(copy, self.brake)


def _family_of(env: gym.Env) -> str:
    scenario = getattr(env.unwrapped, "scenario", None)
    return TRAFFIC if scenario is None else scenario.family


def _brake_to_end(env: Any, brake: int) -> BrakingOutcome:
    episode_return, done, info = 0.0, False, Info()
    while not done:
        _, reward, terminated, truncated, info = env.step(brake)
        episode_return, done = episode_return + float(reward), terminated or truncated
    return BrakingOutcome(episode_return, bool(info["collision"]))


NUM_ENVS = 4  # environments with cameras; more are slower, because fewer tables fit in the cache
NUM_REPLAYS = 128  # environments without cameras that replay braking


@dataclass(frozen=True)
class LevelRecorder:
    """Records episodes of an environment that the engine covers, one per seed.

    The episodes equal those of `EpisodeRecorder` for the same seeds.
    """

    env_id: str  # id of braking environments
    arguments: Arguments  # arguments of `gym.make_vec`; `camera` is required
    brake: float = -1.0  # demand that brakes, < 0
    shrink: int | None = None  # see `select_signals`

    def record(self, seeds: range) -> list[list[RecordedEpisode]]:
        """Return a list with one episode for each seed."""
        if not seeds:
            return []
        runs = self._record_runs(seeds)
        replays = self._make_envs(NUM_REPLAYS, camera=None, include_frame=False)
        try:
            return _to_episodes(runs, partial(self._replay, replays.simulation))
        finally:
            replays.close()

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

    def _replay(self, simulation: Simulation, requests: Requests) -> Iterator[BrakingOutcome]:
        """Yield the outcome of braking for pairs of an episode and a decision."""
        for start in range(0, len(requests), NUM_REPLAYS):
            yield from self._replay_batch(simulation, requests[start : start + NUM_REPLAYS])

    def _replay_batch(self, simulation: Simulation, requests: Requests) -> Iterator[BrakingOutcome]:
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
