"""Score of the mutation test."""

import json
import sys
import time
from collections import Counter
from typing import NamedTuple, TextIO

from mutants import Mutant

GOAL = 0.9  # share of the mutants that the tests must notice


class Task(NamedTuple):
    """One mutant of one source."""

    module: str
    source: str
    mutant: Mutant


class Score:
    """Counts of outcomes; prints them as they come.

    Args:
        total: Number of mutants to play.
        file: Gets one JSON object per mutant as soon as its outcome is known.
    """

    def __init__(self, total: int, file: TextIO) -> None:
        self.total, self.file, self.begin = total, file, time.monotonic()
        self.played: Counter[str] = Counter()
        self.killed: Counter[str] = Counter()

    def add(self, task: Task, outcome: str) -> None:
        """Count a mutant, and print its place and its change if no failed test killed it."""
        mutant = task.mutant
        self.played[task.module] += 1
        self.killed[task.module] += outcome != "survived"
        place = {"module": task.module, "source": task.source, "line": mutant.line}
        change = {"before": mutant.before, "after": mutant.after, "outcome": outcome}
        print(json.dumps(place | change), file=self.file, flush=True)
        if outcome != "killed":
            self._clear_line()
            lines = f"{task.source}:{mutant.line}", f"  - {mutant.before}", f"  + {mutant.after}"
            print(f"{outcome} ", "\n".join(lines), flush=True)
        self._show_progress()

    def _show_progress(self) -> None:
        """Print the partial score: in one line of a terminal, otherwise after every 20 mutants."""
        if sys.stderr.isatty():
            self._clear_line()
            print(self, end="", file=sys.stderr, flush=True)
        elif self.played.total() % 20 == 0:
            print(self, file=sys.stderr, flush=True)

    def _clear_line(self) -> None:
        """Remove the partial score from a terminal."""
        if sys.stderr.isatty():
            print("\r\033[K", end="", file=sys.stderr, flush=True)

    def show_result(self) -> None:
        """Print the score of each module and of all."""
        self._clear_line()
        for name, played in sorted(self.played.items()):
            print(f"{name:12} {self.killed[name]:4} of {played:4} killed")
        print(self)

    @property
    def reaches_goal(self) -> bool:
        """Whether all mutants were played and enough of them killed."""
        return self.played.total() == self.total and self.killed.total() >= GOAL * self.total

    def __str__(self) -> str:
        """Return the score so far."""
        played, killed = self.played.total(), self.killed.total()
        score, minutes = killed / max(played, 1), (time.monotonic() - self.begin) / 60
        return f"{played} of {self.total} mutants played, {killed} killed ({score:.1%}), {minutes:.1f} min"
