"""The NaN of `info`: undefined, yet equal to itself."""

from typing import Any

import numpy as np


class _Undefined(np.float64):
    """A NaN that equals itself.

    Gymnasium's environment checker holds two infos against each other with ==, so that a plain NaN would
    pass for a lack of determinism. As a NumPy float it still lands in the float arrays of vector envs.
    """

    def __eq__(self, other: Any) -> Any:
        return isinstance(other, _Undefined)

    def __ne__(self, other: Any) -> Any:
        return not isinstance(other, _Undefined)

    __hash__ = np.float64.__hash__


UNDEFINED = _Undefined("nan")
