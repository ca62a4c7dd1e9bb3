"""The decorators that compile the camera's kernels."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba as nb

# Name, mtime and size of every file of the camera.
_STAMP = tuple(
    (path.name, path.stat().st_mtime, path.stat().st_size)
    for path in sorted(Path(__file__).parents[1].rglob("*.py"))
)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel, cached on disk and single-threaded (a thread pool in a parent kills forked workers).

    Numba invalidates a cached kernel when its own file changes, but not when the file of a kernel that it
    calls changes. Here a change in any file of the camera invalidates the cache.
    """
    return _compile(function, fastmath={"contract", "nsz"})


def exact_kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel like `kernel`, with the results of the same arithmetic in Python, to the bit."""
    return _compile(function, fastmath=False)


def _compile(function: Callable[..., Any], fastmath: bool | set[str]) -> Any:
    compiled = nb.njit(cache=True, nogil=True, error_model="numpy", fastmath=fastmath)(function)
    index: Any = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    if hasattr(index, "_source_stamp"):
        index._source_stamp = _STAMP
    return compiled
