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


def _elementwise(arity, emit):
    """Return an intrinsic of `arity` vectors, given the function that emits its instructions."""
    result = vector(*[vector] * arity), lambda context, builder, signature, args: emit(builder, *args)
    functions = {
        1: lambda typingctx, a: result,
        2: lambda typingctx, a, b: result,
        3: lambda typingctx, a, b, c: result,
    }
    return intrinsic(functions[arity])


def _call(builder, name, *args, result: ir.Type = _FLOATS):
    """Emit a call of an LLVM intrinsic, given its full name."""
    kind = ir.FunctionType(result, [arg.type for arg in args])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), args)


def _abs(builder, x):
    return _call(builder, f"llvm.fabs.v{LANES}f32", x)


_add = _elementwise(2, lambda b, x, y: b.fadd(x, y))
_sub = _elementwise(2, lambda b, x, y: b.fsub(x, y))
_mul = _elementwise(2, lambda b, x, y: b.fmul(x, y))
# x * y + z, with a single rounding if the machine supports it.
madd = _elementwise(3, lambda b, x, y, z: _call(b, f"llvm.fmuladd.v{LANES}f32", x, y, z))
# |x|.
magnitude = _elementwise(1, _abs)
# Larger of both lanes; neither may be NaN.
maximum = _elementwise(2, lambda b, x, y: b.select(b.fcmp_ordered(">", x, y), x, y))
# x where x >= limit, else 0.
at_least = _elementwise(2, lambda b, x, limit: b.select(b.fcmp_ordered(">=", x, limit), x, _ZEROS))
# x where |x| >= limit, else 0.
clear_below = _elementwise(
    2, lambda b, x, limit: b.select(b.fcmp_ordered(">=", _abs(b, x), limit), x, _ZEROS)
)
# x where sign >= 0, else y.
select_by_sign = _elementwise(3, lambda b, sign, x, y: b.select(b.fcmp_ordered(">=", sign, _ZEROS), x, y))


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
        return _call(builder, f"llvm.vector.reduce.fmax.v{LANES}f32", *args, result=ir.FloatType())

    return types.float32(vector), codegen


def _overload_operator(symbol, function) -> None:
    """Make a Python operator of two vectors call an intrinsic."""

    @overload(symbol)
    def implementation(a, b):
        return (lambda a, b: function(a, b)) if a == vector and b == vector else None


_overload_operator(operator.add, _add)
_overload_operator(operator.sub, _sub)
_overload_operator(operator.mul, _mul)
