"""Worker threads for the kernels of a batch of neurons.

The kernels release the GIL. numba's parallel loops are not an option: a numba thread pool that has started
in a parent process kills forked workers.
"""

import os
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from itertools import pairwise

from numba.core import config

# The rest is split into smaller parts, of which faster threads take more. Every part costs overhead.
_LARGE_SHARE = 0.7


def check_compiling() -> None:
    """Raise ValueError if numba does not compile: environments and cameras need compiled kernels."""
    if config.DISABLE_JIT:  # pyright: ignore[reportAttributeAccessIssue, reportUnknownMemberType]
        raise ValueError("NUMBA_DISABLE_JIT must be unset for environments and cameras, which are compiled")


class Threads:
    """Threads that share the neurons of a step; each process starts its own at the first use.

    Args:
        count: Number of threads, including the calling one.
    """

    def __init__(self, count: int) -> None:
        self.count = count
        self._pool: ThreadPoolExecutor | None = None
        self._pid = 0

    def run(self, kernel: Callable[..., None], num: int, args: tuple[object, ...]) -> None:
        """Call kernel(first, last, *args) on parts of 0..num, in the calling thread and the workers."""
        parts = deque(self._parts(num))

        def work() -> None:
            while parts:
                try:
                    first, last = parts.popleft()
                except IndexError:  # another thread took the last part
                    return
                kernel(first, last, *args)

        futures = [self._own_pool().submit(work) for _ in range(min(self.count, num) - 1)]
        try:
            work()
        finally:  # also after Ctrl-C, no thread still writes to the arrays
            parts.clear()
            wait(futures)
        for future in futures:
            future.result()

    def _parts(self, num: int) -> list[tuple[int, int]]:
        """Return first and last + 1 of each part of 0..num: a large part per thread, then a small one."""
        large = max(1, int(num * _LARGE_SHARE / self.count))
        small = -(-(num - large * self.count) // self.count)
        ends = [large * k for k in range(self.count + 1)]
        ends += [ends[-1] + small * (k + 1) for k in range(self.count)]
        return [(first, min(last, num)) for first, last in pairwise(ends) if first < min(last, num)]

    def _own_pool(self) -> ThreadPoolExecutor:
        """Return the pool of this process; a forked process has none of its parent's threads."""
        if self._pool is None or self._pid != os.getpid():
            self._pool = ThreadPoolExecutor(self.count - 1, thread_name_prefix="lgmd")
            self._pid = os.getpid()
        return self._pool

    def __getstate__(self) -> dict[str, object]:
        return {"count": self.count, "_pool": None, "_pid": 0}
