"""What braking would have brought at each decision of a drive, told by as few replays as will do."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

STRIDE = 4  # decisions between two replays at least
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

    Every fourth decision is replayed, and the middle of two as long as it lies off the line through them by
    more than 0.05 or they differ in contact; in between, returns lie on lines, a little off. The last
    decision that still avoids a contact is found exactly.

    Args:
        length: Number of decisions, >= 1.
        replay: Plays a drive that brakes at a decision.
    """
    found = _Found(replay)
    grid = [*range(0, length - 1, STRIDE), length - 1]
    for first, last in pairwise(grid):
        found.fill(first, last)
    return [found.at(onset) for onset in range(length)]


class _Found:
    """Outcomes by decision, replayed or put on a line."""

    def __init__(self, replay: Callable[[int], Outcome]) -> None:
        self._replay = replay
        self._known: dict[int, Outcome] = {}

    def at(self, onset: int) -> Outcome:
        if onset not in self._known:
            self._known[onset] = self._replay(onset)
        return self._known[onset]

    def fill(self, first: int, last: int) -> None:
        """Find all between two decisions."""
        if last - first < 2:
            return
        low, high, middle = self.at(first), self.at(last), (first + last) // 2
        half = self.at(middle)
        rise = (high.ret - low.ret) / (last - first)
        straight = abs(half.ret - low.ret - rise * (middle - first)) <= STRAIGHT
        if straight and low.contact == half.contact == high.contact:
            for onset in range(first + 1, last):
                line = Outcome(low.ret + rise * (onset - first), low.contact)
                self._known.setdefault(onset, line)
            return
        self.fill(first, middle)
        self.fill(middle, last)
