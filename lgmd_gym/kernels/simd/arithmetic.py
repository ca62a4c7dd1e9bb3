"""Arithmetic, comparisons and sums of lanes."""

import operator

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import overload

from lgmd_gym.kernels.simd.vectors import (
    FLOATS,
    INTS,
    LANES,
    ZEROS,
    call,
    integers,
    intrinsic,
    shuffle,
    vector,
)


def _elementwise(arity, emit, kind=vector, result_kind=None):
    """Return an intrinsic of `arity` vectors, given the function that emits its instructions."""
    signature = (result_kind or kind)(*[kind] * arity)
    result = signature, lambda context, builder, signature, args: emit(builder, *args)
    functions = {
        1: lambda typingctx, a: result,
        2: lambda typingctx, a, b: result,
        3: lambda typingctx, a, b, c: result,
    }
    return intrinsic(functions[arity])


def _abs(builder, x):
    return call(builder, f"llvm.fabs.v{LANES}f32", x)


_add = _elementwise(2, lambda b, x, y: b.fadd(x, y))
_sub = _elementwise(2, lambda b, x, y: b.fsub(x, y))
_mul = _elementwise(2, lambda b, x, y: b.fmul(x, y))
_div = _elementwise(2, lambda b, x, y: b.fdiv(x, y))
# x * y + z, with a single rounding if the machine supports it.
madd = _elementwise(3, lambda b, x, y, z: call(b, f"llvm.fmuladd.v{LANES}f32", x, y, z))
# |x|.
magnitude = _elementwise(1, _abs)
# √x; no lane may be negative.
square_root = _elementwise(1, lambda b, x: call(b, f"llvm.sqrt.v{LANES}f32", x))
# Larger of both lanes; neither may be NaN.
maximum = _elementwise(2, lambda b, x, y: b.select(b.fcmp_ordered(">", x, y), x, y))
# x where x >= limit, else 0.
at_least = _elementwise(2, lambda b, x, limit: b.select(b.fcmp_ordered(">=", x, limit), x, ZEROS))
# x where |x| >= limit, else 0.
clear_below = _elementwise(2, lambda b, x, limit: b.select(b.fcmp_ordered(">=", _abs(b, x), limit), x, ZEROS))
# x where sign >= 0, else y.
select_by_sign = _elementwise(3, lambda b, sign, x, y: b.select(b.fcmp_ordered(">=", sign, ZEROS), x, y))
# Smaller of both lanes; neither may be NaN.
minimum = _elementwise(2, lambda b, x, y: b.select(b.fcmp_ordered("<", x, y), x, y))
# y where x > limit, else x.
replace_above = _elementwise(3, lambda b, x, limit, y: b.select(b.fcmp_ordered(">", x, limit), y, x))
as_floats = _elementwise(1, lambda b, x: b.sitofp(x, FLOATS), integers, vector)
# Rounded towards 0; the lanes are within the range of int32.
as_integers = _elementwise(1, lambda b, x: b.fptosi(x, INTS), vector, integers)


@intrinsic
def running_sum(typingctx, a):
    """Return the sums of the first one, two, … and all lanes."""

    def codegen(context, builder, signature, args):
        sums = args[0]
        for step in (1, 2, 4, 8):
            lanes = [*range(LANES, LANES + step), *range(LANES - step)]
            sums = builder.fadd(sums, shuffle(builder, sums, ZEROS, lanes))
        return sums

    return vector(vector), codegen


@intrinsic
def splat_last(typingctx, a):
    """Return a vector with the last lane of `a` in every lane."""

    def codegen(context, builder, signature, args):
        return shuffle(builder, args[0], args[0], [LANES - 1] * LANES)

    return vector(vector), codegen


def _condition(emit):
    """Return an intrinsic: whether a comparison of two vectors, given by its emitter, holds for any lane."""

    @intrinsic
    def condition(typingctx, a, b):
        def codegen(context, builder, signature, args):
            lanes = builder.bitcast(emit(builder, *args), ir.IntType(LANES))
            return builder.icmp_unsigned("!=", lanes, ir.Constant(ir.IntType(LANES), 0))

        return types.boolean(vector, vector), codegen

    return condition


any_above = _condition(lambda b, x, y: b.fcmp_ordered(">", x, y))
any_different = _condition(lambda b, x, y: b.fcmp_unordered("!=", x, y))


@intrinsic
def total(typingctx, a):
    """Return the sum of all lanes, float32."""

    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.FloatType(), [ir.FloatType(), FLOATS])
        name = f"llvm.vector.reduce.fadd.v{LANES}f32"
        function = cgutils.get_or_insert_function(builder.module, kind, name)
        return builder.call(function, [ir.Constant(ir.FloatType(), -0.0), args[0]], fastmath=["reassoc"])

    return types.float32(vector), codegen


@intrinsic
def largest(typingctx, a):
    """Return the largest of all lanes, float32; none may be NaN."""

    def codegen(context, builder, signature, args):
        return call(builder, f"llvm.vector.reduce.fmax.v{LANES}f32", *args, result=ir.FloatType())

    return types.float32(vector), codegen


def _overload_operator(symbol, function, kind=vector) -> None:
    """Make a Python operator of two vectors call an intrinsic."""

    @overload(symbol)
    def implementation(a, b):
        return (lambda a, b: function(a, b)) if a == kind and b == kind else None


_overload_operator(operator.add, _add)
_overload_operator(operator.sub, _sub)
_overload_operator(operator.mul, _mul)
_overload_operator(operator.truediv, _div)
_overload_operator(operator.add, _elementwise(2, lambda b, x, y: b.add(x, y), integers), integers)
_overload_operator(operator.mul, _elementwise(2, lambda b, x, y: b.mul(x, y), integers), integers)
_overload_operator(operator.and_, _elementwise(2, lambda b, x, y: b.and_(x, y), integers), integers)
_overload_operator(operator.lshift, _elementwise(2, lambda b, x, y: b.shl(x, y), integers), integers)
# Fills with zeros: the lanes are read as unsigned numbers.
_overload_operator(operator.rshift, _elementwise(2, lambda b, x, y: b.lshr(x, y), integers), integers)
