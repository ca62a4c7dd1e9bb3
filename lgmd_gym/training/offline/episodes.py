"""Episodes without braking, recorded once, with the outcome of braking at each of their decisions.

With a latching brake, an episode is a drive at constant demand up to one braking decision. One recording
therefore contains every observation a policy can get before it brakes. Replays of copied environments
without sensors give the outcome of braking at each decision.
"""

from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import dataclass
from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np
from joblib import delayed

from lgmd_gym.agents.policies.features import FRAME, SCALES, shrink_frames
from lgmd_gym.processes.pool import run_parallel
from lgmd_gym.training.offline.braking_outcomes import STRIDE, BrakingOutcome, braking_outcomes

MINIMAL_CAMERA = {"name": "wide", "shape": (8, 8)}  # of the environment that is copied and replayed
CHUNK_SIZE = 4  # seeds recorded by one task of a process
SIGNALS = (*SCALES, "column_potential")  # recorded if present
TRAFFIC = "traffic"  # `family` of episodes in traffic

Observation: TypeAlias = dict[str, np.ndarray]


@dataclass(frozen=True)
class RecordedEpisode:
    """One episode without braking, of T environment decisions, for policies of any decision rate.

    Attributes:
        observations: Observations by name, (T, ...) each; `frame` is shrunk and present on request only.
        rewards: Reward of holding the speed at each decision, float32 (T,).
        braking_returns: Return of braking from each decision on, float32 (T,).
        braking_contacts: Whether braking from each decision on ends in a contact, bool (T,).
        threat: Whether the episode without braking ends in a contact.
        traffic: Whether the episode is a segment of a traffic episode.
        family: Scenario family of the level; "traffic" in traffic, empty if unknown.
    """

    observations: Observation
    rewards: np.ndarray
    braking_returns: np.ndarray
    braking_contacts: np.ndarray
    threat: bool
    traffic: bool = False
    family: str = ""

    def __len__(self) -> int:
        return len(self.rewards)

    @classmethod
    def from_outcomes(
        cls,
        observations: list[Observation],
        rewards: list[float],
        outcomes: list[BrakingOutcome],
        threat: bool,
        family: str,
    ) -> "RecordedEpisode":
        """Return the episode of observations, rewards and outcomes of braking, one each per decision."""
        return cls(
            stack(observations),
            rewards=np.array(rewards, np.float32),
            braking_returns=np.array([item.episode_return for item in outcomes], np.float32),
            braking_contacts=np.array([item.contact for item in outcomes]),
            threat=threat,
            family=family,
        )


RecordFunction: TypeAlias = Callable[[range], list[list[RecordedEpisode]]]
"""Method `record` of `EpisodeRecorder`, `LevelRecorder` and `TrafficRecorder`: the episodes of each seed."""


def record_parallel(
    record: RecordFunction, seeds: range, jobs: int = 1, chunk_size: int = CHUNK_SIZE
) -> Iterator[list[RecordedEpisode]]:
    """Yield the episodes of each seed, recorded by several processes.

    Args:
        record: Method of a recorder.
        seeds: Seeds of the environment.
        jobs: Number of processes.
        chunk_size: Largest number of seeds recorded by one task of a process.
    """
    size = max(min(chunk_size, -(-len(seeds) // jobs)), 1)
    chunks = [seeds[start : start + size] for start in range(0, len(seeds), size)]
    for by_seed in run_parallel((delayed(record)(chunk) for chunk in chunks), jobs):
        yield from by_seed


def select_signals(observation: Observation, shrink: int | None) -> Observation:
    """Return the recorded part of an observation.

    Args:
        observation: Observation of `LGMDObservation`.
        shrink: Side of the pixel squares that become one pixel of the recorded frame [px]; None for no frame.
    """
    signals = {name: observation[name] for name in SIGNALS if name in observation}
    return (
        signals if shrink is None else signals | {FRAME: shrink_frames(observation[FRAME][None], shrink)[0]}
    )


def stack(observations: list[Observation]) -> Observation:
    """Return the observations of an episode by name, (T, ...) each."""
    return {name: np.stack([item[name] for item in observations]) for name in observations[0]}


@dataclass(frozen=True)
class EpisodeRecorder:
    """Records episodes of an environment with a discrete demand and a latching brake, one per seed.

    Attributes:
        make_env: Picklable function that returns a new environment with `LGMDObservation`; its argument
            `camera` replaces the cameras.
        hold: Action that holds the speed.
        brake: Action that brakes.
        shrink: See `select_signals`.
    """

    make_env: Callable[..., gym.Env]
    hold: int
    brake: int
    shrink: int | None = None

    def record(self, seeds: range) -> list[list[RecordedEpisode]]:
        """Return a list with one episode for each seed."""
        env, twin = self.make_env(), self.make_env(camera=MINIMAL_CAMERA)
        try:
            return [[self._record_episode(env, twin.unwrapped, seed)] for seed in seeds]
        finally:
            env.close()
            twin.close()

    def _record_episode(self, env: gym.Env, twin: Any, seed: int) -> RecordedEpisode:
        """Record `env` and replay braking in copies of `twin`, the same environment without sensors."""
        observations, copies, rewards, done = [], [], [], False
        observation, info = env.reset(seed=seed)
        twin.reset(seed=seed)
        while not done:
            if len(observations) % STRIDE == 0:
                copies.append(deepcopy(twin))
            observations.append(select_signals(observation, self.shrink))
            observation, reward, terminated, truncated, info = env.step(self.hold)
            twin.step(self.hold)
            rewards.append(float(reward))
            done = terminated or truncated

        def replay(onset: int) -> BrakingOutcome:
            copy = deepcopy(copies[onset // STRIDE])
            for _ in range(onset % STRIDE):
                copy.step(self.hold)
            return _brake_to_end(copy, self.brake)

        outcomes = braking_outcomes(len(observations), replay)
        return RecordedEpisode.from_outcomes(
            observations, rewards, outcomes, bool(info["collision"]), _family_of(env)
        )


def _family_of(env: gym.Env) -> str:
    scenario = getattr(env.unwrapped, "scenario", None)
    return TRAFFIC if scenario is None else scenario.family


def _brake_to_end(env: Any, brake: int) -> BrakingOutcome:
    episode_return, done, info = 0.0, False, {}
    while not done:
        _, reward, terminated, truncated, info = env.step(brake)
        episode_return, done = episode_return + float(reward), terminated or truncated
    return BrakingOutcome(episode_return, bool(info["collision"]))
