"""Peak memory of a process."""

import re
from pathlib import Path


def peak_memory():
    """Return the peak memory of this process so far [MiB].

    The maximum of `getrusage` includes the memory of the parent process at the start of this one.
    """
    return int(re.search(r"VmHWM:\s+(\d+)", Path("/proc/self/status").read_text())[1]) / 1024
