"""Outcome of braking at each decision of an episode, from as few replays as possible."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

STRIDE = 12  # largest distance of two replays [decisions], 0.4 s at 30 Hz
TOLERANCE = 0.05  # largest deviation of a replayed return from the linear interpolation


@dataclass(frozen=True, slots=True)
class BrakingOutcome:
    """Outcome of braking from one decision on.

    Attributes:
        episode_return: Sum of the environment's rewards from that decision on.
        contact: Whether the episode ends in a contact.
    """

    episode_return: float
    contact: bool


def braking_outcomes(length: int, replay: Callable[[int], BrakingOutcome]) -> list[BrakingOutcome]:
    """Return the outcome of braking at each of `length` decisions.

    Every twelfth decision is replayed, and the midpoint of each interval between two of them. If the return
    at the midpoint deviates from the linear interpolation by more than 0.05, or the three outcomes differ in
    contact, both halves are refined in the same way. Otherwise the interval is interpolated. The first
    decision from which braking no longer avoids a contact is exact.

    Args:
        length: Number of decisions, >= 1.
        replay: Returns the outcome of braking at a decision; called once per decision at most.
    """
    grid = [*range(0, length - 1, STRIDE), length - 1]
    known = {onset: replay(onset) for onset in grid}
    for first, last in pairwise(grid):
        _refine(first, last, known, replay)
    return [known[onset] for onset in range(length)]


def _refine(
    first: int, last: int, known: dict[int, BrakingOutcome], replay: Callable[[int], BrakingOutcome]
) -> None:
    """Add the outcomes of the decisions between two known ones."""
    inner = range(first + 1, last)
    if not inner:
        return
    middle = (first + last) // 2
    low, mid, high = known[first], replay(middle), known[last]
    known[middle] = mid
    slope = (high.episode_return - low.episode_return) / (last - first)
    deviation = abs(mid.episode_return - low.episode_return - slope * (middle - first))
    if deviation <= TOLERANCE and low.contact == mid.contact == high.contact:
        for onset in inner:
            interpolated = low.episode_return + slope * (onset - first)
            known.setdefault(onset, BrakingOutcome(interpolated, low.contact))
    else:
        _refine(first, middle, known, replay)
        _refine(middle, last, known, replay)
