"""Recorded drives as batches to learn from: what a policy would be shown, and what braking brings."""

from typing import Any, NamedTuple

import numpy as np
import torch

from lgmd_gym.agents.features import FRAME, Features, Memory
from lgmd_gym.training.drives import Drive


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

    A policy that decides at every third decision of the environment may begin with the first, the second or
    the third: each drive is as many lessons.

    Args:
        drives: At least one.
        features: Of the policy.
        starts: Decisions of the environment at which a policy may begin; None for as many as one of its own
            holds for.
    """

    def __init__(self, drives: list[Drive], features: Features, starts: int | None = None) -> None:
        self.drives, self._features = drives, features
        self.starts = min(features.repeat if starts is None else starts, *(len(drive) for drive in drives))
        self._first = np.cumsum([0, *(len(drive) for drive in drives)])
        self._shown = self._relived()

    def __len__(self) -> int:
        return len(self.drives)

    def _relived(self) -> dict[str, np.ndarray]:
        """Return what is shown at each decision of the environment, if it is one of the policy's."""
        signals = tuple(name for name in self._features.inputs if name != FRAME)
        shown = {}
        if FRAME in self._features.inputs:
            shown[FRAME] = np.concatenate([drive.frames for drive in self.drives if drive.frames is not None])
        if signals:
            # History is put together batch by batch: kept here, all would be there six times.
            memory = Memory(Features(signals, history=1, repeat=self._features.repeat))
            for first, drive in zip(self._first, self.drives, strict=False):
                for start in range(self.starts):
                    self._relive(drive, start, memory, shown, first)
        return shown

    def _relive(
        self, drive: Drive, start: int, memory: Memory, shown: dict[str, np.ndarray], first: int
    ) -> None:
        memory.clear()
        for moment in range(start, len(drive)):
            memory.see({name: array[moment] for name, array in drive.seen.items()})
            if (moment - start) % self._features.repeat == 0:
                for name, told in memory.tell().items():
                    if name not in shown:
                        shown[name] = np.zeros((self._first[-1], *told.shape), told.dtype)
                    shown[name][first + moment] = told

    def batch(self, chosen: Any, starts: Any = 0) -> Batch:
        """Return the drives with these indices, from these starts on (one for all, or one each)."""
        repeat = self._features.repeat
        starts = np.broadcast_to(starts, len(chosen))
        drives = [self.drives[index] for index in chosen]
        moments = [np.arange(start, len(d), repeat) for d, start in zip(drives, starts, strict=True)]
        lengths = np.array([len(some) for some in moments])
        rows, columns = np.repeat(np.arange(len(drives)), lengths), _counted(lengths)
        first = (self._first[np.asarray(chosen)] + starts)[rows]
        shown = {name: self._with_history(name, columns, first) for name in self._shown}

        def laid_out(told: list[np.ndarray]) -> torch.Tensor:
            table = np.zeros((len(drives), lengths.max()), told[0].dtype)
            table[rows, columns] = np.concatenate(told)
            return torch.from_numpy(table)

        pairs = list(zip(drives, moments, strict=True))
        return Batch(
            shown,
            (torch.from_numpy(rows), torch.from_numpy(columns)),
            rewards=laid_out([np.add.reduceat(drive.rewards, at) for drive, at in pairs]),
            returns=laid_out([drive.returns[at] for drive, at in pairs]),
            valid=laid_out([np.ones(len(at), np.float32) for at in moments]),
            contacts=laid_out([drive.contacts[at] for drive, at in pairs]),
            threats=torch.tensor([drive.threat for drive in drives]),
        )

    def _with_history(self, name: str, columns: np.ndarray, first: np.ndarray) -> torch.Tensor:
        back = range(self._features.history - 1, -1, -1)
        at = [first + self._features.repeat * np.maximum(columns - steps, 0) for steps in back]
        joined = np.concatenate([self._shown[name][moments] for moments in at], axis=-1)
        return torch.from_numpy(np.moveaxis(joined, -1, 1).copy() if name == FRAME else joined)


def _counted(lengths: np.ndarray) -> np.ndarray:
    """Return 0, 1, ... up to each of the lengths, one after another."""
    return np.concatenate([np.arange(length) for length in lengths])
