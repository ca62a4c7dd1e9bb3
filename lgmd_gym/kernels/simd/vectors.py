"""The vector types, and how lanes are read from arrays, written to them and made from scalars."""

from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.core import cgutils
from numba.extending import models, register_model

# Any, because a decorated function is called without its typing context.
intrinsic: Any = extending.intrinsic

LANES = 16
FLOATS = ir.VectorType(ir.FloatType(), LANES)
INTS = ir.VectorType(ir.IntType(32), LANES)
_BYTES = ir.VectorType(ir.IntType(8), LANES)
ZEROS = ir.Constant(FLOATS, [0.0] * LANES)


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


def _pointer(context, builder, array_type, array, index, kind):
    """Return the address of an element of a C-contiguous array, as a pointer to a vector of `kind`."""
    data = cgutils.create_struct_proxy(array_type)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [index]), kind.as_pointer())


@intrinsic
def load(typingctx, array, index):
    """Load array[index : index + 16] of a float32 or uint8 array."""

    def codegen(context, builder, signature, args):
        is_byte = signature.args[0].dtype == types.uint8
        kind = _BYTES if is_byte else FLOATS
        pointer = _pointer(context, builder, signature.args[0], args[0], args[1], kind)
        lanes = builder.load(pointer)
        lanes.align = 1 if is_byte else 4
        # Via int32, from which the conversion is one instruction on all machines.
        return builder.sitofp(builder.zext(lanes, INTS), FLOATS) if is_byte else lanes

    return vector(array, types.intp), codegen


@intrinsic
def store(typingctx, array, index, value):
    """Store the lanes to array[index : index + 16] of a float32 array."""

    def codegen(context, builder, signature, args):
        pointer = _pointer(context, builder, signature.args[0], args[0], args[1], FLOATS)
        builder.store(args[2], pointer).align = 4
        return context.get_dummy_value()

    return types.void(array, types.intp, vector), codegen


def _first_lanes(builder, count):
    """Emit the mask of the first `count` lanes."""
    empty = ir.Constant(INTS, ir.Undefined)
    count = builder.trunc(count, ir.IntType(32))
    counts = builder.insert_element(empty, count, ir.Constant(ir.IntType(32), 0))
    lanes = ir.Constant(INTS, list(range(LANES)))
    return builder.icmp_signed("<", lanes, shuffle(builder, counts, empty, [0] * LANES))


@intrinsic
def load_masked(typingctx, array, index, count):
    """Load the first `count` lanes, at most 16, from array[index] of a float32 array; the others are 0."""

    def codegen(context, builder, signature, args):
        pointer = _pointer(context, builder, signature.args[0], args[0], args[1], FLOATS)
        align, mask = ir.Constant(ir.IntType(32), 4), _first_lanes(builder, args[2])
        return call(builder, f"llvm.masked.load.v{LANES}f32.p0", pointer, align, mask, ZEROS)

    return vector(array, types.intp, types.intp), codegen


@intrinsic
def store_masked(typingctx, array, index, count, value):
    """Store the first `count` lanes, at most 16, to array[index] of a float32 array."""

    def codegen(context, builder, signature, args):
        pointer = _pointer(context, builder, signature.args[0], args[0], args[1], FLOATS)
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
        pointer = _pointer(context, builder, signature.args[0], args[0], args[1], _BYTES)
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
        lanes = builder.load(_pointer(context, builder, signature.args[0], args[0], args[1], kind))
        target = _pointer(context, builder, signature.args[2], args[2], args[3], kind)
        lanes.align = builder.store(lanes, target).align = align
        return context.get_dummy_value()

    return types.void(source, types.intp, target, types.intp), codegen


@intrinsic
def splat(typingctx, value):
    """Return a vector with the same float32 or int32 in every lane."""
    kind, result = (FLOATS, vector) if value == types.float32 else (INTS, integers)

    def codegen(context, builder, signature, args):
        empty = ir.Constant(kind, ir.Undefined)
        first = builder.insert_element(empty, args[0], ir.Constant(ir.IntType(32), 0))
        return shuffle(builder, first, empty, [0] * LANES)

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
