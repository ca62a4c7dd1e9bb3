"""Vectors of sixteen lanes against numpy."""

import numba as nb
import numpy as np
import pytest

from lgmd_gym.kernels import simd

RNG = np.random.default_rng(0)
A, B = RNG.normal(size=16).astype(np.float32), RNG.normal(size=16).astype(np.float32)


@nb.njit
def apply(a, b, out):
    """Write running sum, last lane, minimum, replacement quotient, whole part and root to `out`."""
    x, y = simd.load(a, 0), simd.load(b, 0)
    simd.store(out, 0, simd.running_sum(x))
    simd.store(out, 16, simd.splat_last(x))
    simd.store(out, 32, simd.minimum(x, y))
    simd.store(out, 48, simd.replace_above(x, y, simd.splat(nb.float32(7.0))))
    simd.store(out, 64, x / y)
    simd.store(out, 80, simd.as_floats(simd.as_integers(x * simd.splat(nb.float32(9.0)))))
    simd.store(out, 96, simd.square_root(simd.magnitude(x)))
    return simd.any_above(x, y), simd.any_different(x, y)


@nb.njit
def copy_part(source, target, index, count):
    """Copy the first `count` lanes of a load that is limited to `count`, plus one."""
    value = simd.load_part(source, index, count) + simd.splat(nb.float32(1.0))
    simd.store_part(target, index, count, value)


@nb.njit
def store_bytes(source, target, index, count):
    """Store the first `count` lanes as bytes."""
    simd.store_bytes(target, index, count, simd.load(source, 0))


@nb.njit
def gather(data, indices, out):
    """Write the second byte at each index, plus the number of the lane, to `out`."""
    lanes = simd.lane_numbers() * simd.splat(nb.int32(indices))
    words = simd.gather_words(data, lanes)
    byte = (words >> simd.splat(nb.int32(8))) & simd.splat(nb.int32(255))
    simd.store(out, 0, simd.as_floats(byte + (simd.lane_numbers() << simd.splat(nb.int32(10)))))


def test_operations_on_lanes():
    out = np.zeros((7, 16), np.float32)
    assert apply(A, B, out) == (True, True)
    assert out[0] == pytest.approx(np.cumsum(A), abs=1e-5)
    assert np.array_equal(out[1], np.full(16, A[-1]))
    assert np.array_equal(out[2], np.minimum(A, B))
    assert np.array_equal(out[3], np.where(A > B, np.float32(7.0), A))
    assert np.array_equal(out[4], A / B)
    assert np.array_equal(out[5], np.trunc(A * np.float32(9.0)))
    assert np.array_equal(out[6], np.sqrt(np.abs(A)))
    assert apply(A, A, out) == (False, False)
    assert apply(A, np.where(np.arange(16) == 11, A + 1, A).astype(np.float32), out) == (False, True)


@pytest.mark.parametrize("count", [1, 7, 15, 16, 40])
def test_partial_loads_and_stores_touch_no_other_elements(count):
    source, target = np.arange(64, dtype=np.float32), np.zeros(64, np.float32)
    copy_part(source, target, 5, count)
    expected = np.zeros(64, np.float32)
    last = 5 + min(count, 16)
    expected[5:last] = source[5:last] + 1.0
    assert np.array_equal(target, expected)


@pytest.mark.parametrize("count", [-1, 0, 1, 7, 15, 16, 40])
def test_bytes_are_stored_without_fractions(count):
    source = np.linspace(0.0, 255.9, 16, dtype=np.float32)
    target, expected = np.full(64, 9, np.uint8), np.full(64, 9, np.uint8)
    store_bytes(source, target, 5, count)
    used = min(max(count, 0), 16)
    expected[5 : 5 + used] = source[:used].astype(np.uint8)
    assert np.array_equal(target, expected)


def test_gather_reads_bytes_at_any_index():
    data, out = RNG.integers(0, 256, 1000, dtype=np.uint8), np.zeros(16, np.float32)
    gather(data, 37, out)
    assert np.array_equal(out, data[np.arange(16) * 37 + 1] + 1024.0 * np.arange(16))
