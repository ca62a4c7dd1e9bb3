"""LLVM vectors of sixteen float32 or int32 lanes for numba kernels.

LLVM's auto-vectoriser fails on loops over as many arrays as an LGMD pass reads and writes: it cannot prove
that the arrays do not overlap, and repeats that check for every short row. It also fails on running sums and
on reads of bytes at computed indices. Explicit vectors avoid the check. LLVM maps the types to the registers
of the machine (one AVX-512, two AVX or four SSE/NEON registers), so the code is portable.

Indices of `load`, `store` and `copy` count the elements of a C-contiguous array of any number of dimensions;
they are not checked.

numba's cache tracks only the file of a kernel: delete __pycache__/*.nbi after a change in this folder.
"""

from lgmd_gym.kernels.simd.arithmetic import (
    any_above,
    any_different,
    as_floats,
    as_integers,
    at_least,
    clear_below,
    largest,
    madd,
    magnitude,
    maximum,
    minimum,
    replace_above,
    running_sum,
    select_by_sign,
    splat_last,
    square_root,
    total,
)
from lgmd_gym.kernels.simd.partial import load_part, store_part
from lgmd_gym.kernels.simd.vectors import (
    LANES,
    copy,
    gather_words,
    lane_numbers,
    load,
    splat,
    store,
    store_bytes,
)

__all__ = [
    "LANES",
    "any_above",
    "any_different",
    "as_floats",
    "as_integers",
    "at_least",
    "clear_below",
    "copy",
    "gather_words",
    "lane_numbers",
    "largest",
    "load",
    "load_part",
    "madd",
    "magnitude",
    "maximum",
    "minimum",
    "replace_above",
    "running_sum",
    "select_by_sign",
    "splat",
    "splat_last",
    "square_root",
    "store",
    "store_bytes",
    "store_part",
    "total",
]
