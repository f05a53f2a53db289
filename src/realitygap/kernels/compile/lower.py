"""Lower Numba's instructions to LLVM's, with less detour than Numba takes."""

from __future__ import annotations

import functools
import operator
from collections import Counter
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import llvmlite.binding
from llvmlite import ir as llvm
from numba import _dynfunc
from numba.core import analysis, ir, lowering, types, typing
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering
from numba.np import arrayobj

from . import addresses, parts
from .parts import Lowered, PartsBuilder

if TYPE_CHECKING:
    from numba.core.codegen import JITCodeLibrary
    from numba.core.compiler import StateDict
    from numba.core.cpu import CPUContext
    from numba.core.funcdesc import PythonFunctionDescriptor

# Of the symbol of a function that unpacks what Python calls with.
PYTHON_WRAPPER = "_ZN7cpython"


# Attributes of arrays that are members of Numba's struct.
_MEMBERS = {"shape": parts.SHAPE, "size": parts.N_ITEMS}


# The type of what they return for two numbers does not depend on values in the source.
OPERATORS = {
    getattr(operator, name)
    for name in (
        "add sub mul truediv floordiv mod and_ or_ xor lshift rshift "
        "iadd isub imul itruediv ifloordiv imod iand ior ixor ilshift irshift "
        "lt le gt ge eq ne"
    ).split()
}


def is_number(kind: types.Type) -> bool:
    """Whether a type is that of a number or a truth value."""
    return isinstance(types.unliteral(kind), (types.Number, types.Boolean))


# Numba's function and its signature, for each of these and the types of its operands.
_RESOLVED: dict[Any, tuple[Any, Any]] = {}


# `min(a, b)` is b if b < a.
_COMPARED_BY = {min: operator.lt, max: operator.gt}


def is_min_or_max(function: types.Type, kinds: Sequence[types.Type]) -> bool:
    """Whether a call is that of `min` or `max` with two numbers, for which Numba would compile a function."""
    numbers = (types.Integer, types.Float)
    return (
        type(function) is types.Function
        and len(kinds) == 2
        and function.typing_key in _COMPARED_BY
        and all(isinstance(types.unliteral(kind), numbers) for kind in kinds)
    )


def _assigned_once(blocks: dict[int, ir.Block]) -> set[str]:
    """Variables with one assignment, which comes before all their uses on every way through `blocks`."""
    assigned: Counter[str] = Counter()
    home = {}
    for label, block in blocks.items():
        for assignment in block.find_insts(ir.Assign):
            assigned[assignment.target.name] += 1
            home[assignment.target.name] = label
    once = {name for name, times in assigned.items() if times == 1} - analysis.must_use_alloca(blocks)
    before = analysis.compute_cfg_from_blocks(blocks).dominators()
    for label, used in analysis.compute_use_defs(blocks).usemap.items():
        once -= {name for name in used & once if home[name] not in before[label] or home[name] > label}
    return once


class _Lower(lowering.Lower):
    """Keeps variables as values where it can, and forgets them without a trace.

    Numba gives a place on the stack to each variable that is used in several blocks, reads it before it is
    written, to count down what it held, and clears it at the end. Kernels count nothing, and for a tuple
    of a hundred arrays each of these takes LLVM thousands of instructions to see through.
    """

    def _find_singly_assigned_variable(self) -> None:
        super()._find_singly_assigned_variable()
        self._singly_assigned_vars |= _assigned_once(self.blocks)

    def storevar(self, value: Lowered, name: str, argidx: int | None = None) -> None:
        if name in self._singly_assigned_vars:
            super().storevar(value, name, argidx)
        else:
            self._alloca_var(name, self.typeof(name))
            self.builder.store(value, self.getvar(name))

    def delvar(self, name: str) -> None:
        pass

    def setup_function(self, fndesc: PythonFunctionDescriptor) -> None:
        super().setup_function(fndesc)
        self.builder = PartsBuilder(self.entry_block)

    def lower_getitem(
        self, resty: types.Type, expr: ir.Expr, value: ir.Var, index: ir.Var, signature: typing.Signature
    ) -> Lowered:
        array, indices = self.typeof(value.name), self._whole_numbers(index)
        if indices and parts.is_plain(array) and len(indices[0]) <= array.ndim:
            if len(indices[0]) == array.ndim or parts.is_plain(resty):
                return parts.item(
                    self.context, self.builder, resty, array, self.loadvar(value.name), *indices
                )
        return super().lower_getitem(resty, expr, value, index, signature)

    def lower_setitem(
        self, target: ir.Var, index: ir.Var, value: ir.Var, signature: typing.Signature
    ) -> None:
        array, indices = self.typeof(target.name), self._whole_numbers(index)
        if indices and parts.is_plain(array) and len(indices[0]) == array.ndim:
            place = parts.locate(self.context, self.builder, array, self.loadvar(target.name), *indices)
            number = self.context.cast(
                self.builder, self.loadvar(value.name), self.typeof(value.name), array.dtype
            )
            return arrayobj.store_item(self.context, self.builder, array, number, place)
        return super().lower_setitem(target, index, value, signature)

    def _whole_numbers(self, index: ir.Var) -> tuple[tuple[types.Type, ...], list[llvm.Value]] | None:
        """Types and values of an index or of a tuple of them, if these are whole numbers."""
        kind, value = self.typeof(index.name), self.loadvar(index.name)
        if isinstance(kind, types.BaseTuple):
            kinds = tuple(kind)
            values = [self.builder.extract_value(value, k) for k in range(len(kinds))]
        else:
            kinds, values = (kind,), [value]
        is_whole = kinds and all(isinstance(kind, types.Integer) for kind in kinds)
        return (kinds, values) if is_whole else None

    def lower_expr(self, resty: types.Type, expr: ir.Expr) -> Lowered:
        if expr.op == "getattr" and expr.attr in _MEMBERS and parts.is_plain(self.typeof(expr.value.name)):
            return self.builder.extract_value(self.loadvar(expr.value.name), _MEMBERS[expr.attr])
        if expr.op == "call" and isinstance(resty, types.RangeType) and not expr.kws and not expr.vararg:
            numbers = [
                self.context.cast(self.builder, self.loadvar(one.name), self.typeof(one.name), resty.dtype)
                for one in expr.args
            ]
            return parts.make_range(self.context, resty, numbers)
        if expr.op == "call" and not expr.kws and not expr.vararg:
            function, kinds = self.typeof(expr.func.name), [self.typeof(one.name) for one in expr.args]
            if is_min_or_max(function, kinds):
                return self._lower_min_or_max(resty, expr, _COMPARED_BY[function.typing_key], kinds)
        if expr.op == "getiter":
            value = self.loadvar(expr.value.name)
            loop = parts.begin_loop(self.context, self.builder, self.typeof(expr.value.name), value)
            if loop is not None:
                return loop
        if expr.op == "iternext" and isinstance(loop := self.loadvar(expr.value.name), parts.Loop):
            return parts.next_of_loop(self.context, self.builder, resty, loop)
        return super().lower_expr(resty, expr)

    def lower_binop(self, resty: types.Type, expr: ir.Expr, op: Callable[..., object]) -> llvm.Value:
        inferred = self.fndesc.calltypes[expr]
        if op not in OPERATORS or not all(map(is_number, inferred.args)):
            return super().lower_binop(resty, expr, op)
        if (op, inferred.args) not in _RESOLVED:
            typing_context = self.context.typing_context
            function = typing_context.resolve_value_type(op)
            _RESOLVED[op, inferred.args] = (
                function,
                function.get_call_type(typing_context, inferred.args, {}),
            )
        operands = [
            self._cast_var(operand, kind)
            for operand, kind in zip((expr.lhs, expr.rhs), inferred.args, strict=True)
        ]
        result = self.context.get_function(*_RESOLVED[op, inferred.args])(self.builder, operands)
        return self.context.cast(self.builder, result, inferred.return_type, resty)

    def _lower_min_or_max(
        self, kind: types.Type, expr: ir.Expr, compared_by: Callable[..., object], kinds: Sequence[types.Type]
    ) -> llvm.Value:
        first, second = (
            self.context.cast(self.builder, self.loadvar(one.name), one_kind, kind)
            for one, one_kind in zip(expr.args, kinds, strict=True)
        )
        compare = self.context.get_function(compared_by, typing.signature(types.boolean, kind, kind))
        return self.builder.select(compare(self.builder, (second, first)), second, first)

    def lower_assign(self, ty: types.Type, inst: ir.Assign) -> Lowered:
        if isinstance(ty, types.Dispatcher):
            return self.context.get_dummy_value()
        return super().lower_assign(ty, inst)


class _LowerInner(_Lower):
    """For calls from other kernels: with an argument for each number that the function uses."""

    def setup_function(self, fndesc: PythonFunctionDescriptor) -> None:
        convention = self.call_conv
        fndesc.mangled_name = getattr(self.library, "_symbol", fndesc.mangled_name)
        kind = convention.get_function_type(fndesc.restype, ())
        self.function = llvm.Function(self.module, kind, fndesc.mangled_name)
        convention.decorate_function(self.function, (), ())
        if fndesc.inline:
            self.function.attributes.add("alwaysinline")
        self.entry_block = self.function.append_basic_block("entry")
        self.builder = PartsBuilder(self.entry_block)
        self.call_helper = convention.init_call_helper(self.builder)
        # Numba marks where it returns values as not shared with anything.
        unshared = self.function.args[0].attributes if fndesc.noalias else ()
        self._arguments = parts.Arguments(self.context, self.function, fndesc.argtypes, unshared)

    def extract_function_arguments(self) -> list[Lowered]:
        self.fnargs = self._arguments.values
        return self.fnargs

    def lower_normal_function(self, fndesc: PythonFunctionDescriptor) -> None:
        super().lower_normal_function(fndesc)
        self.library._leaves = self._arguments.finish()
        self.library._raises = parts.raises(self.function)


def _lowering(inner: bool, context: CPUContext, *arguments: Any, **named: Any) -> lowering.Lower:
    if context.enable_nrt:
        return lowering.Lower(context, *arguments, **named)
    return (_LowerInner if inner else _Lower)(context, *arguments, **named)


@register_pass(mutates_CFG=True, analysis_only=False)
class LowerKernel(NativeLowering):
    """Lowers a function as above, unless it makes arrays: then it is Numba's to count who holds them."""

    _name = "lower_kernel"

    @property
    def lowering_class(self) -> Callable[..., lowering.Lower]:
        """Return the class that lowers the instructions."""
        return functools.partial(_lowering, isinstance(self, LowerForCallers))

    def run_pass(self, state: StateDict) -> bool:
        """Lower a function; return whether anything changed."""
        if state.library is None:
            state.library = _make_library(state)
        return super().run_pass(state)


def _make_library(state: StateDict) -> JITCodeLibrary:
    """Return an empty library for a function."""
    codegen = addresses.codegen_for(state.targetctx.codegen())
    library = codegen.create_library(state.func_id.func_qualname)
    library.enable_object_caching()
    library._optimize_functions = functools.partial(_tidy, library)
    library.add_ir_module = functools.partial(_add_module, library)
    if addresses.is_short(codegen):
        library._finalize_final_module = functools.partial(addresses.finish, library)
    return library


def _add_module(library: JITCodeLibrary, module: llvm.Module) -> None:
    """Add what was lowered to a library.

    A wrapper takes a hundred arguments apart once a call. Optimized, it took a quarter of the time of all.
    """
    for function in module.functions:
        if function.name.startswith(PYTHON_WRAPPER) and function.blocks:
            function.attributes.update(("noinline", "optnone"))
    type(library).add_ir_module(library, module)


def _tidy(library: JITCodeLibrary, module: llvmlite.binding.ModuleRef) -> None:
    """Make functions small for the whole that they become part of, where LLVM spends its effort."""
    codegen = library._codegen
    module.data_layout = codegen._data_layout
    for function in module.functions:
        if function.is_declaration or function.name.startswith(PYTHON_WRAPPER):
            continue
        passes, builder = codegen._function_pass_manager(opt=1)
        passes.run(function, builder)


def _optimize(library: JITCodeLibrary, unroll: bool) -> None:
    """Optimize a whole library, once; Numba's first round is for what counts who holds arrays."""
    options = llvmlite.binding.create_pipeline_tuning_options(speed_level=3 if unroll else 2)
    options.loop_vectorization = True
    options.loop_unrolling = unroll
    builder = llvmlite.binding.create_pass_builder(library._codegen._tm, options)
    builder.getModulePassManager().run(library._final_module, builder)


@register_pass(mutates_CFG=True, analysis_only=False)
class LowerForCallers(LowerKernel):
    """Lowers a function to what its callers link, and leaves optimizing and machine code to them.

    Numba would optimize each function with all it calls, and again within each of its callers.
    """

    _name = "lower_for_callers"

    def run_pass(self, state: StateDict) -> bool:
        """Lower a function to a library that callers link; return that it changed."""
        library = state.library = self._library(state)
        state.flags.no_compile = True
        super().run_pass(state)
        lowered = state["cr"]
        # Callers know it by this object; it cannot be called.
        name = lowered.fndesc.qualname
        function = _dynfunc.make_function(
            lowered.fndesc.lookup_module(), name, "", 0, lowered.env, (library,)
        )
        if hasattr(library, "_leaves"):
            can_raise = library._raises
            register_call(
                state.targetctx, function, lowered.fndesc, library._leaves, can_raise, self._linked(library)
            )
        else:
            state.targetctx.insert_user_function(function, lowered.fndesc, [library])
        state.reload_init.extend(getattr(library, "_reload_init", ()))  # Numba 0.62 has none
        state["cr"] = lowered._replace(cfunc=function)
        return True

    def _library(self, state: StateDict) -> JITCodeLibrary:
        library = _make_library(state)
        library._optimize_final_module = lambda: None
        library._finalize_final_module = functools.partial(_finish_without_code, library)
        return library

    def _linked(self, library: JITCodeLibrary) -> list[JITCodeLibrary]:
        """Return the libraries that become part of callers."""
        return [library]


@register_pass(mutates_CFG=True, analysis_only=False)
class LowerShared(LowerForCallers):
    """Lowers a function to machine code that all its callers call by its symbol."""

    _name = "lower_shared"

    def _library(self, state: StateDict) -> JITCodeLibrary:
        library = _make_library(state)
        library._symbol = state.symbol
        library._optimize_final_module = functools.partial(_optimize, library, state.unroll)
        return library

    def _linked(self, library: JITCodeLibrary) -> list[JITCodeLibrary]:
        library.finalize()
        return []


def register_call(
    context: CPUContext,
    function: Callable[..., object],
    fndesc: PythonFunctionDescriptor,
    leaves: list[parts.Leaf],
    can_raise: bool,
    libraries: list[JITCodeLibrary],
) -> None:
    """Have kernels call a function with what it uses of its arguments."""
    call = parts.caller_of(context, fndesc, leaves, can_raise, libraries)
    context._defns[function].append(call, call.signature)


def _finish_without_code(library: JITCodeLibrary) -> None:
    library._finalize_dynamic_globals()
    library._finalized = True
