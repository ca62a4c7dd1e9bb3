# pyright: standard
# Not strict: numba states no types of its internals.
"""Time spent in the stages of a kernel, for profiles: the counter of the processor, read between stages.

Kernels are compiled with these readings only if the variable LGMD_GYM_PROFILE is set at the first import;
without it they contain nothing of them.
"""

import os

import numpy as np
from llvmlite import ir
from numba import types

from lgmd_gym.kernels.kernel import kernel
from lgmd_gym.kernels.simd import call, intrinsic
from lgmd_gym.kernels.sources import PROFILE_VARIABLE

PROFILING = bool(os.environ.get(PROFILE_VARIABLE))
START = np.int64(0)  # stage that only starts the time


@intrinsic
def _read_counter(typingctx):
    """Return the counter of the processor, int64."""

    def codegen(context, builder, signature, args):
        return call(builder, "llvm.readcyclecounter", result=ir.IntType(64))

    return types.int64(), codegen


@kernel(inline=True)
def mark(clock, stage):
    """Add the time since the last call to a stage, or start the time.

    Args:
        clock: The counter at the last call, then the ticks of each stage, int64, shape (stages + 1,).
        stage: Number of the stage that ends here, from 1 on, or `START`.
    """
    if PROFILING:
        now = _read_counter()
        clock[stage] += now - clock[0]
        clock[0] = now


@kernel
def ticks():
    """Return the counter of the processor."""
    return _read_counter()
