# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Bundle: arrays that kernels receive in one piece.

A call from Python spends a quarter of a microsecond on each array of a tuple. A bundle holds the arrays in
the form that kernels read, so that it costs half a microsecond however many there are.
"""

from typing import Any

import numba as nb
from numba.core import types
from numba.experimental import structref


@structref.register
class _NativeType(types.StructRef):
    """Numba type of a tuple of arrays by reference."""


class _Native(structref.StructRefProxy):
    """Python's handle of a `_NativeType`."""


structref.define_boxing(_NativeType, _Native)
structref.define_constructor(_Native, _NativeType, ["arrays"])


@nb.njit(cache=True)
def _make_native(arrays):
    return _Native(arrays)


class Bundle:
    """Arrays that kernels receive in one piece, as the attribute `arrays` of their argument.

    Copies and pickles contain copies of the arrays.

    Args:
        arrays: The arrays, or nested tuples of them.

    Attributes:
        arrays: The arrays as a tuple.
    """

    def __init__(self, *arrays: Any) -> None:
        self.arrays = arrays
        self._native: Any = None

    @property
    def native(self) -> Any:
        """The argument for a kernel."""
        if self._native is None:
            self._native = _make_native(self.arrays)
        return self._native

    def __getstate__(self) -> dict[str, object]:
        return {"arrays": self.arrays, "_native": None}
