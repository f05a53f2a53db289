"""Calls of kernels from Python: a loop over a table unpacks the arguments into memory, from which kernels load.

Numba's wrapper has code for each number of each argument: seven thousand instructions for a hundred and seventy arrays.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import llvmlite.binding
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.callwrapper import PyCallWrapper

from .parts import SHAPE, Arguments, Leaf, is_plain

# The memory of a number, and of each member of Numba's struct of an array [bytes].
SLOT = 8
MOST_NESTED = 8  # tuples within each other

TUPLE, END, ARRAY, DOUBLE, SINGLE, SIGNED, UNSIGNED, TRUTH = range(8)

# Unpacks the items of a tuple as the rows of a table say: kind, index, place in memory, and size of an array's items.
# It returns 0, or 1 if an argument does not fit. Then Python's error may be set.
UNPACK = "realitygap.unpack"
_UNPACK_IR = f"""
declare ptr @PyTuple_GetItem(ptr, i64)
declare ptr @PyErr_Occurred()
declare ptr @PyNumber_Long(ptr)
declare i64 @PyLong_AsLongLong(ptr)
declare i64 @PyLong_AsUnsignedLongLong(ptr)
declare double @PyFloat_AsDouble(ptr)
declare i32 @PyObject_IsTrue(ptr)
declare void @Py_DecRef(ptr)
declare i32 @numba_adapt_ndarray(ptr, ptr)

define linkonce_odr i32 @"{UNPACK}"(ptr %items, ptr %table, i32 %n, ptr %memory) {{
entry:
  %stack = alloca [{MOST_NESTED} x ptr]
  store ptr %items, ptr %stack
  br label %row
row:
  %k = phi i32 [ 0, %entry ], [ %next, %done ]
  %depth = phi i32 [ 0, %entry ], [ %depth_after, %done ]
  %is_end = icmp sge i32 %k, %n
  br i1 %is_end, label %good, label %begin
begin:
  %at = mul i32 %k, 4
  %kind_at = getelementptr i32, ptr %table, i32 %at
  %kind = load i32, ptr %kind_at
  %index_at = getelementptr i32, ptr %kind_at, i32 1
  %index = load i32, ptr %index_at
  %place_at = getelementptr i32, ptr %kind_at, i32 2
  %place = load i32, ptr %place_at
  %size_at = getelementptr i32, ptr %kind_at, i32 3
  %size = load i32, ptr %size_at
  %to = getelementptr i8, ptr %memory, i32 %place
  %is_pop = icmp eq i32 %kind, {END}
  %less = sub i32 %depth, 1
  br i1 %is_pop, label %done, label %get
get:
  %top_at = getelementptr ptr, ptr %stack, i32 %depth
  %top = load ptr, ptr %top_at
  %wide = sext i32 %index to i64
  %item = call ptr @PyTuple_GetItem(ptr %top, i64 %wide)
  %is_missing = icmp eq ptr %item, null
  br i1 %is_missing, label %bad, label %choose
choose:
  switch i32 %kind, label %bad [
    i32 {TUPLE}, label %tuple
    i32 {ARRAY}, label %array
    i32 {DOUBLE}, label %double
    i32 {SINGLE}, label %single
    i32 {SIGNED}, label %signed
    i32 {UNSIGNED}, label %unsigned
    i32 {TRUTH}, label %truth
  ]
tuple:
  %more = add i32 %depth, 1
  %push_at = getelementptr ptr, ptr %stack, i32 %more
  store ptr %item, ptr %push_at
  br label %done
array:
  %code = call i32 @numba_adapt_ndarray(ptr %item, ptr %to)
  %is_no_array = icmp ne i32 %code, 0
  br i1 %is_no_array, label %bad, label %sized
sized:
  %item_size_at = getelementptr i8, ptr %to, i32 {3 * SLOT}
  %item_size = load i64, ptr %item_size_at
  %expected = sext i32 %size to i64
  %is_other = icmp ne i64 %item_size, %expected
  br i1 %is_other, label %bad, label %done
double:
  %real = call double @PyFloat_AsDouble(ptr %item)
  store double %real, ptr %to
  br label %check
single:
  %long_real = call double @PyFloat_AsDouble(ptr %item)
  %short_real = fptrunc double %long_real to float
  store float %short_real, ptr %to
  br label %check
signed:
  %whole = call ptr @PyNumber_Long(ptr %item)
  %number = call i64 @PyLong_AsLongLong(ptr %whole)
  call void @Py_DecRef(ptr %whole)
  store i64 %number, ptr %to
  br label %check
unsigned:
  %natural = call ptr @PyNumber_Long(ptr %item)
  %count = call i64 @PyLong_AsUnsignedLongLong(ptr %natural)
  call void @Py_DecRef(ptr %natural)
  store i64 %count, ptr %to
  br label %check
truth:
  %answer = call i32 @PyObject_IsTrue(ptr %item)
  %is_true = sext i32 %answer to i64
  store i64 %is_true, ptr %to
  br label %check
check:
  %error = call ptr @PyErr_Occurred()
  %is_error = icmp ne ptr %error, null
  br i1 %is_error, label %bad, label %done
done:
  %depth_after = phi i32 [ %less, %begin ], [ %more, %tuple ], [ %depth, %sized ], [ %depth, %check ]
  %next = add i32 %k, 1
  br label %row
good:
  ret i32 0
bad:
  ret i32 1
}}
"""


class Layout(NamedTuple):
    """The layout of unpacked arguments in memory."""

    table: list[int]  # four numbers for each row
    # Place of each array or number, by argument and members [bytes], and the number of dimensions.
    places: dict[tuple[int, tuple[int, ...]], tuple[int, int]]
    size: int  # [bytes]


def lay_out(kinds: Any) -> Layout | None:
    """Return how arguments of these types are unpacked, or None if one is not of numbers, arrays and tuples of them."""
    layout = Layout([], {}, 0)
    for argument, kind in enumerate(kinds):
        extended = _add(layout, kind, argument, (), argument)
        if extended is None:
            return None
        layout = extended
    return layout


def _add(layout: Layout, kind: Any, argument: int, path: tuple[int, ...], index: int) -> Layout | None:
    place = layout.size
    if isinstance(kind, types.BaseTuple):
        if len(path) + 2 > MOST_NESTED:
            return None
        layout.table.extend((TUPLE, index, 0, 0))
        extended: Layout | None = layout
        for k, part in enumerate(kind):
            extended = _add(extended, part, argument, (*path, k), k)
            if extended is None:
                return None
        layout.table.extend((END, 0, 0, 0))
        return extended
    size, item_size, n_dimensions = SLOT, 0, 0
    if is_plain(kind):
        code, size, n_dimensions = ARRAY, SLOT * (SHAPE + 2 * kind.ndim), kind.ndim
        item_size = 1 if kind.dtype == types.boolean else kind.dtype.bitwidth // 8
    elif kind == types.boolean:
        code = TRUTH
    elif type(kind) is types.Integer:
        code = SIGNED if kind.signed else UNSIGNED
    elif kind in (types.float32, types.float64):
        code = SINGLE if kind == types.float32 else DOUBLE
    else:
        return None
    layout.table.extend((code, index, place, item_size))
    layout.places[argument, path] = place, n_dimensions
    return layout._replace(size=place + size)


class UnpackedArguments(Arguments):
    """The arguments of a function that Python calls, loaded from memory as they are used."""

    def __init__(self, context: Any, builder: Any, kinds: Any, layout: Layout, memory: Any) -> None:
        self._builder = builder
        self._layout = layout
        self._memory = memory
        super().__init__(context, None, kinds, ())

    def _add(self, leaf: Leaf, llvm_type: Any) -> Any:
        if leaf not in self._added:
            with self._builder.goto_entry_block():
                self._added[leaf] = self._load(leaf, llvm_type)
        return self._added[leaf]

    def _load(self, leaf: Leaf, llvm_type: Any) -> Any:
        builder, path = self._builder, leaf.path
        while (leaf.argument, path) not in self._layout.places:
            path = path[:-1]
        place, n_dimensions = self._layout.places[leaf.argument, path]
        member = leaf.path[len(path) :]
        if member:
            place += SLOT * (sum(member) if member[0] <= SHAPE else SHAPE + n_dimensions + member[1])
        address = builder.gep(self._memory, [ir.IntType(32)(place)])
        is_short = isinstance(llvm_type, ir.IntType) and llvm_type.width < 8 * SLOT
        stored = ir.IntType(8 * SLOT) if is_short else llvm_type
        value = builder.load(builder.bitcast(address, stored.as_pointer()))
        return builder.trunc(value, llvm_type) if is_short else value


class _Wrapper(PyCallWrapper):  # type: ignore[misc]
    """Numba's wrapper, with other code for the arguments."""

    layout: Layout

    def build_wrapper(self, api: Any, builder: Any, closure: Any, args: Any, kws: Any) -> None:
        number = ir.IntType(32)
        environment = self.get_env(api, builder)
        memory = builder.alloca(ir.IntType(8), size=max(self.layout.size, 1))
        memory.align = SLOT
        rows = ir.ArrayType(number, len(self.layout.table))
        table = cgutils.global_constant(builder, "unpack.table", rows(self.layout.table))
        kind = ir.FunctionType(number, [args.type, number.as_pointer(), number, memory.type])
        unpack = cgutils.get_or_insert_function(builder.module, kind, UNPACK)
        n_rows = number(len(self.layout.table) // 4)
        code = builder.call(unpack, [args, builder.bitcast(table, number.as_pointer()), n_rows, memory])
        with cgutils.if_unlikely(builder, cgutils.is_not_null(builder, code)):
            with cgutils.if_unlikely(builder, cgutils.is_null(builder, api.err_occurred())):
                api.err_set_string(
                    "PyExc_TypeError", "An argument of a kernel has another type than expected"
                )
            builder.ret(api.get_null_object())
        if self.release_gil:
            thread = api.save_thread()
        convention = self.context.call_conv
        status, value = convention.call_function(
            builder, self.func, self.fndesc.restype, (types.voidptr,), [memory], attrs=("noinline",)
        )
        if self.release_gil:
            api.restore_thread(thread)
        with builder.if_then(status.is_ok, likely=True):
            with builder.if_then(status.is_none):
                api.return_none()
            kind = self._simplified_return_type()
            builder.ret(api.from_native_return(kind, value, environment))
        convention.raise_error(builder, api, status)
        builder.ret(api.get_null_object())


def add_wrapper(context: Any, library: Any, fndesc: Any, env: Any, release_gil: bool, layout: Layout) -> None:
    """Add to a library what Python calls, for a function that takes the address of its arguments."""
    module = context.create_module("wrapper")
    kind = context.call_conv.get_function_type(fndesc.restype, (types.voidptr,))
    function = ir.Function(module, kind, fndesc.llvm_func_name)
    wrapper = _Wrapper(context, module, function, fndesc, env, call_helper=None, release_gil=release_gil)
    wrapper.layout = layout
    wrapper.build()
    library.add_ir_module(module)
    library.add_llvm_module(llvmlite.binding.parse_assembly(_UNPACK_IR))
