"""Functions that higher rooms provide to the benchmark, loaded at their first use.

A room registers its function when it is imported: `lgmd_gym.openscenario` a reader of suites by suffix, and
`lgmd_gym.report` the writer of the outputs of a run.
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any

OUTPUTS = "outputs"
_ROOMS = {".xosc": "lgmd_gym.openscenario", OUTPUTS: "lgmd_gym.report"}
_functions: dict[str, Callable[..., Any]] = {}


def provide(key: str, function: Callable[..., Any]) -> None:
    """Register the function of a key: a suffix of files for a reader of suites, or `OUTPUTS`."""
    _functions[key] = function


def provided(key: str) -> Callable[..., Any]:
    """Return the function of a key, and import the room that provides it if necessary."""
    if key not in _functions:
        import_module(_ROOMS[key])
    return _functions[key]
