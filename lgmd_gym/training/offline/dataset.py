"""Recorded drives as batches to learn from: what a policy would be shown, and what braking brings."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import torch

from lgmd_gym.agents.policies.features import FRAME, FeatureConfig, FeatureHistory
from lgmd_gym.training.offline.episodes import Drive


class Batch(NamedTuple):
    """N drives of at most T decisions of the policy, of M decisions together.

    Attributes:
        shown: What the policy is shown, each (M, ...), images with channels first.
        place: Where each decision belongs: drive and decision, (M,) each.
        rewards: Of holding the speed, (N, T); 0 beyond a drive's end, as are the next two.
        returns: Of braking, (N, T).
        valid: 1 where there is a decision, (N, T).
        contacts: Whether braking ends in a contact, bool (N, T).
        threats: Whether the drive does, bool (N,).
    """

    shown: dict[str, torch.Tensor]
    place: tuple[torch.Tensor, torch.Tensor]
    rewards: torch.Tensor
    returns: torch.Tensor
    valid: torch.Tensor
    contacts: torch.Tensor
    threats: torch.Tensor


class Lessons:
    """Recorded drives as a policy with certain features would see them.

    Args:
        drives: At least one.
        features: Of the policy.
    """

    def __init__(self, drives: list[Drive], features: FeatureConfig) -> None:
        self.drives, self._features = drives, features
        self._starts = np.cumsum([0, *(_decisions(drive, features.repeat) for drive in drives)])
        self._shown = {}
        if FRAME in features.inputs:
            frames = [drive.frames[:: features.repeat] for drive in drives if drive.frames is not None]
            self._shown[FRAME] = np.concatenate(frames)
        signals = tuple(name for name in features.inputs if name != FRAME)
        if signals:
            # History is put together batch by batch: kept here, all would be there six times.
            memory = FeatureHistory(replace(features, inputs=signals, history=1))
            moments = [shown for drive in drives for shown in _relived(drive, memory)]
            self._shown |= {name: np.stack([moment[name] for moment in moments]) for name in signals}

    def __len__(self) -> int:
        return len(self.drives)

    def batch(self, chosen: Any) -> Batch:
        """Return the drives with these indices."""
        repeat = self._features.repeat
        drives = [self.drives[index] for index in chosen]
        lengths = np.array([_decisions(drive, repeat) for drive in drives])
        rows = np.repeat(np.arange(len(drives)), lengths)
        columns = np.concatenate([np.arange(length) for length in lengths])
        starts = self._starts[np.asarray(chosen)][rows]
        shown = {name: self._with_history(name, columns, starts) for name in self._shown}

        def laid_out(told: list[np.ndarray]) -> torch.Tensor:
            table = np.zeros((len(drives), lengths.max()), told[0].dtype)
            table[rows, columns] = np.concatenate(told)
            return torch.from_numpy(table)

        return Batch(
            shown,
            place=(torch.from_numpy(rows), torch.from_numpy(columns)),
            rewards=laid_out([np.add.reduceat(d.rewards, range(0, len(d), repeat)) for d in drives]),
            returns=laid_out([drive.returns[::repeat] for drive in drives]),
            valid=laid_out([np.ones(length, np.float32) for length in lengths]),
            contacts=laid_out([drive.contacts[::repeat] for drive in drives]),
            threats=torch.tensor([drive.threat for drive in drives]),
        )

    def _with_history(self, name: str, columns: np.ndarray, starts: np.ndarray) -> torch.Tensor:
        back = range(self._features.history - 1, -1, -1)
        parts = [self._shown[name][starts + np.maximum(columns - steps, 0)] for steps in back]
        joined = np.concatenate(parts, axis=-1)
        return torch.from_numpy(np.moveaxis(joined, -1, 1).copy() if name == FRAME else joined)


def _decisions(drive: Drive, repeat: int) -> int:
    """Return how often a policy decides on a drive."""
    return -(-len(drive) // repeat)


def _relived(drive: Drive, memory: FeatureHistory) -> Iterator[dict[str, np.ndarray]]:
    memory.reset()
    for moment in range(len(drive)):
        memory.update({name: array[moment] for name, array in drive.seen.items()})
        if moment % memory.features.repeat == 0:
            yield memory.stack()
