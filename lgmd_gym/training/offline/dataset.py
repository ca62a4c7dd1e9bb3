"""`OfflineDataset`: batches of recorded episodes in the form that a policy is trained on."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import torch

from lgmd_gym.agents.policies.features import FRAME, FeatureConfig
from lgmd_gym.training.offline.episodes import RecordedEpisode
from lgmd_gym.training.offline.mirror import mirror_input
from lgmd_gym.training.offline.policy_inputs import policy_inputs


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

    It contains the inputs at each decision of the policy, those in `ZONE_INPUTS` as float16. Observations are
    not kept.

    Args:
        episodes: Recorded episodes, at least one; they are processed one by one.
        features: Inputs and timing of the policy.

    Attributes:
        episodes: The episodes without their observations.
    """

    def __init__(self, episodes: Iterable[RecordedEpisode], features: FeatureConfig) -> None:
        self.episodes: list[RecordedEpisode] = []
        self._features = features
        self._inputs: list[dict[str, np.ndarray]] = []  # of each episode
        for episode in episodes:
            # Batches add the history. Stored here, it would multiply the memory by its length.
            self._inputs.append(policy_inputs(episode.observations, features))
            self.episodes.append(replace(episode, observations={}))

    def __len__(self) -> int:
        return len(self.episodes)

    def batch(
        self, indices: Sequence[int] | np.ndarray, mirrored: Sequence[bool] | np.ndarray = ()
    ) -> EpisodeBatch:
        """Return the episodes with these indices.

        Args:
            indices: Indices of N episodes.
            mirrored: Whether each of them is mirrored, left to right, bool, (N,); empty for none.

        Raises:
            ValueError: If an episode is mirrored and an input has no known mirror image.
        """
        repeat = self._features.repeat
        episodes = [self.episodes[index] for index in indices]
        lengths = np.array([self._count_decisions(episode) for episode in episodes])
        rows = np.repeat(np.arange(len(episodes)), lengths)
        columns = np.concatenate([np.arange(length) for length in lengths])
        starts = (np.cumsum(lengths) - lengths)[rows]

        def padded(arrays: list[np.ndarray]) -> torch.Tensor:
            table = np.zeros((len(episodes), lengths.max()), arrays[0].dtype)
            table[rows, columns] = np.concatenate(arrays)
            return torch.from_numpy(table)

        return EpisodeBatch(
            inputs={
                name: self._with_history(name, self._arrays(name, indices, mirrored), columns, starts)
                for name in self._features.inputs
            },
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

    def _arrays(
        self, name: str, indices: Sequence[int] | np.ndarray, mirrored: Sequence[bool] | np.ndarray
    ) -> list[np.ndarray]:
        """Return an input of some episodes, (decisions, ...) each."""
        arrays = [self._inputs[index][name] for index in indices]
        if not len(mirrored):
            return arrays
        return [
            mirror_input(name, array) if flag else array for array, flag in zip(arrays, mirrored, strict=True)
        ]

    def _with_history(
        self, name: str, arrays: list[np.ndarray], columns: np.ndarray, starts: np.ndarray
    ) -> torch.Tensor:
        """Return an input with its history, oldest first; the first decision fills missing ones.

        Args:
            name: Name of the input.
            arrays: The input in each episode.
            columns: Decision of each row.
            starts: First row of the episode of each row.
        """
        values = np.concatenate(arrays)
        length = self._features.history_of(name)
        if length > 1:
            rows = [starts + np.maximum(columns - lag, 0) for lag in range(length - 1, -1, -1)]
            values = np.concatenate([values[row] for row in rows], axis=-1)
        if name == FRAME:
            return torch.from_numpy(np.moveaxis(values, -1, 1).copy())
        return torch.from_numpy(values).float()
