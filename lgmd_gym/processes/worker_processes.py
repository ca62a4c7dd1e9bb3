"""Worker processes of joblib: they end with their parent, and leave signals to it."""

import os
import signal
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from typing import Any

INTERVAL = 0.5  # [s] between two looks at the parent


def worker_options() -> dict[str, Any]:
    """Return options of `joblib.Parallel` for worker processes that end with this process.

    Joblib's resource tracker removes their shared memory once all of them have ended.
    """
    return {"initializer": _watch_parent, "initargs": (os.getpid(),)}


@contextmanager
def signals_blocked() -> Iterator[None]:
    """Block SIGINT and SIGTERM while worker processes start, which inherit the block.

    This process receives a signal at the end of the block. A terminal sends Ctrl-C to all processes, and some
    schedulers send SIGTERM to all; workers would end with tracebacks before this process stops them.
    """
    # Joblib starts this with the first worker, and its start unblocks both signals.
    resource_tracker.ensure_running()
    previous = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous)


def run_parallel(calls: Iterable[Any], jobs: int) -> Iterator[Any]:
    """Run calls in `jobs` worker processes and return their results in order, as they finish.

    Args:
        calls: Calls made with `joblib.delayed`.
        jobs: Number of processes; 1 for this process.
    """
    from joblib import Parallel

    parallel: Any = Parallel(n_jobs=jobs, return_as="generator", **worker_options())
    with signals_blocked():
        return parallel(calls)


def _watch_parent(parent: int) -> None:
    """End this process soon after its parent process; a parent killed by SIGKILL cannot end it."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(INTERVAL)
        os._exit(1)

    threading.Thread(target=watch, daemon=True, name="watch-parent").start()
