"""Access to the ends of rows, which have fewer elements than a vector has lanes."""

from numba.extending import register_jitable

from lgmd_gym.kernels.simd.vectors import LANES, load, load_masked, store, store_masked


@register_jitable
def load_part(array, index, count):
    """Load array[index : index + count] of a float32 array, at most 16 elements; the other lanes are 0."""
    return load(array, index) if count >= LANES else load_masked(array, index, count)


@register_jitable
def store_part(array, index, count, value):
    """Store the first `count` lanes, at most 16, to array[index : index + count] of a float32 array."""
    if count >= LANES:
        store(array, index, value)
    else:
        store_masked(array, index, count, value)
