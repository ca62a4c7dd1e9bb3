"""The decorators that compile the camera's kernels."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from lgmd_gym import simd
from lgmd_gym.system.kernel import kernel as system_kernel

# Name, mtime and size of every file of the camera, and of the vectors that it uses.
_STAMP = tuple(
    (path.name, path.stat().st_mtime, path.stat().st_size)
    for folder in (Path(__file__).parents[1], Path(simd.__file__).parent)
    for path in sorted(folder.rglob("*.py"))
)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel, cached on disk and single-threaded (a thread pool in a parent kills forked workers).

    A kernel cannot create arrays, assign one array to another, or return an array: without numba's runtime
    (`_nrt`), calls of kernels do not count references to arrays. The atomic counts took half of the time of a
    frame, because kernels call each other with tuples of arrays, some of them several times per image row.

    Numba invalidates a cached kernel when its own file changes, but not when the file of a kernel that it
    calls changes. Here a change in any file of the camera or in `lgmd_gym.simd` invalidates the cache.
    """
    return _compile(function, fastmath={"contract", "nsz"}, _nrt=False)


def inlined_kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel that becomes part of each caller; the rest is as for `kernel`.

    It serves short kernels that are called for every edge or row: a call passes an array as eleven numbers.
    """
    return _compile(function, fastmath={"contract", "nsz"}, _nrt=False, forceinline=True)


def outer_kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel that receives `Bundle`s, which count references; the rest is as for `kernel`."""
    return _compile(function, fastmath={"contract", "nsz"}, _nrt=True)


def exact_kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel with the results of the same arithmetic in Python, to the bit; see `kernel`.

    It may use all of numba, and counts references.
    """
    return _compile(function, fastmath=False, _nrt=True)


def _compile(function: Callable[..., Any], **options: Any) -> Any:
    compiled = system_kernel(function, error_model="numpy", **options)
    index: Any = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    if hasattr(index, "_source_stamp"):
        index._source_stamp = _STAMP
    return compiled
