"""Type of the arguments that are records of arrays."""

from typing import Any, TypeAlias

Arrays: TypeAlias = tuple[Any, ...]
"""The fields of a NamedTuple of arrays, or the NamedTuple itself, which is slower to pass from Python."""
