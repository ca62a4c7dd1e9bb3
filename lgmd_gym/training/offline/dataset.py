"""`OfflineDataset`: batches of recorded episodes in the form that a policy is trained on."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import torch

from lgmd_gym.agents.policies.features import FRAME, FeatureConfig, FeatureHistory
from lgmd_gym.training.offline.episodes import RecordedEpisode


class EpisodeBatch(NamedTuple):
    """N episodes of at most T policy decisions, M decisions in total.

    Attributes:
        inputs: Policy inputs by name, (M, ...) each, frames with channels first.
        indices: Episode and decision of each row of `inputs`, (M,) each.
        rewards: Rewards of holding the speed, (N, T); this and the next three are 0 after the episode's end.
        braking_returns: Returns of braking, (N, T).
        braking_contacts: Whether braking ends in a contact, bool (N, T).
        mask: 1 at the decisions of the episode, (N, T).
        threats: Whether the episode without braking ends in a contact, bool (N,).
    """

    inputs: dict[str, torch.Tensor]
    indices: tuple[torch.Tensor, torch.Tensor]
    rewards: torch.Tensor
    braking_returns: torch.Tensor
    braking_contacts: torch.Tensor
    mask: torch.Tensor
    threats: torch.Tensor


class OfflineDataset:
    """Recorded episodes with the inputs and the decision rate of a policy.

    Args:
        episodes: Recorded episodes, at least one.
        features: Inputs and timing of the policy.
    """

    def __init__(self, episodes: list[RecordedEpisode], features: FeatureConfig) -> None:
        self.episodes, self._features = episodes, features
        self._starts = np.cumsum([0, *map(self._count_decisions, episodes)])
        self._inputs = {}
        if FRAME in features.inputs:
            frames = [episode.observations[FRAME][:: features.repeat] for episode in episodes]
            self._inputs[FRAME] = np.concatenate(frames)
        signals = tuple(name for name in features.inputs if name != FRAME)
        if signals:
            # Batches add the history. Stored here, it would multiply the memory by its length.
            history = FeatureHistory(replace(features, inputs=signals, history=1))
            rows = [row for episode in episodes for row in _policy_inputs(episode, history)]
            self._inputs |= {name: np.stack([row[name] for row in rows]) for name in signals}

    def __len__(self) -> int:
        return len(self.episodes)

    def batch(self, indices: Sequence[int] | np.ndarray) -> EpisodeBatch:
        """Return the episodes with these indices."""
        repeat = self._features.repeat
        episodes = [self.episodes[index] for index in indices]
        lengths = np.array([self._count_decisions(episode) for episode in episodes])
        rows = np.repeat(np.arange(len(episodes)), lengths)
        columns = np.concatenate([np.arange(length) for length in lengths])
        starts = self._starts[np.asarray(indices)][rows]

        def padded(arrays: list[np.ndarray]) -> torch.Tensor:
            table = np.zeros((len(episodes), lengths.max()), arrays[0].dtype)
            table[rows, columns] = np.concatenate(arrays)
            return torch.from_numpy(table)

        return EpisodeBatch(
            inputs={name: self._with_history(name, columns, starts) for name in self._inputs},
            indices=(torch.from_numpy(rows), torch.from_numpy(columns)),
            rewards=padded([np.add.reduceat(item.rewards, range(0, len(item), repeat)) for item in episodes]),
            braking_returns=padded([item.braking_returns[::repeat] for item in episodes]),
            braking_contacts=padded([item.braking_contacts[::repeat] for item in episodes]),
            mask=padded([np.ones(length, np.float32) for length in lengths]),
            threats=torch.tensor([item.threat for item in episodes]),
        )

    def _count_decisions(self, episode: RecordedEpisode) -> int:
        """Return the number of policy decisions in an episode."""
        return -(-len(episode) // self._features.repeat)

    def _with_history(self, name: str, columns: np.ndarray, starts: np.ndarray) -> torch.Tensor:
        """Return an input with its history, oldest first; the first decision fills missing ones."""
        lags = range(self._features.history_of(name) - 1, -1, -1)
        parts = [self._inputs[name][starts + np.maximum(columns - lag, 0)] for lag in lags]
        joined = np.concatenate(parts, axis=-1)
        return torch.from_numpy(np.moveaxis(joined, -1, 1).copy() if name == FRAME else joined)


def _policy_inputs(episode: RecordedEpisode, history: FeatureHistory) -> Iterator[dict[str, np.ndarray]]:
    """Yield the policy inputs at each policy decision."""
    history.reset()
    for decision in range(len(episode)):
        history.update({name: array[decision] for name, array in episode.observations.items()})
        if decision % history.features.repeat == 0:
            yield history.stack()
