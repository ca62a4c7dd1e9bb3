"""Where episodes are played: in this process, in processes beside it, or on a Dask cluster; all by joblib."""

import contextlib
import logging
import threading
import time
import warnings
from _thread import interrupt_main
from collections.abc import Iterator
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from joblib import Parallel, parallel_config

from lgmd_gym._version import __version__

CONNECT = 5.0  # [s] to reach the scheduler
WORKERS = 10.0  # [s] to wait for a first worker
PATIENCE = 20.0  # [s] without scheduler or without a worker, after which a cluster counts as lost


class PoolLostError(RuntimeError):
    """The workers are gone; what was in flight is lost, all else is kept."""


@contextlib.contextmanager
def open_pool(jobs: int, cluster: str | None = None) -> Iterator[Parallel]:
    """Yield a `joblib.Parallel` whose results come as they finish.

    Args:
        jobs: Processes; 1 plays in this one. On a cluster its workers decide.
        cluster: Address of a Dask scheduler, such as "tcp://10.0.0.1:8786"; None for this machine.

    Raises:
        PoolLostError: If a worker process or the cluster dies.
        ValueError: If the cluster cannot be reached.
    """
    if cluster is None:
        # joblib replaces a worker that has grown by 300 MB, as by PyTorch for a policy, and warns of a leak.
        warnings.filterwarnings("ignore", "A worker stopped while some jobs", UserWarning)
        try:
            with Parallel(n_jobs=jobs, return_as="generator_unordered") as parallel:
                yield parallel
        except BrokenProcessPool:
            raise PoolLostError("a worker process was killed (is memory short?)") from None
        return
    with contextlib.closing(_connect(cluster)) as client, _Watch(client) as watch:
        try:
            with (
                parallel_config(backend="dask", client=client),
                Parallel(n_jobs=-1, return_as="generator_unordered") as parallel,
            ):
                yield parallel
        except KeyboardInterrupt:
            if watch.lost:
                raise PoolLostError(f"the cluster at {cluster} is lost: {watch.lost}") from None
            raise
        except _lost_errors() as error:
            why = str(error).splitlines()[0]
            raise PoolLostError(f"the cluster at {cluster} is lost: {why}") from None


def check_pool(jobs: int, cluster: str | None) -> None:
    """Refuse a number of processes below 1, and a cluster that cannot play.

    Raises:
        ValueError: Within seconds, if the cluster cannot be reached, has no worker, or its workers lack this
            package or have it in another version.
    """
    if jobs < 1:
        raise ValueError(f"jobs must be >= 1, got {jobs!r}")
    if cluster is None:
        return
    with contextlib.closing(_connect(cluster)) as client:
        _check_workers(client, cluster)


def _connect(address: str) -> Any:
    """Return a client of a Dask scheduler."""
    try:
        from distributed import Client
    except ImportError:
        raise ValueError("a Dask cluster needs dask; pip install 'lgmd-gym[cluster]'") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # its tracebacks of a lost cluster fill pages
    try:
        return Client(address, timeout=CONNECT, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        why = str(error).split("\n")[0]
        raise ValueError(
            f"no Dask scheduler answers at {address!r} ({why}); start one with `dask scheduler` and give "
            "--address tcp://HOST:8786"
        ) from None


def _lost_errors() -> tuple[type[BaseException], ...]:
    """Return what Dask raises when a cluster goes; episodes themselves raise nothing, they become rows."""
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
        versions = client.run(_installed)
    except Exception as error:
        raise ValueError(
            f"a worker of {address} cannot import lgmd_gym ({error}); install it there"
        ) from None
    for worker, version in versions.items():
        if version != __version__:
            raise ValueError(
                f"worker {worker} has lgmd-gym {version}, this is {__version__}; make them equal"
            )


def _installed() -> str:
    """Return the version of this package where it is called."""
    return __version__


class _Watch:
    """Interrupts the main thread once a cluster is lost: joblib would wait for its results for ever.

    Attributes:
        lost: What happened; "" for nothing.
    """

    def __init__(self, client: Any) -> None:
        self.client, self.lost = client, ""
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._look, daemon=True)

    def __enter__(self) -> "_Watch":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _look(self) -> None:
        good = time.monotonic()
        while not self._stop.wait(0.5):
            trouble = self._trouble()
            if not trouble:
                good = time.monotonic()
            elif time.monotonic() - good > PATIENCE or trouble == "a task killed worker after worker":
                self.lost = trouble
                interrupt_main()
                return

    def _trouble(self) -> str:
        if self.client.status != "running":
            return "its scheduler does not answer"
        # Episodes turn exceptions into rows, so that Dask's own verdict on a task is all that is left.
        if any(future.status == "error" for future in list(self.client.futures.values())):
            return "a task killed worker after worker"
        try:
            return "" if self.client.ncores() else "it has no worker left"
        except Exception:
            return "its scheduler does not answer"
