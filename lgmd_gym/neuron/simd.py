"""LLVM vectors of sixteen float32 lanes for numba kernels.

LLVM's auto-vectoriser fails on loops over as many arrays as an LGMD pass reads and writes: it cannot prove
that the arrays do not overlap, and repeats that check for every short row. Explicit vectors avoid the check.
LLVM maps the type to the registers of the machine (one AVX-512, two AVX or four SSE/NEON registers), so the
code is portable.

numba's cache tracks only the file of a kernel: delete __pycache__/*.nbi after a change in this file.
"""

import operator
from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.core import cgutils
from numba.extending import models, overload, register_model

# Any, because a decorated function is called without its typing context.
intrinsic: Any = extending.intrinsic

LANES = 16
_FLOATS = ir.VectorType(ir.FloatType(), LANES)
_INTS = ir.VectorType(ir.IntType(32), LANES)
_BYTES = ir.VectorType(ir.IntType(8), LANES)
_ZEROS = ir.Constant(_FLOATS, [0.0] * LANES)


class Float32x16(types.Type):
    """Numba type of sixteen float32 lanes."""

    def __init__(self) -> None:
        super().__init__(name="Float32x16")


vector = Float32x16()


@register_model(Float32x16)
class _Model(models.PrimitiveModel):
    def __init__(self, dmm, fe_type) -> None:
        super().__init__(dmm, fe_type, _FLOATS)


def _pointer(context, builder, array_type, array, index, kind):
    """Return the address of an element of a one-dimensional array, as a pointer to a vector of `kind`."""
    data = cgutils.create_struct_proxy(array_type)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [index]), kind.as_pointer())


@intrinsic
def load(typingctx, array, index):
    """Load array[index : index + 16] of a contiguous float32 or uint8 array, without bounds checks."""

    def codegen(context, builder, signature, args):
        is_byte = signature.args[0].dtype == types.uint8
        kind = _BYTES if is_byte else _FLOATS
        pointer = _pointer(context, builder, signature.args[0], args[0], args[1], kind)
        lanes = builder.load(pointer)
        lanes.align = 1 if is_byte else 4
        # Via int32, from which the conversion is one instruction on all machines.
        return builder.sitofp(builder.zext(lanes, _INTS), _FLOATS) if is_byte else lanes

    return vector(array, types.intp), codegen


@intrinsic
def store(typingctx, array, index, value):
    """Store the lanes to array[index : index + 16] of a contiguous float32 array, without bounds checks."""

    def codegen(context, builder, signature, args):
        pointer = _pointer(context, builder, signature.args[0], args[0], args[1], _FLOATS)
        builder.store(args[2], pointer).align = 4
        return context.get_dummy_value()

    return types.void(array, types.intp, vector), codegen


@intrinsic
def copy(typingctx, source, source_index, target, target_index):
    """Copy 16 elements between contiguous arrays of the same dtype, without bounds checks."""

    def codegen(context, builder, signature, args):
        kind, align = (_BYTES, 1) if signature.args[0].dtype == types.uint8 else (_FLOATS, 4)
        lanes = builder.load(_pointer(context, builder, signature.args[0], args[0], args[1], kind))
        target = _pointer(context, builder, signature.args[2], args[2], args[3], kind)
        lanes.align = builder.store(lanes, target).align = align
        return context.get_dummy_value()

    return types.void(source, types.intp, target, types.intp), codegen


@intrinsic
def splat(typingctx, value):
    """Return a vector with the same float32 in every lane."""

    def codegen(context, builder, signature, args):
        empty, zeros = ir.Constant(_FLOATS, ir.Undefined), ir.Constant(_INTS, [0] * LANES)
        first = builder.insert_element(empty, args[0], ir.Constant(ir.IntType(32), 0))
        return builder.shuffle_vector(first, empty, zeros)

    return vector(types.float32), codegen


def _binary(emit):
    """Return an intrinsic of two vectors, given the function that emits its instruction."""

    @intrinsic
    def function(typingctx, a, b):
        def codegen(context, builder, signature, args):
            return emit(builder, *args)

        return vector(vector, vector), codegen

    return function


def _call(builder, name, args, result: ir.Type = _FLOATS):
    """Emit a call of an LLVM intrinsic, given its full name."""
    kind = ir.FunctionType(result, [arg.type for arg in args])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), args)


_add = _binary(lambda b, x, y: b.fadd(x, y))
_sub = _binary(lambda b, x, y: b.fsub(x, y))
_mul = _binary(lambda b, x, y: b.fmul(x, y))
# Larger of both lanes; neither may be NaN.
maximum = _binary(lambda b, x, y: b.select(b.fcmp_ordered(">", x, y), x, y))
# x where x >= y, else 0.
at_least = _binary(lambda b, x, y: b.select(b.fcmp_ordered(">=", x, y), x, _ZEROS))


@intrinsic
def madd(typingctx, a, b, c):
    """Return a * b + c, with a single rounding if the machine supports it."""

    def codegen(context, builder, signature, args):
        return _call(builder, f"llvm.fmuladd.v{LANES}f32", args)

    return vector(vector, vector, vector), codegen


@intrinsic
def magnitude(typingctx, a):
    """Return |a|."""

    def codegen(context, builder, signature, args):
        return _call(builder, f"llvm.fabs.v{LANES}f32", args)

    return vector(vector), codegen


@intrinsic
def clear_below(typingctx, a, limit):
    """Return `a` where |a| >= limit, else 0."""

    def codegen(context, builder, signature, args):
        size = _call(builder, f"llvm.fabs.v{LANES}f32", args[:1])
        return builder.select(builder.fcmp_ordered(">=", size, args[1]), args[0], _ZEROS)

    return vector(vector, vector), codegen


@intrinsic
def select_by_sign(typingctx, sign, plus, minus):
    """Return `plus` where sign >= 0, else `minus`."""

    def codegen(context, builder, signature, args):
        return builder.select(builder.fcmp_ordered(">=", args[0], _ZEROS), args[1], args[2])

    return vector(vector, vector, vector), codegen


@intrinsic
def total(typingctx, a):
    """Return the sum of all lanes, float32."""

    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.FloatType(), [ir.FloatType(), _FLOATS])
        name = f"llvm.vector.reduce.fadd.v{LANES}f32"
        function = cgutils.get_or_insert_function(builder.module, kind, name)
        return builder.call(function, [ir.Constant(ir.FloatType(), -0.0), args[0]], fastmath=["reassoc"])

    return types.float32(vector), codegen


@intrinsic
def largest(typingctx, a):
    """Return the largest of all lanes, float32; none may be NaN."""

    def codegen(context, builder, signature, args):
        return _call(builder, f"llvm.vector.reduce.fmax.v{LANES}f32", args, ir.FloatType())

    return types.float32(vector), codegen


@overload(operator.add)
def _overload_add(a, b):
    if a == vector and b == vector:
        return lambda a, b: _add(a, b)
    return None


@overload(operator.sub)
def _overload_sub(a, b):
    if a == vector and b == vector:
        return lambda a, b: _sub(a, b)
    return None


@overload(operator.mul)
def _overload_mul(a, b):
    if a == vector and b == vector:
        return lambda a, b: _mul(a, b)
    return None
