"""Outcome of braking at each decision of an episode, from as few replays as possible."""

from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

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


Rounds: TypeAlias = Generator[list[int], Iterable[BrakingOutcome], list[BrakingOutcome]]
"""Yields decisions to replay, receives their outcomes, and returns the outcome of every decision."""


def braking_outcomes(length: int, replay: Callable[[int], BrakingOutcome]) -> list[BrakingOutcome]:
    """Return the outcome of braking at each of `length` decisions.

    Every twelfth decision is replayed, and the midpoint of each interval between two of them. If the return
    at the midpoint deviates from the linear interpolation by more than 0.05, or the three outcomes differ in
    contact, both halves are refined in the same way. Otherwise the interval is interpolated. Where contacts
    change once with the decision, that decision is exact; two changes between neighbouring replays, at most
    six decisions apart, are not noticed.

    Args:
        length: Number of decisions, >= 1.
        replay: Returns the outcome of braking at a decision; called once per decision at most.
    """
    (outcomes,) = batch_outcomes([length], lambda pairs: [replay(onset) for _, onset in pairs])
    return outcomes


def batch_outcomes(
    lengths: Sequence[int], replay: Callable[[list[tuple[int, int]]], Iterable[BrakingOutcome]]
) -> list[list[BrakingOutcome]]:
    """Return the results of `braking_outcomes` for several episodes, with few calls of `replay`.

    Args:
        lengths: Number of decisions of each episode, >= 1.
        replay: Returns the outcomes of braking for pairs of an episode's index and a decision.
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
        refined = []
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
