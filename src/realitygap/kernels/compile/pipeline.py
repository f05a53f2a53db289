"""A faster way through Numba's compiler for kernels; `decorators` does without it if it is missing.

It gives the results of Numba's own way, to the last bit. It knows parts of Numba that no document promises.
"""

from __future__ import annotations

import functools
import gc
import hashlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from numba import _dynfunc
from numba.core import itanium_mangler, lowering, types, typing
from numba.core.compiler import CompilerBase, Flags, compile_result
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.ir_utils import build_definitions
from numba.core.ssa import reconstruct_ssa
from numba.core.typed_passes import (
    AnnotateTypes,
    IRLegalization,
    NoPythonBackend,
    NopythonTypeInference,
    PreLowerStripPhis,
)
from numba.core.untyped_passes import (
    FixupArgs,
    GenericRewrites,
    IRProcessing,
    ReconstructSSA,
    TranslateByteCode,
)

from realitygap._process import on_wide_stack

from .lower import (
    OPERATORS,
    LowerForCallers,
    LowerKernel,
    LowerShared,
    is_min_or_max,
    is_number,
    register_call,
)

if TYPE_CHECKING:
    from numba.core.compiler import CompileResult, StateDict
    from numba.core.cpu import CPUContext
    from numba.core.registry import CPUDispatcher

    from .cache import SealedCache


class _Flags(Flags):
    """Options that compare by those that were set; type inference compares them ten thousands of times."""

    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, _Flags) and self._values == other._values)

    def __hash__(self) -> int:
        return hash(frozenset(self._values))


class _RememberedTyping:
    """The typing context, with what operations on numbers and arrays give remembered.

    Args:
        context: Numba's.
        known: The remembered types.
        is_lowered_here: Whether `_Lower` lowers the function. Numba's lowering has its own way for `min` and `max`.
    """

    def __init__(self, context: typing.Context, known: dict[Any, Any], *, is_lowered_here: bool) -> None:
        self._context = context
        self._known = known
        self._is_lowered_here = is_lowered_here

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)

    def resolve_function_type(
        self, function: Any, arguments: tuple[types.Type, ...], named: dict[str, types.Type]
    ) -> typing.Signature | None:
        if type(function) is not types.Function or named:
            return self._context.resolve_function_type(function, arguments, named)
        if self._is_lowered_here and is_min_or_max(function, arguments):
            kind = self._context.unify_types(*map(types.unliteral, arguments))
            return typing.signature(kind, *arguments)
        if function.typing_key in OPERATORS and all(map(is_number, arguments)):
            arguments = tuple(map(types.unliteral, arguments))
        key = (function.typing_key, arguments)
        try:
            owner, signature = self._known[key]
        except KeyError:
            signature = self._context.resolve_function_type(function, arguments, named)
            if signature is not None:
                self._known[key] = (function, signature)
            return signature
        if owner is not function:
            function._impl_keys[signature.args] = owner._impl_keys[signature.args]
        return signature


_KNOWN: dict[Any, dict[Any, Any]] = {}


@register_pass(mutates_CFG=True, analysis_only=False)
class InferTypes(NopythonTypeInference):
    """Numba's type inference, with the answers of its tables remembered."""

    _name = "infer_types"

    def run_pass(self, state: StateDict) -> bool:
        """Infer the types of a function; return whether anything changed."""
        context = state.typingctx
        # An operation that Numba writes in Python is compiled with the options of its first caller.
        known = _KNOWN.setdefault(state.flags, {})
        state.typingctx = _RememberedTyping(context, known, is_lowered_here=not state.flags.nrt)
        try:
            return bool(super().run_pass(state))
        finally:
            state.typingctx = context


@register_pass(mutates_CFG=True, analysis_only=False)
class SplitVariables(ReconstructSSA):
    """Numba's step, without the lifetimes of variables, which nothing reads."""

    _name = "split_variables"

    def run_pass(self, state: StateDict) -> bool:
        """Give each assignment its own variable; return that the function changed."""
        state.func_ir = reconstruct_ssa(state.func_ir)
        state.func_ir._definitions = build_definitions(state.func_ir.blocks)
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class StripPhis(PreLowerStripPhis):
    """Numba's step, without the lifetimes of variables, which nothing reads."""

    _name = "strip_phis_of_kernel"

    def run_pass(self, state: StateDict) -> bool:
        """Replace what chooses between the variables of several blocks; return that the function changed."""
        state.func_ir = self._strip_phi_nodes(state.func_ir)
        state.func_ir._definitions = build_definitions(state.func_ir.blocks)
        return True


# Of Numba's thirty steps those that kernels need: no closures, contexts, literals or formulas over whole arrays.
BEFORE_LOWERING = (
    TranslateByteCode,
    FixupArgs,
    IRProcessing,
    GenericRewrites,
    SplitVariables,
    InferTypes,
    StripPhis,
)


@functools.cache
def _digest(arguments: tuple[types.Type, ...]) -> str:
    return hashlib.sha256(repr(arguments).encode()).hexdigest()[:24]


def _short_name(name: str, arguments: tuple[types.Type, ...], **options: Any) -> str:
    """A symbol for a function and the types of its arguments, whose names can take 10 kB."""
    return str(itanium_mangler.mangle(name, (_digest(tuple(arguments)),), **options))


def _install_new(context: CPUContext) -> None:
    for registry in list(context._registries):
        context.install_registry(registry)


def _postpone_search() -> None:
    """Leave what was made while compiling to a later search for garbage, which takes half a second."""
    if not gc.get_freeze_count():
        gc.freeze()
        gc.unfreeze()  # into the oldest generation


class _Entry(CompilerBase):
    """For calls from Python."""

    lowering = LowerKernel
    may_alias = True

    def define_pipelines(self) -> list[PassManager]:
        self.state.flags = _Flags(self.state.flags)
        self.state.flags.noalias = not self.may_alias
        context = self.state.targetctx
        context.mangler = _short_name
        # What can be new since the start of this compilation is what templates of ours brought with them.
        context.refresh = functools.partial(_install_new, context)
        manager = PassManager("kernel")
        # Where a variable ends matters only to what counts who holds arrays.
        ends = (IRLegalization,) if self.state.flags.nrt else ()
        for step in (*BEFORE_LOWERING, *ends, AnnotateTypes, self.lowering, NoPythonBackend):
            manager.add_pass(step, step.__name__)
        manager.finalize()
        return [manager]

    @on_wide_stack
    def compile_extra(self, function: Callable[..., object]) -> CompileResult:
        # Of the million objects that a compilation makes, nearly all live until it is done.
        collecting = gc.isenabled()
        gc.disable()
        try:
            return super().compile_extra(function)
        finally:
            if collecting:
                _postpone_search()
                gc.enable()


class _Inner(_Entry):
    """For calls from other kernels."""

    lowering = LowerForCallers


class _Shared(_Entry):
    """For calls from other kernels, by symbol."""

    lowering = LowerShared
    cache: SealedCache
    unroll: bool

    def define_pipelines(self) -> list[PassManager]:
        self.state.unroll = self.unroll
        self.state.symbol = self.cache.symbol(tuple(self.state.args), self.state.targetctx)
        return super().define_pipelines()


def share(dispatcher: CPUDispatcher, cache: SealedCache, *, stage: bool, unroll: bool) -> None:
    """Have a dispatcher of Numba compile for calls from other kernels, once for all of them.

    Args:
        dispatcher: Of Numba.
        cache: Its `SealedCache`.
        stage: As in `shorten`.
        unroll: Whether loops are worth unrolling, which takes LLVM a third of its time.
    """
    attributes = {"may_alias": not stage, "cache": cache, "unroll": unroll}
    _set_pipeline(dispatcher, type("_Pipeline", (_Shared,), attributes))
    dispatcher.compile = functools.partial(_compile_shared, dispatcher, cache)


def _compile_shared(
    dispatcher: CPUDispatcher, cache: SealedCache, signature: tuple[types.Type, ...]
) -> Callable[..., object]:
    arguments = tuple(signature)
    with global_compiler_lock:
        if arguments not in dispatcher.overloads:
            context = dispatcher.targetctx
            stored = cache.load_shared(arguments, context)
            if stored is None:
                _compile_inner(dispatcher, signature)
                result = dispatcher.overloads[arguments]
                fndesc, library = result.fndesc, result.library
                fndesc.typemap = fndesc.calltypes = None
                stored = {"fndesc": fndesc, "leaves": library._leaves, "raises": library._raises}
                cache.save_shared(arguments, context, library, stored)
            else:
                dispatcher.add_overload(_stored_result(dispatcher, stored))
    return dispatcher.overloads[arguments].entry_point


def _stored_result(dispatcher: CPUDispatcher, stored: dict[str, Any]) -> CompileResult:
    context, fndesc = dispatcher.targetctx, stored["fndesc"]
    environment = lowering.Environment.from_fndesc(fndesc)
    function = _dynfunc.make_function(fndesc.lookup_module(), fndesc.qualname, "", 0, environment, ())
    register_call(context, function, fndesc, stored["leaves"], stored["raises"], [])
    return compile_result(
        typing_context=dispatcher.typingctx,
        target_context=context,
        entry_point=function,
        signature=typing.signature(fndesc.restype, *fndesc.argtypes),
        objectmode=False,
        fndesc=fndesc,
        environment=environment,
    )


def shorten(dispatcher: CPUDispatcher, *, inner: bool, stage: bool) -> None:
    """Have a dispatcher of Numba compile this way.

    Args:
        dispatcher: Of Numba.
        inner: Called by kernels alone.
        stage: The arrays among its arguments never overlap: so loops over them can be taken side by side.
    """
    _set_pipeline(dispatcher, type("_Pipeline", (_Inner if inner else _Entry,), {"may_alias": not stage}))
    if inner:
        dispatcher.compile = functools.partial(_compile_inner, dispatcher)


def _set_pipeline(dispatcher: CPUDispatcher, pipeline: type[CompilerBase]) -> None:
    dispatcher._compiler.pipeline_class = pipeline
    dispatcher._compiler._customize_flags = _Flags


def _compile_inner(dispatcher: CPUDispatcher, signature: tuple[types.Type, ...]) -> Callable[..., object]:
    """Compile for calls from other kernels, without the clocks that Numba reads at each call of LLVM."""
    arguments = tuple(signature)
    with global_compiler_lock:
        if arguments not in dispatcher.overloads:
            with dispatcher._compiling_counter:
                dispatcher.add_overload(dispatcher._compiler.compile(arguments, None))
    return dispatcher.overloads[arguments].entry_point
