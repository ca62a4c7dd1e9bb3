"""Episodes without braking, recorded once, with the outcome of braking at each of their decisions.

With a latching brake, an episode is a drive at constant demand up to one braking decision. One recording
therefore contains every observation a policy can get before it brakes. Replays of copied environments
without sensors give the outcome of braking at each decision.
"""

from collections.abc import Callable, Iterable
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from joblib import Parallel, delayed

from lgmd_gym.agents.policies.features import FRAME, SCALES, shrink_frame
from lgmd_gym.training.offline.braking_outcomes import STRIDE, BrakingOutcome, braking_outcomes

MINIMAL_CAMERA = {"name": "wide", "shape": (8, 8)}  # of the environment that is copied and replayed


@dataclass(frozen=True)
class RecordedEpisode:
    """One episode without braking, of T environment decisions.

    Policies of any decision rate can be trained on it, because it holds every decision of the environment.

    Attributes:
        observations: Observations by name, (T, n) each.
        frames: Shrunk camera frames, uint8 (T, height, width, channels); None without frames.
        rewards: Reward of holding the speed at each decision, float32 (T,).
        braking_returns: Return of braking from each decision on, float32 (T,).
        braking_contacts: Whether braking from each decision on ends in a contact, bool (T,).
        threat: Whether the episode without braking ends in a contact.
        traffic: Whether the episode is a segment of a traffic episode.
    """

    observations: dict[str, np.ndarray]
    frames: np.ndarray | None
    rewards: np.ndarray
    braking_returns: np.ndarray
    braking_contacts: np.ndarray
    threat: bool
    traffic: bool = False

    def __len__(self) -> int:
        return len(self.rewards)


class ObservationBuffer:
    """Observations of one episode in recorded form.

    Args:
        shrink: Side of the pixel squares that become one pixel of a recorded frame [px]; None for no frames.
    """

    def __init__(self, shrink: int | None) -> None:
        self._observations: list[dict[str, np.ndarray]] = []
        self._frames: list[np.ndarray] = []
        self._shrink = shrink

    def __len__(self) -> int:
        return len(self._observations)

    def add(self, observation: dict[str, np.ndarray]) -> None:
        """Append an observation of `LGMDObservation`."""
        self._observations.append({name: observation[name] for name in SCALES})
        if self._shrink is not None:
            self._frames.append(shrink_frame(observation[FRAME], self._shrink))

    def arrays(self) -> tuple[dict[str, np.ndarray], np.ndarray | None]:
        """Return the observations by name, (T, n) each, and the frames or None."""
        observations = {name: np.stack([item[name] for item in self._observations]) for name in SCALES}
        return observations, np.stack(self._frames) if self._frames else None


def record_chunks(
    record_chunk: Callable[[range], list[Any]],
    chunks: Iterable[range],
    jobs: int,
    on_recorded: Callable[[int], Any],
) -> list[Any]:
    """Return one recording per seed, recorded in parallel.

    Args:
        record_chunk: Returns the recordings of some seeds.
        chunks: Seeds of each call.
        jobs: Number of processes.
        on_recorded: Called with the number of recordings added.
    """
    results: Any = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(record_chunk)(chunk) for chunk in chunks
    )
    recordings: list[Any] = []
    for recorded in results:
        recordings += recorded
        on_recorded(len(recorded))
    return recordings


@dataclass(frozen=True)
class EpisodeRecorder:
    """Records episodes of an environment with a discrete demand and a latching brake.

    Attributes:
        make_env: Returns a new environment with `LGMDObservation`; the argument `camera` replaces its
            cameras. Must be picklable.
        hold: Action that holds the speed.
        brake: Action that brakes.
        shrink: See `ObservationBuffer`.
    """

    make_env: Callable[..., gym.Env]
    hold: int
    brake: int
    shrink: int | None = None

    def record(
        self, seeds: range, jobs: int = 1, on_recorded: Callable[[int], Any] = lambda count: None
    ) -> list[RecordedEpisode]:
        """Record one episode per seed.

        Args:
            seeds: Seeds of the environment.
            jobs: Number of processes.
            on_recorded: Called with the number of episodes added.
        """
        size = max(min(len(seeds) // (4 * jobs), 20), 1)
        chunks = [seeds[start : start + size] for start in range(0, len(seeds), size)]
        return record_chunks(self._record_chunk, chunks, jobs, on_recorded)

    def _record_chunk(self, seeds: range) -> list[RecordedEpisode]:
        env, twin = self.make_env(), self.make_env(camera=MINIMAL_CAMERA)
        try:
            return [self._record_episode(env, twin.unwrapped, seed) for seed in seeds]
        finally:
            env.close()
            twin.close()

    def _record_episode(self, env: gym.Env, twin: Any, seed: int) -> RecordedEpisode:
        """Record `env` and replay braking in copies of `twin`, the same environment without sensors."""
        buffer, copies, rewards, done = ObservationBuffer(self.shrink), [], [], False
        observation, info = env.reset(seed=seed)
        twin.reset(seed=seed)
        while not done:
            if len(buffer) % STRIDE == 0:
                copies.append(deepcopy(twin))
            buffer.add(observation)
            observation, reward, terminated, truncated, info = env.step(self.hold)
            twin.step(self.hold)
            rewards.append(float(reward))
            done = terminated or truncated

        def replay(onset: int) -> BrakingOutcome:
            copy = deepcopy(copies[onset // STRIDE])
            for _ in range(onset % STRIDE):
                copy.step(self.hold)
            return _brake_to_end(copy, self.brake)

        outcomes = braking_outcomes(len(buffer), replay)
        return RecordedEpisode(
            *buffer.arrays(),
            rewards=np.array(rewards, np.float32),
            braking_returns=np.array([item.episode_return for item in outcomes], np.float32),
            braking_contacts=np.array([item.contact for item in outcomes]),
            threat=bool(info["collision"]),
        )


def _brake_to_end(env: Any, brake: int) -> BrakingOutcome:
    episode_return, done, info = 0.0, False, {}
    while not done:
        _, reward, terminated, truncated, info = env.step(brake)
        episode_return, done = episode_return + float(reward), terminated or truncated
    return BrakingOutcome(episode_return, bool(info["collision"]))
