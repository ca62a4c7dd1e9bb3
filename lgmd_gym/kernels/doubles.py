# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""LLVM vectors of eight float64 lanes for numba kernels, for coordinates; see `simd` for the idea."""

import operator

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import config
from numba.extending import models, register_model

from lgmd_gym.kernels.simd import (
    call,
    elementwise,
    intrinsic,
    overload_operator,
    pointer_to,
    repeated,
    storing,
)

LANES = 8
_DOUBLES = ir.VectorType(ir.DoubleType(), LANES)


class Float64x8(types.Type):
    """Numba type of eight float64 lanes."""

    def __init__(self) -> None:
        super().__init__(name="Float64x8")


doubles = Float64x8()


@register_model(Float64x8)
class _Doubles(models.PrimitiveModel):
    def __init__(self, dmm, fe_type) -> None:
        super().__init__(dmm, fe_type, _DOUBLES)


@intrinsic
def load_doubles(typingctx, array, index):
    """Load eight elements of a contiguous float64 array, counted without its dimensions."""

    def codegen(context, builder, signature, args):
        lanes = builder.load(pointer_to(context, builder, signature.args[0], args[0], args[1], _DOUBLES))
        lanes.align = 8
        return lanes

    return doubles(array, types.intp), codegen


# Store the lanes to eight elements of a contiguous float64 array.
store_doubles = storing(_DOUBLES, doubles, 8)


@intrinsic
def splat_double(typingctx, value):
    """Return a vector with the same float64 in every lane."""

    def codegen(context, builder, signature, args):
        return repeated(builder, _DOUBLES, args[0])

    return doubles(types.float64), codegen


# x * y + z, with a single rounding if the machine supports it.
madd_doubles = elementwise(
    3, lambda b, x, y, z: call(b, f"llvm.fmuladd.v{LANES}f64", x, y, z, result=_DOUBLES), doubles
)


def _reduction(name):
    """Return an intrinsic that reduces all lanes, of which none may be NaN, to one float64."""

    @intrinsic
    def reduce(typingctx, a):
        def codegen(context, builder, signature, args):
            return call(builder, f"llvm.vector.reduce.{name}.v{LANES}f64", *args, result=ir.DoubleType())

        return types.float64(doubles), codegen

    return reduce


least_double, greatest_double = _reduction("fmin"), _reduction("fmax")

overload_operator(operator.add, elementwise(2, lambda b, x, y: b.fadd(x, y), doubles), doubles)
overload_operator(operator.sub, elementwise(2, lambda b, x, y: b.fsub(x, y), doubles), doubles)
overload_operator(operator.mul, elementwise(2, lambda b, x, y: b.fmul(x, y), doubles), doubles)
overload_operator(operator.truediv, elementwise(2, lambda b, x, y: b.fdiv(x, y), doubles), doubles)

if config.DISABLE_JIT:  # pyright: ignore[reportAttributeAccessIssue]
    # For tests of the kernels of geometry without compilation: NumPy arrays in place of vectors.
    globals().update(
        load_doubles=lambda array, index: array.reshape(-1)[index : index + LANES].copy(),
        store_doubles=lambda array, index, value: array.reshape(-1).__setitem__(
            slice(index, index + LANES), value
        ),
        splat_double=lambda value: np.full(LANES, value),
        madd_doubles=lambda x, y, z: x * y + z,
        least_double=np.min,
        greatest_double=np.max,
    )
