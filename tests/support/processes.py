"""Commands that are stopped by signals, what they leave, and the peak memory of a process."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

TAG = "LGMD_GYM_TEST_RUN"  # environment variable that all processes of a command inherit
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGKILL: -9}
SHARED_MEMORY = "/dev/shm"


def start(arguments, tag, **options):
    """Start `lgmd-gym` in a session of its own; its processes inherit the variable TAG."""
    environment = os.environ | {TAG: tag} | options.pop("env", {})
    return subprocess.Popen(
        [sys.executable, "-m", "lgmd_gym", *map(str, arguments)],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # The children of a shell's background job ignore SIGINT by default.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        **options,
    )


def wait_for_rows(out, count, process):
    """Wait until a run folder has a number of rows; AssertionError if its command ends before."""
    file, end = out / "episodes.jsonl", time.monotonic() + 600
    while not file.exists() or file.read_bytes().count(b"\n") < count:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.02)


def processes(tag):
    """Return the running processes that have inherited a tag."""
    entry, found = f"{TAG}={tag}\0".encode(), []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if entry in (folder / "environ").read_bytes():
                found.append(int(folder.name))
        except OSError:
            continue
    return found


def segments(owners):
    """Return the shared memory that processes have made; its names contain their numbers."""
    numbers = re.compile(r"(?<![0-9a-f])\d+(?![0-9a-f])")
    names = os.listdir(SHARED_MEMORY)
    return [name for name in names if owners & {int(number) for number in numbers.findall(name)}]


def wait_until_gone(tag, owners, limit=15.0):
    """Wait until a command has left no process and no shared memory; AssertionError after `limit` [s].

    Args:
        tag: Tag of the command.
        owners: Numbers of its processes while it ran.
        limit: Time limit [s].
    """
    end = time.monotonic() + limit
    while left := processes(tag) + segments(owners):
        assert time.monotonic() < end, f"left after {limit:g} s: {left}"
        time.sleep(0.1)


def peak_memory():
    """Return the peak memory of this process so far [MiB].

    The maximum of `getrusage` includes the memory of the parent process at the start of this one.
    """
    return int(re.search(r"VmHWM:\s+(\d+)", Path("/proc/self/status").read_text())[1]) / 1024
