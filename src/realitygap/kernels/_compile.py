"""How every kernel is compiled: strict IEEE arithmetic, no interpreter lock, cached on disk."""

from __future__ import annotations

import functools
import gc
from collections.abc import Callable
from typing import Any, TypeVar

import numba
from numba.core.compiler import CompilerBase, Flags
from numba.core.compiler_machinery import PassManager
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

from ._cache import SealedCache, usable_folder
from ._lower import LowerForCallers, LowerKernel

F = TypeVar("F", bound=Callable[..., Any])

# No fastmath: results must not depend on the machine. Nobody calls kernels from C.
MAKER = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


CACHE_FOLDER = usable_folder()


def _mark_stage(state: Any) -> None:
    """The array arguments of a stage never overlap: so loops over them can be taken side by side."""
    state.flags.noalias = True


# Of Numba's thirty steps those that kernels need: no closures, contexts, literals or formulas over whole arrays.
BEFORE_LOWERING = (
    TranslateByteCode,
    FixupArgs,
    IRProcessing,
    GenericRewrites,
    ReconstructSSA,
    NopythonTypeInference,
    PreLowerStripPhis,
    IRLegalization,
    AnnotateTypes,
)


class _Flags(Flags):
    """Options that compare by those that were set; type inference compares them ten thousands of times."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Flags) and self._values == other._values

    def __hash__(self) -> int:
        return hash(frozenset(self._values))


class _Entry(CompilerBase):
    """For calls from Python."""

    lowering = LowerKernel

    def define_pipelines(self) -> Any:
        self.state.flags = _Flags(self.state.flags)
        manager = PassManager("kernel")
        for step in (*BEFORE_LOWERING, self.lowering, NoPythonBackend):
            manager.add_pass(step, step.__name__)
        manager.finalize()
        return [manager]

    def compile_extra(self, function: Any) -> Any:
        # Of the million objects that a compilation makes, nearly all live until it is done.
        collecting = gc.isenabled()
        gc.disable()
        try:
            return super().compile_extra(function)
        finally:
            if collecting:
                gc.enable()


class _Inner(_Entry):
    """For calls from other kernels."""

    lowering = LowerForCallers


class _EntryStage(_Entry):
    def define_pipelines(self) -> Any:
        _mark_stage(self.state)
        return super().define_pipelines()


class _InnerStage(_Inner):
    def define_pipelines(self) -> Any:
        _mark_stage(self.state)
        return super().define_pipelines()


# What makes no array needs no counting of who holds which, which costs more than the work of a small kernel.
KERNEL = {**MAKER, "_nrt": False}
INLINED = {**KERNEL, "forceinline": True}


class Kernel:
    """A compiled function that can be called from Python and from other kernels.

    For other kernels it is compiled without the wrapper that Python needs, which costs a quarter of the time
    of compiling a whole run, and is not kept on disk by itself: it is part of what calls it. For Python it is
    compiled apart, at the first call, and kept.
    """

    def __init__(self, function: Callable[..., Any], options: dict[str, Any], *, stage: bool = False) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self._entry = numba.njit(**options, pipeline_class=_EntryStage if stage else _Entry)(function)
        if CACHE_FOLDER is not None:
            self._entry._cache = SealedCache(function, CACHE_FOLDER)
        # Python must never call it: without a wrapper that ends the process. Numba's type holds it weakly.
        self._inner = numba.njit(
            **options, no_cpython_wrapper=True, pipeline_class=_InnerStage if stage else _Inner
        )(function)
        self._numba_type_ = numba.types.Dispatcher(self._inner)

    def __call__(self, *arguments: Any) -> Any:
        return self._entry(*arguments)

    @property
    def stats(self) -> Any:
        """Numba's counts of what was loaded from disk and what was compiled."""
        return self._entry.stats


def maker(function: F) -> F:
    """Compile `function`, which makes arrays or calls one that does, at its first call.

    This and the other decorators leave a plain function where Numba is switched off.
    """
    if numba.config.DISABLE_JIT:
        return function
    return Kernel(function, MAKER)  # type: ignore[return-value]


def kernel(function: F) -> F:
    """Compile `function`, which makes no arrays, at its first call."""
    if numba.config.DISABLE_JIT:
        return function
    return Kernel(function, KERNEL)  # type: ignore[return-value]


def inlined(function: F) -> F:
    """A small kernel that becomes part of each of its callers, loops over lanes among them."""
    if numba.config.DISABLE_JIT:
        return function
    return Kernel(function, INLINED)  # type: ignore[return-value]


def stage(function: F) -> F:
    """A kernel of loops over lanes. Its arrays must not overlap, and it must not make any.

    To be taken side by side a loop must read what it selects from before it selects: of
    `a[l] if hit else b[l]` the compiler makes one load from either address, lane by lane.
    """
    if numba.config.DISABLE_JIT:
        return function
    return Kernel(function, INLINED, stage=True)  # type: ignore[return-value]
