"""How Numba's instructions become LLVM's, with less detour than Numba takes."""

from __future__ import annotations

import functools
from collections import Counter
from typing import Any

from numba import _dynfunc
from numba.core import analysis, ir, lowering
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering

# Of the symbol of a function that unpacks what Python calls with.
PYTHON_WRAPPER = "_ZN7cpython"


def _assigned_once(blocks: dict[int, Any]) -> set[str]:
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

    def storevar(self, value: Any, name: str, argidx: int | None = None) -> None:
        if name in self._singly_assigned_vars:
            super().storevar(value, name, argidx)
        else:
            self._alloca_var(name, self.typeof(name))
            self.builder.store(value, self.getvar(name))

    def delvar(self, name: str) -> None:
        pass


def _lowering(context: Any, *arguments: Any, **named: Any) -> lowering.Lower:
    counts = context.enable_nrt
    return (lowering.Lower if counts else _Lower)(context, *arguments, **named)


@register_pass(mutates_CFG=True, analysis_only=False)
class LowerKernel(NativeLowering):
    """Lowers a function as above, unless it makes arrays: then it is Numba's to count who holds them."""

    _name = "lower_kernel"

    @property
    def lowering_class(self) -> Any:
        return _lowering

    def run_pass(self, state: Any) -> bool:
        if state.library is None:
            state.library = _make_library(state)
        return super().run_pass(state)


def _make_library(state: Any) -> Any:
    """What a function is lowered into."""
    library = state.targetctx.codegen().create_library(state.func_id.func_qualname)
    library.enable_object_caching()
    library._optimize_functions = functools.partial(_tidy, library)
    return library


def _tidy(library: Any, module: Any) -> None:
    """Make functions small for the whole that they become part of, where LLVM spends its effort."""
    codegen = library._codegen
    module.data_layout = codegen._data_layout
    for function in module.functions:
        if function.is_declaration:
            continue
        if function.name.startswith(PYTHON_WRAPPER):
            # It takes a hundred arguments apart once a call. Optimized, it took a quarter of the time of all.
            function.add_function_attribute("noinline")
            function.add_function_attribute("optnone")
            continue
        passes, builder = codegen._function_pass_manager(opt=1)
        passes.run(function, builder)


@register_pass(mutates_CFG=True, analysis_only=False)
class LowerForCallers(LowerKernel):
    """Lowers a function to what its callers link, and leaves optimizing and machine code to them.

    Numba would optimize each function with all it calls, and again within each of its callers.
    """

    _name = "lower_for_callers"

    def run_pass(self, state: Any) -> bool:
        library = state.library = _make_library(state)
        library._optimize_final_module = lambda: None
        library._finalize_final_module = functools.partial(_finish_without_code, library)
        state.flags.no_compile = True
        super().run_pass(state)
        lowered = state["cr"]
        # Callers know it by this object; it cannot be called.
        name = lowered.fndesc.qualname
        function = _dynfunc.make_function(
            lowered.fndesc.lookup_module(), name, "", 0, lowered.env, (library,)
        )
        state.targetctx.insert_user_function(function, lowered.fndesc, [library])
        state.reload_init.extend(getattr(library, "_reload_init", ()))  # Numba 0.62 has none
        state["cr"] = lowered._replace(cfunc=function)
        return True


def _finish_without_code(library: Any) -> None:
    library._finalize_dynamic_globals()
    library._finalized = True
