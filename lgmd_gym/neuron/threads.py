"""Threads for a batch of neurons: plain ones, which numba kernels without the GIL keep busy.

Not numba's own parallel loops: their pool, once started in a parent, ends forked workers.
"""

import os
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from typing import Any

# More than one, so that a thread which another process slows down leaves its share to the others.
_PARTS_PER_THREAD = 4


class Threads:
    """Plain threads that share the neurons of a step, started at the first use in each process."""

    def __init__(self, count: int) -> None:
        self.count = count
        self._pool: ThreadPoolExecutor | None = None
        self._pid = 0

    def run(self, kernel: Any, num: int, args: tuple[Any, ...]) -> None:
        """Run kernel(first, last, *args) over 0..num in parts, this thread among the workers."""
        size = max(1, num // (self.count * _PARTS_PER_THREAD))
        parts = deque((first, min(first + size, num)) for first in range(0, num, size))

        def work() -> None:
            while parts:
                try:
                    first, last = parts.popleft()
                except IndexError:  # another thread took the last one
                    return
                kernel(first, last, *args)

        futures = [self._started().submit(work) for _ in range(min(self.count, num) - 1)]
        work()
        for future in futures:
            future.result()

    def _started(self) -> ThreadPoolExecutor:
        """The pool of this process: a forked child has none of its parent's threads."""
        if self._pool is None or self._pid != os.getpid():
            self._pool = ThreadPoolExecutor(self.count - 1, thread_name_prefix="lgmd")
            self._pid = os.getpid()
        return self._pool

    def __getstate__(self) -> dict[str, Any]:
        return {"count": self.count, "_pool": None, "_pid": 0}
