"""Vectors: one number of each of 16 lanes as a single value, for loops whose results stay in registers.

LLVM takes the lanes of an inner loop side by side, and its rows pass through memory from one such loop to the next.
A loop over corners or faces within 16 lanes keeps its minimum in registers. Vectors have `+`, `-`, `*`, `<` and the
functions here. They give the results of the loops over lanes to the last bit. Without Numba they are arrays.
"""

from __future__ import annotations

import operator

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model

from .lanes import LANES

WIDTH = 16  # lanes of a vector: 512 bits in single precision; processors with shorter ones take it in parts

if numba.config.DISABLE_JIT:

    def load(rows, row, lane):
        """The numbers of a row of (n, LANES) from a lane on."""
        return rows[row, lane : lane + WIDTH].copy()

    def load_row(row, lane):
        """The numbers of a (LANES,) row from a lane on."""
        return row[lane : lane + WIDTH].copy()

    def store(vector, rows, row, lane):
        """Write the numbers of a vector to a row of (n, LANES)."""
        rows[row, lane : lane + WIDTH] = vector

    def store_row(vector, row, lane):
        """Write the numbers of a vector to a (LANES,) row."""
        row[lane : lane + WIDTH] = vector

    def spread(number):
        """The same number in each lane."""
        return np.full(WIDTH, number, type(number))

    def pick(mask, yes, no):
        """In each lane the number of `yes` or of `no`."""
        return np.where(mask, yes, no)

    def root(vector):
        """Square roots."""
        return np.sqrt(vector)

    def any_of(mask):
        """Whether a mask has any lane."""
        return bool(mask.any())

else:

    class Vector(types.Type):
        """`WIDTH` numbers of a precision, or truth values."""

        def __init__(self, dtype):
            self.dtype = dtype
            super().__init__(f"vector of {WIDTH} {dtype}")

    @register_model(Vector)
    class _VectorModel(models.PrimitiveModel):
        def __init__(self, manager, kind):
            number = {
                types.float32: ir.FloatType(),
                types.float64: ir.DoubleType(),
                types.boolean: ir.IntType(1),
            }
            super().__init__(manager, kind, ir.VectorType(number[kind.dtype], WIDTH))

    _MASK = Vector(types.boolean)

    def _operator(operation, is_mask, to_mask, instruction, *options):
        class Template(AbstractTemplate):
            def generic(self, arguments, named):
                first = arguments[0]
                masks = isinstance(first, Vector) and first == _MASK
                if (
                    isinstance(first, Vector)
                    and masks == is_mask
                    and all(kind == first for kind in arguments)
                ):
                    return signature(_MASK if to_mask else first, *arguments)
                return None

        infer_global(operation)(Template)

        def lower(context, builder, signature, arguments):
            return getattr(builder, instruction)(*options, *arguments)

        count = 1 if operation is operator.neg else 2
        lower_builtin(operation, *[Vector] * count)(lower)

    _operator(operator.add, False, False, "fadd")
    _operator(operator.sub, False, False, "fsub")
    _operator(operator.mul, False, False, "fmul")
    _operator(operator.truediv, False, False, "fdiv")
    _operator(operator.neg, False, False, "fneg")
    _operator(operator.lt, False, True, "fcmp_ordered", "<")
    _operator(operator.le, False, True, "fcmp_ordered", "<=")
    _operator(operator.gt, False, True, "fcmp_ordered", ">")
    _operator(operator.eq, False, True, "fcmp_ordered", "==")
    _operator(operator.and_, True, True, "and_")
    _operator(operator.or_, True, True, "or_")

    def _pointer(context, builder, kind, array, index):
        data = context.make_array(kind)(context, builder, array).data
        place = builder.gep(data, [index])
        return builder.bitcast(place, context.get_value_type(Vector(kind.dtype)).as_pointer())

    def _in_row(builder, row, lane):
        """The index of a lane of a row, without a check for one below zero."""
        return builder.add(builder.mul(row, row.type(LANES)), lane)

    def _as_index(context, builder, value, kind):
        return context.cast(builder, value, kind, types.intp)

    def _load(context, builder, kind, array, index):
        value = builder.load(_pointer(context, builder, kind, array, index))
        value.align = kind.dtype.bitwidth // 8
        return value

    def _store(context, builder, vector, kind, array, index):
        stored = builder.store(vector, _pointer(context, builder, kind, array, index))
        stored.align = kind.dtype.bitwidth // 8
        return context.get_dummy_value()

    @intrinsic
    def load(context, rows, row, lane):
        """The numbers of a row of (n, LANES) from a lane on."""

        def generate(context, builder, signature, arguments):
            kind, *kinds = signature.args
            row, lane = (
                _as_index(context, builder, *pair) for pair in zip(arguments[1:], kinds, strict=True)
            )
            index = _in_row(builder, row, lane)
            return _load(context, builder, kind, arguments[0], index)

        return Vector(rows.dtype)(rows, row, lane), generate

    @intrinsic
    def load_row(context, row, lane):
        """The numbers of a (LANES,) row from a lane on."""

        def generate(context, builder, signature, arguments):
            index = _as_index(context, builder, arguments[1], signature.args[1])
            return _load(context, builder, signature.args[0], arguments[0], index)

        return Vector(row.dtype)(row, lane), generate

    @intrinsic
    def store(context, vector, rows, row, lane):
        """Write the numbers of a vector to a row of (n, LANES)."""

        def generate(context, builder, signature, arguments):
            _, kind, *kinds = signature.args
            row, lane = (
                _as_index(context, builder, *pair) for pair in zip(arguments[2:], kinds, strict=True)
            )
            index = _in_row(builder, row, lane)
            return _store(context, builder, arguments[0], kind, arguments[1], index)

        return types.void(vector, rows, row, lane), generate

    @intrinsic
    def store_row(context, vector, row, lane):
        """Write the numbers of a vector to a (LANES,) row."""

        def generate(context, builder, signature, arguments):
            index = _as_index(context, builder, arguments[2], signature.args[2])
            return _store(context, builder, arguments[0], signature.args[1], arguments[1], index)

        return types.void(vector, row, lane), generate

    @intrinsic
    def spread(context, number):
        """The same number in each lane."""

        def generate(context, builder, signature, arguments):
            vector = context.get_value_type(signature.return_type)
            undefined = ir.Constant(vector, ir.Undefined)
            first = builder.insert_element(undefined, arguments[0], ir.IntType(32)(0))
            order = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
            return builder.shuffle_vector(first, undefined, order)

        return Vector(number)(number), generate

    @intrinsic
    def pick(context, mask, yes, no):
        """In each lane the number of `yes` or of `no`."""

        def generate(context, builder, signature, arguments):
            return builder.select(*arguments)

        return yes(mask, yes, no), generate

    @intrinsic
    def root(context, vector):
        """Square roots."""

        def generate(context, builder, signature, arguments):
            kind = arguments[0].type
            name = f"llvm.sqrt.v{WIDTH}f{signature.args[0].dtype.bitwidth}"
            function = cgutils.get_or_insert_function(builder.module, ir.FunctionType(kind, [kind]), name)
            return builder.call(function, arguments)

        return vector(vector), generate

    @intrinsic
    def any_of(context, mask):
        """Whether a mask has any lane."""

        def generate(context, builder, signature, arguments):
            word = ir.IntType(WIDTH)
            return builder.icmp_unsigned("!=", builder.bitcast(arguments[0], word), word(0))

        return types.boolean(mask), generate
