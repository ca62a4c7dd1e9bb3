"""Execution of tasks in this process, in worker processes or on a Dask cluster, through joblib."""

import contextlib
import logging
import threading
import time
import warnings
from _thread import interrupt_main
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, Any

from lgmd_gym._version import __version__
from lgmd_gym.errors import check_text, check_whole
from lgmd_gym.processes.extras import missing_extra
from lgmd_gym.processes.worker_processes import signals_blocked, worker_options

if TYPE_CHECKING:
    from joblib import Parallel

CONNECT = 5.0  # [s] limit for reaching the scheduler
WORKERS = 10.0  # [s] limit for the first worker
PATIENCE = 20.0  # [s] without scheduler or worker after which a cluster counts as lost
MAX_JOBS = 1024
KILLED = "a task killed worker after worker"


class PoolLostError(RuntimeError):
    """Raised when the workers are lost, and with them their unfinished tasks."""


class TaskMap:
    """Maps a function over tasks and yields the results as they finish.

    Args:
        parallel: The workers.
        workers: Number of workers; 1 for this process.
    """

    def __init__(self, parallel: "Parallel", workers: int) -> None:
        self._parallel, self.workers = parallel, workers

    def __call__(self, function: Callable[[Any], Any], tasks: Iterable[Any]) -> Iterator[Any]:
        """Yield the results of `function`, which other processes import by name."""
        from joblib import delayed

        with signals_blocked():  # the call starts the workers
            results = self._parallel(delayed(function)(task) for task in tasks)
        yield from results  # type: ignore[misc]

    def flatten(self, function: Callable[[Any], Iterator[Any]], tasks: Iterable[Any]) -> Iterator[Any]:
        """Yield every item of the iterators that `function` returns.

        Items arrive one by one from this process, and the items of a task together from other processes.
        """
        if self.workers == 1:
            yield from chain.from_iterable(map(function, tasks))
        else:
            yield from chain.from_iterable(self(partial(_collect, function), tasks))


def _collect(function: Callable[[Any], Iterator[Any]], task: Any) -> list[Any]:
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
        if self.cluster is not None:
            with contextlib.closing(_connect(self.cluster)) as client:
                _check_workers(client, self.cluster)

    @contextlib.contextmanager
    def open(self) -> Iterator[TaskMap]:
        """Yield a function that maps a function over tasks and yields results as they finish.

        Raises:
            PoolLostError: If a worker process or the cluster dies.
            ValueError: If the cluster cannot be reached.
        """
        with _local(self.jobs) if self.cluster is None else _dask(self.cluster) as task_map:
            yield task_map


SERIAL = Executor()


@contextlib.contextmanager
def _local(jobs: int) -> Iterator[TaskMap]:
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


@contextlib.contextmanager
def _dask(address: str) -> Iterator[TaskMap]:
    from joblib import Parallel, parallel_config

    with contextlib.closing(_connect(address)) as client, _ClusterMonitor(client) as monitor:
        try:
            with (
                parallel_config(backend="dask", client=client),
                Parallel(n_jobs=-1, return_as="generator_unordered") as parallel,
            ):
                # At least 2, because the workers are other processes.
                yield TaskMap(parallel, max(sum(client.ncores().values()), 2))
        except KeyboardInterrupt:
            if monitor.failure:
                raise PoolLostError(f"the cluster at {address} is lost: {monitor.failure}") from None
            raise
        except _lost_errors() as error:
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


def _lost_errors() -> tuple[type[BaseException], ...]:
    """Return the exception types that indicate a lost cluster."""
    from distributed.client import FutureCancelledError
    from distributed.comm.core import CommClosedError
    from distributed.scheduler import KilledWorker

    return CommClosedError, FutureCancelledError, KilledWorker


def _check_workers(client: Any, address: str) -> None:
    end = time.monotonic() + WORKERS
    while not client.ncores():
        if time.monotonic() > end:
            raise ValueError(f"cluster {address} has no worker; start some with `dask worker {address}`")
        time.sleep(0.1)
    try:
        versions = client.run(_installed_version)
    except Exception as error:
        raise ValueError(
            f"a worker of {address} cannot import lgmd_gym ({error}); install it there"
        ) from None
    for worker, version in versions.items():
        if version != __version__:
            raise ValueError(
                f"worker {worker} has lgmd-gym {version}, this is {__version__}; install the same version"
            )


def _installed_version() -> str:
    return __version__


class _ClusterMonitor:
    """Interrupts the main thread once a cluster is lost, because joblib would wait for results forever.

    Attributes:
        failure: Reason why the cluster was lost; "" if it is not.
    """

    def __init__(self, client: Any) -> None:
        self.client, self.failure = client, ""
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> "_ClusterMonitor":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _watch(self) -> None:
        last_good = time.monotonic()
        while not self._stop.wait(0.5):
            failure = self._failure()
            if not failure:
                last_good = time.monotonic()
            elif time.monotonic() - last_good > PATIENCE or failure == KILLED:
                self.failure = failure
                interrupt_main()
                return

    def _failure(self) -> str:
        """Return the present fault of the cluster, or "" if there is none."""
        if self.client.status != "running":
            return "its scheduler does not respond"
        # Tasks turn exceptions into rows, so only Dask itself sets this status.
        if any(future.status == "error" for future in list(self.client.futures.values())):
            return KILLED
        try:
            return "" if self.client.ncores() else "it has no worker left"
        except Exception:
            return "its scheduler does not respond"
