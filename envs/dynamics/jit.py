"""The decorator that compiles the functions of motion, contact, reward and termination."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from numba import njit

_F = TypeVar("_F", bound=Callable[..., Any])

_FOLDER = Path(__file__).parent
# Name, mtime and size of every file with compiled functions.
_STAMP = tuple(
    (path.name, path.stat().st_mtime, path.stat().st_size)
    for path in sorted([*_FOLDER.glob("*.py"), *_FOLDER.parent.glob("*.py")])
)


def compiled(function: _F) -> _F:
    """Compile a function with exact IEEE arithmetic, without the GIL, cached on disk.

    The same arguments give the same bits from Python and from other compiled functions. Numba invalidates a
    cached function when its own file changes, but not when the file of a function that it calls changes.
    Here a change in any file of this folder or the one above invalidates the cache.
    """
    dispatcher = njit(cache=True, nogil=True)(function)
    index: Any = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if hasattr(index, "_source_stamp"):
        index._source_stamp = (index._source_stamp, _STAMP)
    return dispatcher
