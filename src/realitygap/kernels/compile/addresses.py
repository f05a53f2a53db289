"""Machine code that finds its constants by their distance, in memory that keeps all parts of an object together.

Numba takes the parts of an object to be anywhere in memory. Each constant then needs an instruction of ten bytes for
its address, and a register to hold it: with AVX2, 7 % of the time of a robot-step in `sim`. Here, kernels have
an engine of LLVM for themselves, whose manager of memory reserves one piece for all parts of an object. The numbers
are the same.

A distance has 31 bits, so it must not lead to another object. LLVM has one table of symbols for all objects. If two
objects define a function of the same name, calls in the second one lead to the first one's, wherever that is: LLVM
ends the process if it is too far. So functions that an object has for itself get no symbol, and all others are called
by the object's own table of addresses.
"""

from __future__ import annotations

import copy
import functools
import platform
import struct
import sys
from typing import TYPE_CHECKING

import llvmlite.binding
from numba.core import codegen as numba_codegen
from numba.core import config
from numba.core.compiler_lock import global_compiler_lock

if TYPE_CHECKING:
    from numba.core.cpu import CPUContext

# What LLVM itself inserts, such as calls of memset, is called by the table of addresses, too.
_BY_TABLE = """
!llvm.module.flags = !{!0}
!0 = !{i32 7, !"RtLibUseGOT", i32 1}
"""


def codegen_for(numbas: numba_codegen.JITCPUCodegen) -> numba_codegen.JITCPUCodegen:
    """Return what makes and loads machine code of kernels: one for all kernels, as they call one another.

    Args:
        numbas: What Numba uses for everything; returned if addresses cannot be short on this machine.
    """
    with global_compiler_lock:  # also if two threads want their first kernel
        return _codegen_for(numbas)


@functools.cache
def _codegen_for(numbas: numba_codegen.JITCPUCodegen) -> numba_codegen.JITCPUCodegen:
    if sys.platform != "linux" or platform.machine() != "x86_64" or not config.OPT:
        return numbas
    try:
        return _with_own_engine(numbas) if marks_functions() else numbas
    except (AttributeError, RuntimeError, TypeError, ValueError):  # a Numba or an llvmlite with other parts
        return numbas


def marks_functions() -> bool:
    """Whether llvmlite can mark a function; 0.46 marks what the function returns."""
    module = llvmlite.binding.parse_assembly("declare i32 @f()")
    function = module.get_function("f")
    function.add_function_attribute("nonlazybind")
    return b"nonlazybind" in list(function.attributes)


def is_short(codegen: numba_codegen.JITCPUCodegen) -> bool:
    """Whether machine code of this `codegen` has short addresses."""
    return hasattr(codegen, "_short_machine")


def context_of(target_context: CPUContext) -> CPUContext:
    """Return Numba's context of the target, but with the engine of kernels."""
    numbas = target_context.codegen()
    own = codegen_for(numbas)
    return target_context if own is numbas else target_context.subtarget(_internal_codegen=own)


def _with_own_engine(numbas: numba_codegen.JITCPUCodegen) -> numba_codegen.JITCPUCodegen:
    codegen = copy.copy(numbas)
    codegen._short_machine = _machine(codegen)
    codegen._rtlinker = numba_codegen.RuntimeLinker()
    module = llvmlite.binding.parse_assembly(str(codegen._create_empty_module("realitygap.kernels")))
    engine = llvmlite.binding.create_mcjit_compiler(module, _machine(codegen), use_lmm=True)
    if config.ENABLE_PROFILING:
        engine.enable_jit_events()
    engine.finalize_object()
    library = codegen._library_class
    codegen._engine = numba_codegen.JitEngine(engine)
    codegen._engine.set_object_cache(library._object_compiled_hook, library._object_getbuffer_hook)
    return codegen


def _machine(codegen: numba_codegen.JITCPUCodegen) -> llvmlite.binding.TargetMachine:
    """Return LLVM's description of this machine as Numba has it, with short addresses."""
    options = {"opt": int(config.OPT)}
    codegen._customize_tm_options(options)
    options |= {"reloc": "pic", "codemodel": "small"}
    target = llvmlite.binding.Target.from_triple(llvmlite.binding.get_process_triple())
    return target.create_target_machine(**options)


def finish(library: numba_codegen.JITCodeLibrary) -> None:
    """Make the machine code of a library of Numba, whose functions are optimized, and load it."""
    code = emit(library)
    library._set_compiled_object(code)  # as Numba does with what comes from disk
    type(library)._finalize_final_module(library)
    library._compiled_object = code
    library._disable_inspection = False


def emit(library: numba_codegen.JITCodeLibrary) -> bytes:
    """Return the machine code of a library of Numba, whose functions are optimized."""
    module, codegen = library._final_module, library._codegen
    for function in module.functions:
        if function.name.startswith("llvm."):
            continue
        if not function.is_declaration and function.linkage == llvmlite.binding.Linkage.linkonce_odr:
            function.linkage = "internal"
        else:
            function.add_function_attribute("nonlazybind")
    module.link_in(llvmlite.binding.parse_assembly(_BY_TABLE))
    code: bytes = codegen._short_machine.emit_object(module)
    return code if is_closed(code) else codegen._tm.emit_object(module)


# Of the format ELF on x86-64.
_SECTION, _RELOCATION = "<IIQQQQIIQQ", "<QQq"
_TABLE_OF_RELOCATIONS = 4
_ADDRESS, _DISTANCE, _CALL, _ENTRY, _LONG_DISTANCE, _ENTRY_TO_CALL, _ENTRY_TO_LOAD = 1, 2, 4, 9, 24, 41, 42


def is_closed(code: bytes) -> bool:
    """Whether the short distances in an object lead to the object itself or to its table of addresses."""
    (start,) = struct.unpack_from("<Q", code, 0x28)
    size, n = struct.unpack_from("<HH", code, 0x3A)
    sections = [struct.unpack_from(_SECTION, code, start + size * k) for k in range(n)]
    for _, kind, _, _, place, length, link, _, _, _ in sections:
        if kind != _TABLE_OF_RELOCATIONS:
            continue
        n_local = sections[link][7]  # the symbols of an object begin with those that no other one sees
        entries = struct.iter_unpack(_RELOCATION, code[place : place + length])
        for info in {info for _, info, _ in entries}:
            symbol, way = info >> 32, info & 0xFFFFFFFF
            if way in (_DISTANCE, _CALL):
                if symbol >= n_local:
                    return False
            elif way not in (_ADDRESS, _ENTRY, _LONG_DISTANCE, _ENTRY_TO_CALL, _ENTRY_TO_LOAD):
                return False
    return True
