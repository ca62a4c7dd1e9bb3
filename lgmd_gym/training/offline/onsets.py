"""What braking would have brought at each decision of a drive, told by as few replays as will do."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

STRIDE = 12  # decisions between two replays at least: 0.4 s at 30 Hz
STRAIGHT = 0.05  # return by which a replay may differ from the line through its neighbours


@dataclass(frozen=True, slots=True)
class Outcome:
    """What braking from some decision on comes to.

    Attributes:
        ret: Return from there on, in the environment's own rewards.
        contact: Whether it ends in a contact.
    """

    ret: float
    contact: bool


def outcomes(length: int, replay: Callable[[int], Outcome]) -> list[Outcome]:
    """Return the outcome of braking at each of `length` decisions.

    Every twelfth decision is replayed, and the middle of two of these. Where it lies off the line through
    them by more than 0.05, or they differ in contact, both halves are looked at in the same way; else all
    between them lie on that line, a little off. A decision from which on contacts are no longer avoided is
    found exactly.

    Args:
        length: Number of decisions, >= 1.
        replay: Plays a drive that brakes at a decision; called once for each.
    """
    grid = [*range(0, length - 1, STRIDE), length - 1]
    known = {onset: replay(onset) for onset in grid}
    for first, last in pairwise(grid):
        _fill(first, last, known, replay)
    return [known[onset] for onset in range(length)]


def _fill(first: int, last: int, known: dict[int, Outcome], replay: Callable[[int], Outcome]) -> None:
    """Find the outcomes of the decisions between two whose outcomes are known."""
    inner = range(first + 1, last)
    if not inner:
        return
    middle = (first + last) // 2
    low, half, high = known[first], replay(middle), known[last]
    known[middle] = half
    rise = (high.ret - low.ret) / (last - first)
    straight = abs(half.ret - low.ret - rise * (middle - first)) <= STRAIGHT
    if straight and low.contact == half.contact == high.contact:
        for onset in inner:
            known.setdefault(onset, Outcome(low.ret + rise * (onset - first), low.contact))
    else:
        _fill(first, middle, known, replay)
        _fill(middle, last, known, replay)
