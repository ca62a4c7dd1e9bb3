"""The decorator that compiles the functions of motion, contact, reward and termination."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from lgmd_gym.system.kernel import kernel

_F = TypeVar("_F", bound=Callable[..., Any])

Arrays: TypeAlias = tuple[Any, ...]
"""The fields of a NamedTuple of arrays, or the NamedTuple itself, which is slower to pass from Python."""
_FOLDER = Path(__file__).parent
# Name, mtime and size of every file of the environments.
_STAMP = tuple(
    (path.name, path.stat().st_mtime, path.stat().st_size) for path in sorted(_FOLDER.parent.rglob("*.py"))
)


def compiled(function: _F) -> _F:
    """Compile a function with exact IEEE arithmetic, without the GIL, cached on disk.

    It cannot create or return arrays: without numba's runtime (`_nrt`), calls do not count references to
    arrays, which takes longer than the physics. `compiled_with_arrays` can.

    The same arguments give the same bits from Python and from other compiled functions. Numba invalidates a
    cached function when its own file changes, but not when the file of a function that it calls changes.
    Here a change in any file of `lgmd_gym.envs` invalidates the cache.
    """
    return _compile(function, _nrt=False)


def compiled_with_arrays(function: _F) -> _F:
    """Compile a function like `compiled`; it may create and return arrays."""
    return _compile(function, _nrt=True)


def _compile(function: _F, **options: Any) -> _F:
    dispatcher: Any = kernel(function, **options)
    index: Any = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if hasattr(index, "_source_stamp"):
        index._source_stamp = (index._source_stamp, _STAMP)
    return dispatcher
