# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""LLVM vectors of sixteen float32 or int32 lanes for numba kernels.

LLVM's auto-vectoriser fails on loops over as many arrays as an LGMD pass reads and writes: it cannot prove
that the arrays do not overlap, and repeats that check for every short row. It also fails on running sums and
on reads of bytes at computed indices. Explicit vectors avoid the check. LLVM maps the types to the registers
of the machine (one AVX-512, two AVX or four SSE/NEON registers), so the code is portable.

Indices of `load`, `store` and `copy` count the elements of a C-contiguous array of any number of dimensions;
they are not checked.
"""

import operator
from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.core import cgutils
from numba.extending import models, overload, register_jitable, register_model

# Any, because a decorated function is called without its typing context.
intrinsic: Any = extending.intrinsic

LANES = 16
FLOATS = ir.VectorType(ir.FloatType(), LANES)
INTS = ir.VectorType(ir.IntType(32), LANES)
_BYTES = ir.VectorType(ir.IntType(8), LANES)
ZEROS = ir.Constant(FLOATS, [0.0] * LANES)
_NO_BYTES = ir.Constant(_BYTES, [0] * LANES)


class Float32x16(types.Type):
    """Numba type of sixteen float32 lanes."""

    def __init__(self) -> None:
        super().__init__(name="Float32x16")


class Int32x16(types.Type):
    """Numba type of sixteen int32 lanes; sums and products wrap."""

    def __init__(self) -> None:
        super().__init__(name="Int32x16")


vector, integers = Float32x16(), Int32x16()


@register_model(Float32x16)
class _Floats(models.PrimitiveModel):
    def __init__(self, dmm, fe_type) -> None:
        super().__init__(dmm, fe_type, FLOATS)


@register_model(Int32x16)
class _Integers(models.PrimitiveModel):
    def __init__(self, dmm, fe_type) -> None:
        super().__init__(dmm, fe_type, INTS)


def shuffle(builder, a, b, lanes):
    """Emit a vector of lanes of a (0 to 15) and b (16 to 31)."""
    return builder.shuffle_vector(a, b, ir.Constant(INTS, lanes))


def call(builder, name, *args, result: ir.Type = FLOATS):
    """Emit a call of an LLVM intrinsic, given its full name."""
    kind = ir.FunctionType(result, [arg.type for arg in args])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), args)


def pointer_to(context, builder, array_type, array, index, kind):
    """Return the address of an element of a C-contiguous array, as a pointer to a vector of `kind`."""
    data = cgutils.create_struct_proxy(array_type)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [index]), kind.as_pointer())


def _to_floats(builder, lanes):
    """Emit bytes as float32, via int32, from which the conversion is one instruction on all machines."""
    return builder.sitofp(builder.zext(lanes, INTS), FLOATS)


@intrinsic
def load(typingctx, array, index):
    """Load array[index : index + 16] of a float32 or uint8 array."""

    def codegen(context, builder, signature, args):
        is_byte = signature.args[0].dtype == types.uint8
        kind = _BYTES if is_byte else FLOATS
        pointer = pointer_to(context, builder, signature.args[0], args[0], args[1], kind)
        lanes = builder.load(pointer)
        lanes.align = 1 if is_byte else 4
        return _to_floats(builder, lanes) if is_byte else lanes

    return vector(array, types.intp), codegen


def storing(kind, lanes, align):
    """Return an intrinsic that stores the lanes of a vector to an array from an index on.

    `kind` is the type of the vector in LLVM, `lanes` that in numba, `align` the bytes of an element.
    """

    @intrinsic
    def store(typingctx, array, index, value):
        def codegen(context, builder, signature, args):
            pointer = pointer_to(context, builder, signature.args[0], args[0], args[1], kind)
            builder.store(args[2], pointer).align = align
            return context.get_dummy_value()

        return types.void(array, types.intp, lanes), codegen

    return store


# Store the lanes to array[index : index + 16] of a float32 array.
store = storing(FLOATS, vector, 4)


def _first_lanes(builder, count):
    """Emit the mask of the first `count` lanes."""
    empty = ir.Constant(INTS, ir.Undefined)
    count = builder.trunc(count, ir.IntType(32))
    counts = builder.insert_element(empty, count, ir.Constant(ir.IntType(32), 0))
    lanes = ir.Constant(INTS, list(range(LANES)))
    return builder.icmp_signed("<", lanes, shuffle(builder, counts, empty, [0] * LANES))


@intrinsic
def load_masked(typingctx, array, index, count):
    """Load the first `count` lanes, at most 16, from array[index] as `load` does; the others are 0."""

    def codegen(context, builder, signature, args):
        is_byte = signature.args[0].dtype == types.uint8
        kind, name, align = (_BYTES, "i8", 1) if is_byte else (FLOATS, "f32", 4)
        pointer = pointer_to(context, builder, signature.args[0], args[0], args[1], kind)
        name, mask = f"llvm.masked.load.v{LANES}{name}.p0", _first_lanes(builder, args[2])
        zeros = _NO_BYTES if is_byte else ZEROS
        lanes = call(builder, name, pointer, ir.Constant(ir.IntType(32), align), mask, zeros, result=kind)
        return _to_floats(builder, lanes) if is_byte else lanes

    return vector(array, types.intp, types.intp), codegen


@intrinsic
def store_masked(typingctx, array, index, count, value):
    """Store the first `count` lanes, at most 16, to array[index] of a float32 array."""

    def codegen(context, builder, signature, args):
        pointer = pointer_to(context, builder, signature.args[0], args[0], args[1], FLOATS)
        align, mask = ir.Constant(ir.IntType(32), 4), _first_lanes(builder, args[2])
        name = f"llvm.masked.store.v{LANES}f32.p0"
        return call(builder, name, args[3], pointer, align, mask, result=ir.VoidType())

    return types.void(array, types.intp, types.intp, vector), codegen


@intrinsic
def store_bytes(typingctx, array, index, count, value):
    """Store the first `count` lanes, 0 to below 256, to array[index : index + count] of a uint8 array.

    The fractions are cut off. A count above 16 is as 16.
    """

    def codegen(context, builder, signature, args):
        pointer = pointer_to(context, builder, signature.args[0], args[0], args[1], _BYTES)
        lanes = builder.trunc(builder.fptosi(args[3], INTS), _BYTES)
        align, mask = ir.Constant(ir.IntType(32), 1), _first_lanes(builder, args[2])
        name = f"llvm.masked.store.v{LANES}i8.p0"
        whole = builder.icmp_signed(">=", args[2], ir.Constant(args[2].type, LANES))
        with builder.if_else(whole) as (then, otherwise):
            with then:
                builder.store(lanes, pointer).align = 1
            with otherwise:
                call(builder, name, lanes, pointer, align, mask, result=ir.VoidType())
        return context.get_dummy_value()

    return types.void(array, types.intp, types.intp, vector), codegen


@intrinsic
def copy(typingctx, source, source_index, target, target_index):
    """Copy 16 elements between arrays of the same dtype."""

    def codegen(context, builder, signature, args):
        kind, align = (_BYTES, 1) if signature.args[0].dtype == types.uint8 else (FLOATS, 4)
        lanes = builder.load(pointer_to(context, builder, signature.args[0], args[0], args[1], kind))
        target = pointer_to(context, builder, signature.args[2], args[2], args[3], kind)
        lanes.align = builder.store(lanes, target).align = align
        return context.get_dummy_value()

    return types.void(source, types.intp, target, types.intp), codegen


@intrinsic
def prefetch(typingctx, array, index):
    """Load the cache line of array[index] of a float32 array ahead of time; the index may be out of range."""

    def codegen(context, builder, signature, args):
        pointer = pointer_to(context, builder, signature.args[0], args[0], args[1], FLOATS)
        word = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [pointer.type, word, word, word])
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
        builder.call(function, [pointer, word(1), word(3), word(1)])
        return context.get_dummy_value()

    return types.void(array, types.intp), codegen


def repeated(builder, kind, value):
    """Emit a vector of a type of LLVM with the same value in every lane."""
    empty, index = ir.Constant(kind, ir.Undefined), ir.IntType(32)
    first = builder.insert_element(empty, value, ir.Constant(index, 0))
    lanes = ir.Constant(ir.VectorType(index, kind.count), [0] * kind.count)
    return builder.shuffle_vector(first, empty, lanes)


@intrinsic
def splat(typingctx, value):
    """Return a vector with the same float32 or int32 in every lane."""
    kind, result = (FLOATS, vector) if value == types.float32 else (INTS, integers)

    def codegen(context, builder, signature, args):
        return repeated(builder, kind, args[0])

    return result(types.float32 if kind is FLOATS else types.int32), codegen


@intrinsic
def lane_numbers(typingctx):
    """Return the integers 0 to 15."""
    return integers(), lambda *_: ir.Constant(INTS, list(range(LANES)))


class _Places(ir.Instruction):
    """The addresses of bytes behind a common one; llvmlite's own instruction has no vectors.

    From a common address and indices of 32 bits, machines gather in one instruction.
    """

    def __init__(self, parent, base, indices) -> None:
        kind = ir.VectorType(ir.PointerType(), LANES)
        super().__init__(parent, kind, "getelementptr", [base, indices])

    def descr(self, buf) -> None:
        base, indices = self.operands
        text = f"{base.type} {base.get_reference()}, {indices.type} {indices.get_reference()}"
        buf.append(f"getelementptr i8, {text}\n")


@intrinsic
def gather_words(typingctx, array, indices):
    """Return the four bytes at array[index] to array[index + 3] for each lane, the first as lowest byte.

    `array` is a contiguous uint8 array of less than 2^31 bytes with three bytes behind the last index.
    """

    def codegen(context, builder, signature, args):
        data = cgutils.create_struct_proxy(signature.args[0])(context, builder, args[0]).data
        places = builder.sext(args[1], ir.VectorType(ir.IntType(64), LANES))
        pointers = _Places(builder.block, data, places)
        builder._insert(pointers)
        flag, all_lanes = ir.IntType(1), ir.VectorType(ir.IntType(1), LANES)
        return call(
            builder,
            f"llvm.masked.gather.v{LANES}i32.v{LANES}p0",
            pointers,
            ir.Constant(ir.IntType(32), 1),
            ir.Constant(all_lanes, [ir.Constant(flag, 1)] * LANES),
            ir.Constant(INTS, ir.Undefined),
            result=INTS,
        )

    return integers(array, integers), codegen


def elementwise(arity, emit, kind=vector, result_kind=None):
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


_add = elementwise(2, lambda b, x, y: b.fadd(x, y))
_sub = elementwise(2, lambda b, x, y: b.fsub(x, y))
_mul = elementwise(2, lambda b, x, y: b.fmul(x, y))
_div = elementwise(2, lambda b, x, y: b.fdiv(x, y))
# x * y + z, with a single rounding if the machine supports it.
madd = elementwise(3, lambda b, x, y, z: call(b, f"llvm.fmuladd.v{LANES}f32", x, y, z))
# |x|.
magnitude = elementwise(1, _abs)
# √x; no lane may be negative.
square_root = elementwise(1, lambda b, x: call(b, f"llvm.sqrt.v{LANES}f32", x))
# Larger of both lanes; neither may be NaN.
maximum = elementwise(2, lambda b, x, y: b.select(b.fcmp_ordered(">", x, y), x, y))
# x where x >= limit, else 0.
at_least = elementwise(2, lambda b, x, limit: b.select(b.fcmp_ordered(">=", x, limit), x, ZEROS))
# x where |x| >= limit, else 0.
clear_below = elementwise(2, lambda b, x, limit: b.select(b.fcmp_ordered(">=", _abs(b, x), limit), x, ZEROS))
# x where sign >= 0, else y.
select_by_sign = elementwise(3, lambda b, sign, x, y: b.select(b.fcmp_ordered(">=", sign, ZEROS), x, y))
# Smaller of both lanes; neither may be NaN.
minimum = elementwise(2, lambda b, x, y: b.select(b.fcmp_ordered("<", x, y), x, y))
# y where x > limit, else x.
replace_above = elementwise(3, lambda b, x, limit, y: b.select(b.fcmp_ordered(">", x, limit), y, x))
as_floats = elementwise(1, lambda b, x: b.sitofp(x, FLOATS), integers, vector)
# Rounded towards 0; the lanes are within the range of int32.
as_integers = elementwise(1, lambda b, x: b.fptosi(x, INTS), vector, integers)


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


def overload_operator(symbol, function, kind=vector) -> None:
    """Make a Python operator of two vectors call an intrinsic."""

    @overload(symbol)
    def implementation(a, b):
        return (lambda a, b: function(a, b)) if a == kind and b == kind else None


overload_operator(operator.add, _add)
overload_operator(operator.sub, _sub)
overload_operator(operator.mul, _mul)
overload_operator(operator.truediv, _div)
overload_operator(operator.add, elementwise(2, lambda b, x, y: b.add(x, y), integers), integers)
overload_operator(operator.mul, elementwise(2, lambda b, x, y: b.mul(x, y), integers), integers)
overload_operator(operator.and_, elementwise(2, lambda b, x, y: b.and_(x, y), integers), integers)
overload_operator(operator.lshift, elementwise(2, lambda b, x, y: b.shl(x, y), integers), integers)
# Fills with zeros: the lanes are read as unsigned numbers.
overload_operator(operator.rshift, elementwise(2, lambda b, x, y: b.lshr(x, y), integers), integers)


@register_jitable
def load_part(array, index, count):
    """Load array[index : index + count] of a float32 or uint8 array, at most 16; the other lanes are 0."""
    return load(array, index) if count >= LANES else load_masked(array, index, count)


@register_jitable
def store_part(array, index, count, value):
    """Store the first `count` lanes, at most 16, to array[index : index + count] of a float32 array."""
    if count >= LANES:
        store(array, index, value)
    else:
        store_masked(array, index, count, value)
