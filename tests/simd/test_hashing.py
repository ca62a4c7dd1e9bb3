"""The hash of tuples in kernels is Python's."""

import numba as nb
import numpy as np
import pytest

from lgmd_gym.kernels.hashing import START, add_hash, finish_hash


@nb.njit  # without a cache, which would not notice a change of the called kernels
def hash_of_three(a, b, c):
    return finish_hash(add_hash(add_hash(add_hash(START, a), b), c), 3)


@pytest.mark.parametrize(
    "values", [(0, 0, 0), (1, 2, 3), (-7, 2**40, -(2**59)), (8019, 4, 13), (2.5, -0.1, 1e300), (-1, -1, 0)]
)
def test_hash_of_a_tuple(values):
    assert hash_of_three(*(np.int64(hash(value)) for value in values)) == hash(values)
