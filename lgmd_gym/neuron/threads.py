"""Worker threads for the kernels of a batch of neurons.

The kernels release the GIL. numba's parallel loops are not an option: a numba thread pool that has started
in a parent process kills forked workers.
"""

import os
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

# More than one part, so that the other threads take over parts of a thread that the system slows down.
_PARTS_PER_THREAD = 4


class Threads:
    """Threads that share the neurons of a step; each process starts its own at the first use.

    Args:
        count: Number of threads, including the calling one.
    """

    def __init__(self, count: int) -> None:
        self.count = count
        self._pool: ThreadPoolExecutor | None = None
        self._pid = 0

    def run(self, kernel: Callable[..., None], num: int, args: tuple[Any, ...]) -> None:
        """Call kernel(first, last, *args) on parts of 0..num, in the calling thread and the workers."""
        size = max(1, num // (self.count * _PARTS_PER_THREAD))
        parts = deque((first, min(first + size, num)) for first in range(0, num, size))

        def work() -> None:
            while parts:
                try:
                    first, last = parts.popleft()
                except IndexError:  # another thread took the last part
                    return
                kernel(first, last, *args)

        futures = [self._own_pool().submit(work) for _ in range(min(self.count, num) - 1)]
        work()
        for future in futures:
            future.result()

    def _own_pool(self) -> ThreadPoolExecutor:
        """Return the pool of this process; a forked process has none of its parent's threads."""
        if self._pool is None or self._pid != os.getpid():
            self._pool = ThreadPoolExecutor(self.count - 1, thread_name_prefix="lgmd")
            self._pid = os.getpid()
        return self._pool

    def __getstate__(self) -> dict[str, Any]:
        return {"count": self.count, "_pool": None, "_pid": 0}
