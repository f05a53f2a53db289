"""Machine code that finds its constants by their distance, where Numba keeps all parts of an object together.

Numba takes the parts of an object to be anywhere in memory. Each constant then needs an instruction of ten bytes for
its address, and a register to hold it: with AVX2, a tenth of the time of a robot-step in `sim`. The numbers are the
same.
"""

from __future__ import annotations

import functools
import platform
import sys
from typing import Any

import llvmlite.binding
from numba.core import config
from numba.core.registry import cpu_target

_CONTEXT = "_toplevel_target_context"
"""Attribute of Numba's target that exists from the moment on at which Numba has taken its manager of memory."""


def _is_together() -> bool:
    """Have Numba keep all parts of an object together; return whether it does.

    It does not if another library used Numba before, because the manager of memory is taken once.
    """
    chosen = getattr(config, "USE_LLVMLITE_MEMORY_MANAGER", 0)
    is_known = (
        sys.platform == "linux" and platform.machine() == "x86_64" and hasattr(type(cpu_target), _CONTEXT)
    )
    if not is_known or chosen is not None:
        return is_known and bool(chosen)
    if _CONTEXT in vars(cpu_target):
        return False
    config.USE_LLVMLITE_MEMORY_MANAGER = 1
    try:
        return cpu_target.target_context is not None
    finally:
        config.USE_LLVMLITE_MEMORY_MANAGER = chosen


ARE_SHORT = _is_together()
"""Whether kernels are compiled this way."""


@functools.cache
def _machine(codegen: Any) -> Any:
    """Return LLVM's description of this machine as Numba has it, with short addresses."""
    options = {"opt": int(config.OPT)}
    codegen._customize_tm_options(options)
    options |= {"reloc": "pic", "codemodel": "small"}
    target = llvmlite.binding.Target.from_triple(llvmlite.binding.get_process_triple())
    return target.create_target_machine(**options)


# Calls that LLVM itself inserts, such as those of memset, read their address from the table, too.
_BY_TABLE = """
!llvm.module.flags = !{!0}
!0 = !{i32 7, !"RtLibUseGOT", i32 1}
"""


def emit(library: Any) -> bytes:
    """Return the machine code of a library of Numba, whose functions are optimized.

    Calls of other objects read their address from the object's table of addresses. For calls by a stub, LLVM makes
    entries in that table which it does not count, and the process ends where they do not fit into the memory.
    """
    module = library._final_module
    for function in module.functions:
        if function.is_declaration and not function.name.startswith("llvm."):
            function.add_function_attribute("nonlazybind")
    module.link_in(llvmlite.binding.parse_assembly(_BY_TABLE))
    code: bytes = _machine(library._codegen).emit_object(module)
    return code


def finish(library: Any) -> None:
    """Make the machine code of a library of Numba and load it."""
    code = emit(library)
    library._set_compiled_object(code)  # as Numba does with what comes from disk
    type(library)._finalize_final_module(library)
    library._compiled_object = code
    library._disable_inspection = False
