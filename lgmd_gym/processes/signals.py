"""SIGINT (Ctrl-C) and SIGTERM for the command `lgmd-gym`: one line and an exit code, no traceback."""

import os
import signal
import sys
from collections.abc import Generator
from contextlib import contextmanager
from threading import Timer, current_thread, main_thread
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)
REPEAT_S = 0.05  # time after which a lost signal is repeated


class Interruption:
    """The last signal that interrupted the command.

    Attributes:
        number: Number of the signal; 0 before any.
    """

    number = 0

    def handle(self, number: int, frame: FrameType | None) -> None:
        """Raise KeyboardInterrupt in the main thread."""
        self.number = number
        raise KeyboardInterrupt

    def repeat(self, error: "sys.UnraisableHookArgs") -> None:
        """Repeat the signal if KeyboardInterrupt was raised where it cannot end the command.

        Such places are callbacks of C libraries, for example while kernels are loaded.
        """
        if isinstance(error.exc_value, KeyboardInterrupt) and self.number:
            Timer(REPEAT_S, os.kill, (os.getpid(), self.number)).start()
        else:
            sys.__unraisablehook__(error)

    @property
    def exit_code(self) -> int:
        """Exit code by the convention of shells: 130 for Ctrl-C, 143 for SIGTERM."""
        return 128 + (self.number or signal.SIGINT)


@contextmanager
def raise_on_signals() -> Generator[Interruption, None, None]:
    """Turn signals into KeyboardInterrupt, so that a command keeps what is finished.

    Signals that the parent process ignores, as `nohup` does, stay ignored.
    """
    interruption = Interruption()
    if current_thread() is not main_thread():  # only the main thread may set handlers
        yield interruption
        return
    previous, hook = {number: signal.getsignal(number) for number in SIGNALS}, sys.unraisablehook
    for number in SIGNALS:
        _set(number, interruption.handle)
    sys.unraisablehook = interruption.repeat
    try:
        yield interruption
    finally:
        sys.unraisablehook = hook
        for number, handler in previous.items():
            signal.signal(number, handler)


def exit_on_signals() -> None:
    """End this process at a signal until `raise_on_signals`: during imports, there is nothing to keep."""
    for number in SIGNALS:
        _set(number, _exit)


def _set(number: int, handler: object) -> None:
    if signal.getsignal(number) is not signal.SIG_IGN:
        signal.signal(number, handler)  # type: ignore[arg-type]


def _exit(number: int, frame: FrameType | None) -> None:
    os.write(2, b"lgmd-gym: interrupted\n")
    os._exit(128 + number)
