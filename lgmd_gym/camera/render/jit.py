"""The one way in which the camera's kernels are compiled."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba as nb

# mtime and size of every file of kernels.
_STAMP = tuple(
    (path.name, path.stat().st_mtime, path.stat().st_size)
    for path in sorted(Path(__file__).parents[1].rglob("*.py"))
)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel once per machine, single-threaded: a pool of threads in a parent kills forked workers.

    Numba's cache looks at the file of a kernel, not at the files of those it calls, so that a change
    in one file leaves old machine code in its callers. Here all files count.
    """
    compiled = nb.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})(function)
    index: Any = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    if hasattr(index, "_source_stamp"):
        index._source_stamp = _STAMP
    return compiled
