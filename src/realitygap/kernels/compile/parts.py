"""Tuples and arrays as their parts while a kernel is lowered, and calls that pass only the parts that are used.

Numba passes a tuple of a hundred arrays as seven hundred numbers, takes it apart for each call and puts it together
in each function. These were two thirds of all instructions. Here a value is put together only for an instruction
that needs it whole, and a function has an argument for each number that it uses, and for no other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import fix_returning_optional
from numba.np import arrayobj

if TYPE_CHECKING:
    from numba.core import typing
    from numba.core.codegen import JITCodeLibrary
    from numba.core.cpu import CPUContext
    from numba.core.funcdesc import PythonFunctionDescriptor

# Members of Numba's struct of an array.
MEMINFO, PARENT, N_ITEMS, ITEM_SIZE, DATA, SHAPE, STRIDES = range(7)

Made = Callable[[ir.IRBuilder], ir.Value]
"""A function that makes a member in the current block."""

# What a function returns that raised nothing.
_SUCCESS = {0, -2}


class Parts:
    """A tuple or an array of which each member is known: a value, `Parts`, or a function that makes it."""

    __slots__ = ("members", "type")

    def __init__(self, llvm_type: ir.Type, members: list[Lowered | Made]) -> None:
        self.type = llvm_type
        self.members = members

    def member(self, builder: ir.IRBuilder, index: int) -> Lowered:
        """Return a member, made by the current block if it must be made."""
        value = self.members[index]
        return value(builder) if callable(value) else value

    def whole(self, builder: ir.IRBuilder) -> ir.Value:
        """Put the value together."""
        value = ir.Constant(self.type, ir.Undefined)
        for index in range(len(self.members)):
            value = ir.IRBuilder.insert_value(
                builder, value, _whole(builder, self.member(builder, index)), index
            )
        return value


Lowered = ir.Value | Parts
"""A value while a kernel is lowered."""


def _whole(builder: ir.IRBuilder, value: Lowered) -> ir.Value:
    return value.whole(builder) if isinstance(value, Parts) else value


def _count(aggregate: ir.Aggregate) -> int:
    return aggregate.count if isinstance(aggregate, ir.ArrayType) else len(aggregate.elements)


class PartsBuilder(ir.IRBuilder):
    """Builds instructions from values some of which are `Parts`."""

    def extract_value(self, agg: Lowered, idx: int | Sequence[int], name: str = "") -> Lowered:
        """Return a member; an instruction is needed only where the value is no `Parts`."""
        path = list(idx) if isinstance(idx, (tuple, list)) else [idx]
        while path and isinstance(agg, Parts):
            agg = agg.member(self, path.pop(0))
        return super().extract_value(agg, path, name) if path else agg

    def insert_value(self, agg: Lowered, value: Lowered, idx: int | Sequence[int], name: str = "") -> Lowered:
        """Return `agg` with another member."""
        index = idx[0] if isinstance(idx, (tuple, list)) and len(idx) == 1 else idx
        if isinstance(index, int):
            if isinstance(agg, Parts):
                members = list(agg.members)
            elif isinstance(agg, ir.Constant) and agg.constant in (None, ir.Undefined):
                kinds = [agg.type.gep(ir.IntType(32)(k)) for k in range(_count(agg.type))]
                members = [ir.Constant(kind, agg.constant) for kind in kinds]
            else:
                return super().insert_value(agg, _whole(self, value), idx, name)
            members[index] = value
            return Parts(agg.type, members)
        return super().insert_value(_whole(self, agg), _whole(self, value), idx, name)

    def _insert(self, instr: ir.Instruction) -> None:
        if any(isinstance(operand, Parts) for operand in instr.operands):
            instr.operands = [_whole(self, operand) for operand in instr.operands]
        super()._insert(instr)


# arrays


def is_plain(array: types.Type) -> bool:
    """Whether a type is an array of numbers in C order or with any strides."""
    return (
        type(array) is types.Array
        and array.layout in "CA"
        and isinstance(array.dtype, (types.Number, types.Boolean))
    )


def array_parts(
    context: CPUContext,
    array: types.Type,
    data: ir.Value | Made,
    shape: list[ir.Value | Made],
    strides: list[ir.Value | Made] | None,
) -> Parts:
    """Return an array of these parts, which holds nothing alive.

    Args:
        context: Numba's, of the target.
        array: Type.
        data, shape, strides: Values, or functions that make them; no strides in C order.
    """
    model = context.data_model_manager[array]
    kinds = model.get_value_type().elements
    # Numba asks LLVM, which parses a module for it.
    item_size = 1 if array.dtype == types.boolean else array.dtype.bitwidth // 8

    def product(first: int, start: int) -> Made:
        def make(builder: ir.IRBuilder) -> ir.Value:
            value = kinds[N_ITEMS](start)
            for length in shape[first:]:
                value = builder.mul(value, length(builder) if callable(length) else length)
            return value

        return make

    if strides is None:
        strides = [product(k + 1, item_size) for k in range(array.ndim)]
    return Parts(
        model.get_value_type(),
        [
            ir.Constant(kinds[MEMINFO], None),
            ir.Constant(kinds[PARENT], None),
            product(0, 1),
            kinds[ITEM_SIZE](item_size),
            data,
            Parts(kinds[SHAPE], list(shape)),
            Parts(kinds[STRIDES], list(strides)),
        ],
    )


def locate(
    context: CPUContext,
    builder: ir.IRBuilder,
    array: types.Type,
    value: Lowered,
    kinds: Sequence[types.Type],
    indices: list[ir.Value],
) -> ir.Value:
    """Return the address of the item, or of the first item of the view, at whole numbers as indices."""
    data = builder.extract_value(value, DATA)
    if array.layout == "C":
        lengths = [builder.extract_value(value, [SHAPE, k]) for k in range(array.ndim)]
    places = []
    for k, (kind, index) in enumerate(zip(kinds, indices, strict=True)):
        place = context.cast(builder, index, kind, types.intp if kind.signed else types.uintp)
        if kind.signed and not (isinstance(place, ir.Constant) and place.constant >= 0):
            length = builder.extract_value(value, [SHAPE, k])
            negative = builder.icmp_signed("<", place, place.type(0))
            place = builder.select(negative, builder.add(place, length), place)
        places.append(place)
    if array.layout == "C":
        offset = places[0]
        for place, length in zip(places[1:], lengths[1:], strict=False):
            offset = builder.add(builder.mul(offset, length), place)
        for length in lengths[len(places) :]:
            offset = builder.mul(offset, length)
        return builder.gep(data, [offset])
    offset = places[0].type(0)
    for k, place in enumerate(places):
        offset = builder.add(offset, builder.mul(place, builder.extract_value(value, [STRIDES, k])))
    return cgutils.pointer_add(builder, data, offset)


def item(
    context: CPUContext,
    builder: ir.IRBuilder,
    result: types.Type,
    array: types.Type,
    value: Lowered,
    kinds: Sequence[types.Type],
    indices: list[ir.Value],
) -> Lowered:
    """Return the item or the view of type `result` at whole numbers as indices."""
    address = locate(context, builder, array, value, kinds, indices)
    if not isinstance(result, types.Array):
        return arrayobj.load_item(context, builder, array, address)
    rest = range(len(kinds), array.ndim)
    shape = [builder.extract_value(value, [SHAPE, k]) for k in rest]
    strides = None if result.layout == "C" else [builder.extract_value(value, [STRIDES, k]) for k in rest]
    return array_parts(context, result, address, shape, strides)


# loops


class Loop(Parts):
    """The iterator of a range whose step is a number in the source."""

    __slots__ = ()


def make_range(context: CPUContext, kind: types.Type, values: list[ir.Value]) -> Parts:
    """Return the range of one, two or three numbers of its type."""
    first = context.get_constant(kind.dtype, 0)
    step = context.get_constant(kind.dtype, 1)
    values = [first, *values, step] if len(values) == 1 else [*values, step][:3]
    return Parts(context.get_value_type(kind), values)


def begin_loop(context: CPUContext, builder: ir.IRBuilder, kind: types.Type, value: Lowered) -> Loop | None:
    """Return the iterator over a range, or None if it needs the checks that Numba makes."""
    if not (isinstance(kind, types.RangeType) and kind.dtype.signed and isinstance(value, Parts)):
        return None
    start, stop, step = value.members
    if not (isinstance(step, ir.Constant) and step.constant):
        return None
    with builder.goto_entry_block():
        counter = builder.alloca(start.type)
    builder.store(start, counter)
    return Loop(context.get_value_type(kind.iterator_type), [counter, stop, step])


def next_of_loop(context: CPUContext, builder: ir.IRBuilder, kind: types.Type, loop: Loop) -> Parts:
    """Return the next number, and whether the range has one; Numba asks no more after the last."""
    counter, stop, step = loop.members
    number = builder.load(counter)
    is_valid = builder.icmp_signed("<" if step.constant > 0 else ">", number, stop)
    builder.store(builder.add(number, step, flags=["nsw"] if abs(step.constant) == 1 else []), counter)
    return Parts(context.get_value_type(kind), [number, is_valid])


# arguments


class Leaf(NamedTuple):
    """A number that a function uses: the argument of which it is part, and the members that lead to it."""

    argument: int
    path: tuple[int, ...]


class Arguments:
    """The arguments of a function that is being lowered, added as they are used."""

    def __init__(
        self,
        context: CPUContext,
        function: ir.Function,
        kinds: Sequence[types.Type],
        pointer_attributes: ir.ArgumentAttributes,
    ) -> None:
        self._context = context
        self._function = function
        self._pointer_attributes = pointer_attributes
        self._added: dict[Leaf, ir.Argument] = {}
        self.values = [self._value(kind, k, ()) for k, kind in enumerate(kinds)]
        self.values = [value(None) if callable(value) else value for value in self.values]

    def _value(self, kind: types.Type, argument: int, path: tuple[int, ...]) -> Parts | Made | None:
        def leaf(llvm_type: ir.Type, *more: int) -> Made:
            return lambda _: self._add(Leaf(argument, (*path, *more)), llvm_type)

        if isinstance(kind, types.Omitted):
            return None
        whole = self._context.get_value_type(kind)
        if isinstance(kind, types.BaseTuple):
            return Parts(whole, [self._value(part, argument, (*path, k)) for k, part in enumerate(kind)])
        if is_plain(kind):
            parts = whole.elements
            shape = [leaf(parts[SHAPE].element, SHAPE, k) for k in range(kind.ndim)]
            strides = None
            if kind.layout != "C":
                strides = [leaf(parts[STRIDES].element, STRIDES, k) for k in range(kind.ndim)]
            return array_parts(self._context, kind, leaf(parts[DATA], DATA), shape, strides)
        return leaf(whole)

    def _add(self, leaf: Leaf, llvm_type: ir.Type) -> ir.Argument:
        if leaf not in self._added:
            argument = self._added[leaf] = ir.Argument(self._function, llvm_type)
            if isinstance(llvm_type, ir.PointerType):
                argument.attributes.update(self._pointer_attributes)
        return self._added[leaf]

    def finish(self) -> list[Leaf]:
        """Give the function the arguments that it uses, and return them."""
        function = self._function
        function.args = (*function.args, *self._added.values())
        function.ftype = ir.FunctionType(function.ftype.return_type, [value.type for value in function.args])
        function.type = function.ftype.as_pointer()
        return list(self._added)


def raises(function: ir.Function) -> bool:
    """Whether a function can return anything but success or None."""
    ends: Iterator[ir.Instruction | None] = (block.terminator for block in function.blocks)
    codes = [end.operands[0] for end in ends if end is not None and end.opname == "ret"]
    return not all(isinstance(code, ir.Constant) and code.constant in _SUCCESS for code in codes)


def _type_of(context: CPUContext, kind: types.Type, path: tuple[int, ...]) -> ir.Type:
    llvm_type = context.get_value_type(kind)
    for index in path:
        llvm_type = llvm_type.gep(ir.IntType(32)(index))
    return llvm_type


def caller_of(
    context: CPUContext,
    fndesc: PythonFunctionDescriptor,
    leaves: list[Leaf],
    can_raise: bool,
    libraries: list[JITCodeLibrary],
) -> Callable[..., Lowered]:
    """Return what inserts a call of a function with arguments for `leaves` alone."""
    convention = context.call_conv.get_function_type(fndesc.restype, ())
    kinds = [_type_of(context, fndesc.argtypes[k], path) for k, path in leaves]
    # The code that is returned tells a number from None.
    can_raise = can_raise or isinstance(fndesc.restype, types.Optional)
    llvm_type = ir.FunctionType(convention.return_type, [*convention.args, *kinds])

    def call(
        context: CPUContext, builder: ir.IRBuilder, sig: typing.Signature, args: Sequence[Lowered]
    ) -> Lowered:
        function = cgutils.get_or_insert_function(builder.module, llvm_type, fndesc.mangled_name)
        if fndesc.inline:
            function.attributes.add("alwaysinline")
        values = [builder.extract_value(args[k], path) if path else args[k] for k, path in leaves]
        result_type, raised_type = llvm_type.args[0].pointee, llvm_type.args[1].pointee
        is_void = fndesc.restype in (types.none, types.void)
        with builder.goto_entry_block():
            result = builder.alloca(result_type)
            raised = builder.alloca(raised_type) if can_raise else ir.Constant(llvm_type.args[1], None)
        if can_raise:
            builder.store(ir.Constant(raised_type, None), raised)
        code = builder.call(function, [result, raised, *values])
        value = context.get_dummy_value()
        if can_raise:
            status = context.call_conv._get_return_status(builder, code, builder.load(raised))
            with cgutils.if_unlikely(builder, status.is_error):
                context.call_conv.return_status_propagate(builder, status)
        if not is_void:
            value = context.get_returned_value(builder, fndesc.restype, builder.load(result))
            if isinstance(fndesc.restype, types.Optional):
                value = fix_returning_optional(context, builder, sig, status, value)
        return value

    call.signature = fndesc.argtypes
    call.libs = tuple(libraries)
    return call
