# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Python's hash of a tuple for kernels; numba's own takes a second to compile for each kind of tuple."""

import numpy as np

from lgmd_gym.kernels.kernel import kernel

# Constants of xxHash, with which Python hashes tuples.
_FIRST, _SECOND, _FIFTH = map(np.uint64, (11400714785074694791, 14029467366897019727, 2870177450012600261))
START = _FIFTH
"""State before the first element."""


@kernel(exact=True)
def add_hash(state, value_hash):
    """Return the state after one more element, given its hash, see Python's `hash`; that of -1 is -2."""
    state = np.uint64(state) + np.uint64(value_hash) * _SECOND
    return ((state << np.uint64(31)) | (state >> np.uint64(33))) * _FIRST


@kernel(exact=True)
def finish_hash(state, length):
    """Return the hash of a tuple with `length` elements, int64."""
    return np.int64(np.uint64(state) + (np.uint64(length) ^ (_FIFTH ^ np.uint64(3527539))))
