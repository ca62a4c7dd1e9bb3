"""Options of `doctor`; attribute docstrings are the help texts."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Doctor:
    """Check package versions, numba's cache, the video codec and the display, and simulate for two seconds.

    The exit code is 1 if a check finds a fault; the output suggests a fix.
    """
