# pyright: standard
# Not strict: joblib states few types.
"""Execution of tasks in this process, in worker processes or on a Dask cluster, through joblib."""

import logging
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import chain
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING, Any, TypeVar

from lgmd_gym._version import __version__
from lgmd_gym.aliases import Arguments
from lgmd_gym.errors import check_text, check_whole
from lgmd_gym.processes.extras import missing_extra

if TYPE_CHECKING:
    from joblib import Parallel

INTERVAL = 0.5  # [s] between two looks at the parent


def worker_options() -> Arguments:
    """Return options of `joblib.Parallel` for worker processes that end with this process.

    Joblib's resource tracker removes their shared memory once all of them have ended.
    """
    return {"initializer": watch_parent, "initargs": (os.getpid(),)}


@contextmanager
def signals_blocked() -> Generator[None, None, None]:
    """Block SIGINT and SIGTERM while worker processes start, which inherit the block.

    This process receives a signal at the end of the block. A terminal sends Ctrl-C to all processes, and some
    schedulers send SIGTERM to all; workers would end with tracebacks before this process stops them.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    # Joblib starts this with the first worker, and its start unblocks both signals.
    resource_tracker.ensure_running()
    previous = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous)


def run_parallel(calls: Iterable[object], jobs: int) -> Iterator[Any]:
    """Run calls in `jobs` worker processes and return their results in order, as they finish.

    Args:
        calls: Calls made with `joblib.delayed`.
        jobs: Number of processes; 1 for this process.
    """
    from joblib import Parallel

    parallel: Any = Parallel(n_jobs=jobs, return_as="generator", **worker_options())
    with signals_blocked():
        return parallel(calls)


def end_workers() -> None:
    """End idle worker processes at once; joblib otherwise waits for them at the end of this process."""
    loky = sys.modules.get("joblib.externals.loky.reusable_executor")
    executor: Any = getattr(loky, "_executor", None)
    if executor is not None:
        executor.shutdown(wait=True, kill_workers=True)


def watch_parent(parent: int) -> None:
    """End this process soon after its parent process; a parent killed by SIGKILL cannot end it."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(INTERVAL)
        os._exit(1)

    threading.Thread(target=watch, daemon=True, name="watch-parent").start()


CONNECT = 5.0  # [s] limit for reaching the scheduler
WORKERS = 10.0  # [s] limit for the first worker
MAX_JOBS = 1024


class PoolLostError(RuntimeError):
    """Raised when the workers are lost, and with them their unfinished tasks."""


_Task = TypeVar("_Task")
_Result = TypeVar("_Result")


class TaskMap:
    """Maps a function over tasks and yields the results as they finish.

    Args:
        parallel: The workers.
        workers: Number of workers; 1 for this process.
    """

    def __init__(self, parallel: "Parallel", workers: int) -> None:
        self._parallel, self.workers = parallel, workers

    def __call__(self, function: Callable[[_Task], _Result], tasks: Iterable[_Task]) -> Iterator[_Result]:
        """Yield the results of `function`, which other processes import by name."""
        from joblib import delayed

        with signals_blocked():  # the call starts the workers
            results: Any = self._parallel(delayed(function)(task) for task in tasks)
        yield from results

    def flatten(
        self, function: Callable[[_Task], Iterator[_Result]], tasks: Iterable[_Task]
    ) -> Iterator[_Result]:
        """Yield every item of the iterators that `function` returns.

        Items arrive one by one from this process, and the items of a task together from other processes.
        """
        if self.workers == 1:
            yield from chain.from_iterable(map(function, tasks))
        else:
            yield from chain.from_iterable(self(partial(_collect, function), tasks))


def _collect(function: Callable[[_Task], Iterator[_Result]], task: _Task) -> list[_Result]:
    return list(function(task))


@dataclass(frozen=True, slots=True)
class Executor:
    """Where tasks run: in this process, in worker processes or on a Dask cluster.

    Attributes:
        jobs: Number of processes; 1 runs in this process. A cluster uses all of its workers instead.
        cluster: Address of a Dask scheduler, such as "tcp://10.0.0.1:8786"; None for this machine.

    Raises:
        ValueError: If `jobs` is below 1.
    """

    jobs: int = 1
    cluster: str | None = None

    def __post_init__(self) -> None:
        check_whole("jobs", self.jobs, 1, MAX_JOBS)
        if self.cluster is not None:
            check_text("cluster", self.cluster)

    def check(self) -> None:
        """Check that the cluster, if any, is reachable and has workers with this version of the package.

        Raises:
            ValueError: If it is not, within seconds.
        """
        if self.cluster is None:
            return
        with closing(_connect(self.cluster)) as client:
            try:
                client.wait_for_workers(1, timeout=WORKERS)
            except TimeoutError:
                raise ValueError(
                    f"cluster {self.cluster} has no worker; start some with `dask worker {self.cluster}`"
                ) from None
            for worker, version in client.run(_installed_version).items():
                if version != __version__:
                    raise ValueError(
                        f"worker {worker} has lgmd-gym {version}, this is {__version__}; "
                        "install the same version"
                    )

    @contextmanager
    def open(self) -> Generator[TaskMap, None, None]:
        """Yield a function that maps a function over tasks and yields results as they finish.

        Raises:
            PoolLostError: If a worker process or the cluster dies.
            ValueError: If the cluster cannot be reached.
        """
        with _local(self.jobs) if self.cluster is None else _dask(self.cluster) as task_map:
            yield task_map


def _installed_version() -> str:
    return __version__


SERIAL = Executor()


@contextmanager
def _local(jobs: int) -> Generator[TaskMap, None, None]:
    from joblib import Parallel

    # joblib replaces a worker that has grown by 300 MB, as it does by loading PyTorch, and warns of a leak.
    warnings.filterwarnings("ignore", "A worker stopped while some jobs", UserWarning)
    # Interrupted runs say themselves how many episodes they keep.
    warnings.filterwarnings("ignore", r"\d+ tasks which were still being processed", UserWarning)
    try:
        with Parallel(n_jobs=jobs, return_as="generator_unordered", **worker_options()) as parallel:
            yield TaskMap(parallel, jobs)
    except BrokenProcessPool:
        raise PoolLostError("a worker process was killed (possibly out of memory)") from None


@contextmanager
def _dask(address: str) -> Generator[TaskMap, None, None]:
    from distributed.client import FutureCancelledError
    from distributed.comm.core import CommClosedError
    from joblib import Parallel, parallel_config

    with closing(_connect(address)) as client:
        try:
            with (
                parallel_config(backend="dask", client=client),
                Parallel(n_jobs=-1, return_as="generator_unordered") as parallel,
            ):
                # At least 2, because the workers are other processes.
                yield TaskMap(parallel, max(sum(client.ncores().values()), 2))
        except (CommClosedError, FutureCancelledError) as error:
            reason = str(error).splitlines()[0]
            raise PoolLostError(f"the cluster at {address} is lost: {reason}") from None


def _connect(address: str) -> Any:
    """Return a client of a Dask scheduler."""
    try:
        from distributed import Client
    except ImportError:
        raise missing_extra("a Dask cluster", "cluster") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # hide long tracebacks
    try:
        return Client(address, timeout=CONNECT, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        reason = str(error).split("\n")[0]
        raise ValueError(
            f"no Dask scheduler at {address!r} ({reason}); start one with `dask scheduler` and pass "
            "--address tcp://HOST:8786"
        ) from None
