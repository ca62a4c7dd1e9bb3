"""`Bundle`: arrays that kernels receive in one piece."""

import copy
import gc
import pickle

import numba as nb
import numpy as np

from lgmd_gym.kernels.bundle import Bundle


@nb.njit
def add(bundle, value):
    first, (second, third) = bundle.arrays
    first[0] += value
    return first[0] + second.sum() + third[0]["a"]


def make_bundle():
    return Bundle(np.zeros(3), (np.ones((2, 2), np.float32), np.full(2, 5.0).view([("a", np.float64)])))


def test_kernels_read_and_write_the_arrays():
    bundle = make_bundle()
    assert add(bundle.native, 2.0) == 2.0 + 4.0 + 5.0
    assert bundle.arrays[0][0] == 2.0
    bundle.arrays[0][0] = 7.0
    assert add(bundle.native, 1.0) == 8.0 + 4.0 + 5.0


def test_a_bundle_keeps_its_arrays_alive():
    native = make_bundle().native
    gc.collect()
    np.full(10_000, 3.0)
    assert add(native, 1.0) == 10.0


def test_copies_have_arrays_of_their_own():
    for duplicate in (copy.deepcopy, lambda item: pickle.loads(pickle.dumps(item))):
        bundle = make_bundle()
        add(bundle.native, 1.0)
        clone = duplicate(bundle)
        assert add(clone.native, 4.0) == 14.0
        assert (bundle.arrays[0][0], clone.arrays[0][0]) == (1.0, 5.0)
