"""Recorded drives as batches to learn from: what a policy would be shown, and what braking brings."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import torch

from lgmd_gym.agents.features import FRAME, Features, Memory
from lgmd_gym.training.drives import Drive


class Batch(NamedTuple):
    """N drives of at most T decisions, of M decisions together.

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

    def __init__(self, drives: list[Drive], features: Features) -> None:
        self.drives, self._features = drives, features
        # History is put together batch by batch: kept here, all would be there six times.
        memory = Memory(replace(features, history=1, shrink=1))  # frames were shrunk when recorded
        moments = [shown for drive in drives for shown in _relived(drive, memory)]
        self._shown = {name: np.stack([moment[name] for moment in moments]) for name in features.inputs}
        self._starts = np.cumsum([0, *(len(drive) for drive in drives)])

    def __len__(self) -> int:
        return len(self.drives)

    def batch(self, chosen: Any) -> Batch:
        """Return the drives with these indices."""
        drives = [self.drives[index] for index in chosen]
        lengths = np.array([len(drive) for drive in drives])
        rows = np.repeat(np.arange(len(drives)), lengths)
        columns = np.concatenate([np.arange(length) for length in lengths])
        starts = self._starts[np.asarray(chosen)][rows]
        shown = {name: self._with_history(name, columns, starts) for name in self._shown}

        def laid_out(name: str) -> torch.Tensor:
            told = np.concatenate([getattr(drive, name) for drive in drives])
            table = np.zeros((len(drives), lengths.max()), told.dtype)
            table[rows, columns] = told
            return torch.from_numpy(table)

        valid = torch.zeros(len(drives), int(lengths.max()))
        place = (torch.from_numpy(rows), torch.from_numpy(columns))
        valid[place] = 1.0
        threats = torch.tensor([drive.threat for drive in drives])
        tables = (laid_out("rewards"), laid_out("returns"), valid, laid_out("contacts"))
        return Batch(shown, place, *tables, threats)

    def _with_history(self, name: str, columns: np.ndarray, starts: np.ndarray) -> torch.Tensor:
        back = range(self._features.history - 1, -1, -1)
        parts = [self._shown[name][starts + np.maximum(columns - steps, 0)] for steps in back]
        joined = np.concatenate(parts, axis=-1)
        return torch.from_numpy(np.moveaxis(joined, -1, 1).copy() if name == FRAME else joined)


def _relived(drive: Drive, memory: Memory) -> Iterator[dict[str, np.ndarray]]:
    memory.clear()
    repeat = memory.features.repeat
    for decision in range(len(drive)):
        for moment in range(max((decision - 1) * repeat + 1, 0), decision * repeat + 1):
            observation = {name: array[moment] for name, array in drive.seen.items()}
            if drive.frames is not None:
                observation[FRAME] = drive.frames[decision]
            memory.see(observation)
        yield memory.tell()
