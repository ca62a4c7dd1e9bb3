"""Progress of numba's compilation on stderr: the first use of a kernel on a machine takes a while.

Compilations of less than `DELAY_S` are silent, and all are if the variable LGMD_GYM_QUIET is set. Of several
worker processes one prints its progress. There is no thread, because the process may fork.
"""

import contextlib
import os
import sys
import tempfile
import time
from collections.abc import Generator
from multiprocessing import current_process
from typing import Any

from numba.core import event

try:
    import fcntl
except ImportError:  # Windows, where only the main process prints
    fcntl = None  # type: ignore[assignment]

VARIABLE = "LGMD_GYM_QUIET"
DELAY_S = 2.0  # compilation without a line
REPEAT_S = 10.0  # compilation between two lines in a file, a pipe or a worker process
REFRESH_S = 0.2  # time between two updates of the line in a terminal
PAUSE_S = 30.0  # time without compilation after which the next one counts as new
START = "compiling kernels for their first use, about half a minute; later runs load them"


class CompilationReporter(event.Listener):
    """Prints how much numba has compiled, and in which time.

    A terminal has one line that is overwritten and erased in the end; a file gets a line every `REPEAT_S`.

    Attributes:
        expected: Number of functions that are compiled in all; 0 if it is not known.
        count: Number of functions compiled.
        seconds: Time spent on them [s].
    """

    def __init__(self) -> None:
        self._clock = time.monotonic
        self._depth = 0
        self._begin = self._end = self._printed = 0.0
        self._silent: bool | None = None  # None before the first line
        self.expected, self.count, self.seconds = 0, 0, 0.0

    def on_start(self, event: object) -> None:
        """Print the progress; the compilation of a called function is part of that of its caller."""
        now = self._clock()
        if self._depth == 0:
            if now - self._end > PAUSE_S:
                self.count, self.seconds, self._printed, self._silent = 0, 0.0, 0.0, None
            self._begin = now
        self._depth += 1
        seconds = self.seconds + now - self._begin
        if seconds >= DELAY_S:
            self._report(seconds)

    def on_end(self, event: Any) -> None:
        """Add the time of a compilation; erase the line in a terminal."""
        self._depth, self.count, self._end = self._depth - 1, self.count + 1, self._clock()
        if self._depth == 0:
            self.seconds += self._end - self._begin
            if self._printed and _is_terminal():
                self._write("", "\r")

    def _report(self, seconds: float) -> None:
        if self._silent is None:
            self._silent = bool(os.environ.get(VARIABLE)) or not _is_first_worker()
            self._write(START, "\r" if _is_terminal() else "\n")
            self._printed = seconds
        elif seconds - self._printed >= (REFRESH_S if _is_terminal() else REPEAT_S):
            done = (
                f"{min(100 * self.count // self.expected, 99)} %"
                if self.expected
                else f"{self.count} functions"
            )
            text = f"compiling kernels for their first use: {done} in {seconds:.0f} s"
            self._write(text, "\r" if _is_terminal() else "\n")
            self._printed = seconds

    def _write(self, text: str, end: str = "\n") -> None:
        if not self._silent:
            erase = "\x1b[2K" if _is_terminal() else ""
            with contextlib.suppress(OSError, ValueError, AttributeError):  # closed, or no stderr
                sys.stderr.write(erase + (f"lgmd-gym: {text}" if text else "") + end)
                sys.stderr.flush()


def _is_terminal() -> bool:
    """Return whether the line can be overwritten: not in a worker, nor above a progress bar.

    A progress bar replaces sys.stderr.
    """
    stream = sys.stderr
    return stream is not None and stream is sys.__stderr__ and stream.isatty() and _is_main()


def _is_main() -> bool:
    return current_process().name == "MainProcess"


_lock: Any = None  # the open lock file of this worker


def _is_first_worker() -> bool:
    """Return whether this is the main process, or the first of this user's workers that compile now."""
    global _lock
    if _is_main():
        return True
    try:
        _lock = lock_of_user("compiling", wait=False)
    except OSError:
        return False
    return _lock is not None


def lock_of_user(name: str, *, wait: bool) -> int | None:
    """Return an open file that no other process of this user has locked; None without locks of files.

    Raises:
        OSError: If it cannot be opened, or another process has it and `wait` is false.
    """
    if fcntl is None:
        return None
    path = os.path.join(tempfile.gettempdir(), f"lgmd-gym-{name}-{os.getuid()}")
    lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(lock)
        raise
    return lock


_reporter: CompilationReporter | None = None


@contextlib.contextmanager
def expected_functions(number: int) -> Generator[None, None, None]:
    """State how many functions the block compiles, so that the progress is a percentage."""
    if _reporter is not None:
        _reporter.expected = number
    try:
        yield
    finally:
        if _reporter is not None:
            _reporter.expected = 0


def report_compilation() -> None:
    """Print the progress of compilations from now on; a second call has no effect."""
    global _reporter
    if _reporter is None:
        _reporter = CompilationReporter()
        event.register("numba:compile", _reporter)  # pyright: ignore[reportUnknownMemberType]
