"""Constants by their distance: no distance leads to another object, which may be anywhere in memory."""

from __future__ import annotations

import ctypes
import platform
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import llvmlite.binding
import pytest
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target

from realitygap.kernels.compile import addresses
from realitygap.kernels.compile import cache as kernel_cache

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() != "x86_64" or not addresses.marks_functions(),
    reason="addresses are short on Linux with an x86 processor and a new llvmlite only",
)

# An object calls a function of its own that other objects have as well, one of another object, and one of the system.
CALLS = """
define linkonce_odr i32 @own() noinline { ret i32 NUMBER }
declare i32 @outside()
declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)
@place = common global ptr null
define i32 @callNUMBER(ptr %to, i64 %n) {
  %place = load ptr, ptr @place
  call void @llvm.memset.p0.i64(ptr %to, i8 0, i64 %n, i1 false)
  %own = call i32 @own()
  %other = call i32 @outside()
  %sum = add i32 %own, %other
  ret i32 %sum
}
"""
OUTSIDE = "define i32 @outside() { ret i32 100 }"


def codegen():
    return addresses.codegen_for(cpu_target.target_context.codegen())


def library_of(text: str) -> SimpleNamespace:
    return SimpleNamespace(_final_module=llvmlite.binding.parse_assembly(text), _codegen=codegen())


@global_compiler_lock
def load(name: str, text: str):
    library = codegen().create_library(name)
    library.enable_object_caching()
    library._final_module = llvmlite.binding.parse_assembly(text)
    addresses.finish(library)
    return library


def test_an_object_calls_its_own_function_where_another_object_has_one_of_that_name():
    libraries = [load("outside", OUTSIDE)]
    for number in (1, 2, 3):
        libraries.append(load(f"calls{number}", CALLS.replace("NUMBER", str(number))))
        address = libraries[-1].get_pointer_to_function(f"call{number}")
        call = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_char_p, ctypes.c_size_t)(address)
        filled = ctypes.create_string_buffer(b"x" * 300)
        assert call(filled, 299) == 100 + number
        assert filled.raw == bytes(299) + b"x\0"


def test_calls_lead_to_the_object_itself_or_to_its_table_of_addresses():
    clear = "call void @llvm.memset.p0.i64(ptr %to, i8 0, i64 %n, i1 false)"
    for called in ("%x = call i32 @own()", "%x = call i32 @outside()", clear):
        text = CALLS.split("define i32 @call")[0]
        text += f"define void @f(ptr %to, i64 %n) {{ {called}\n ret void }}"
        text = text.replace("NUMBER", "1")
        module = llvmlite.binding.parse_assembly(text)
        assert not addresses.is_closed(codegen()._short_machine.emit_object(module)), called
        library = library_of(text)
        code = addresses.emit(library)
        assert addresses.is_closed(code), called
        assert code == codegen()._short_machine.emit_object(library._final_module), called


def test_an_object_whose_distances_lead_elsewhere_gets_long_addresses():
    text = "@far = external dso_local global i32\ndefine i32 @f() {\n %x = load i32, ptr @far\n ret i32 %x\n}"
    short = codegen()._short_machine.emit_object(llvmlite.binding.parse_assembly(text))
    assert not addresses.is_closed(short)
    code = addresses.emit(library_of(text))
    assert addresses.is_closed(code)
    assert code == codegen()._tm.emit_object(library_of(text)._final_module)


def test_numba_makes_and_loads_the_code_where_addresses_cannot_be_short(monkeypatch):
    numbas = cpu_target.target_context.codegen()
    assert addresses.is_short(codegen()), "here they can"
    assert codegen() is addresses.codegen_for(numbas), "one engine for all kernels"
    assert addresses.context_of(cpu_target.target_context).codegen() is codegen()
    assert cpu_target.target_context.codegen() is numbas
    make = addresses._codegen_for.__wrapped__
    with monkeypatch.context() as on_arm:
        on_arm.setattr(addresses.platform, "machine", lambda: "aarch64")
        assert make(numbas) is numbas

    def without_manager(module, machine):  # of an llvmlite with one manager of memory
        pytest.fail("it is called with the manager")

    monkeypatch.setattr(llvmlite.binding, "create_mcjit_compiler", without_manager)
    assert make(numbas) is numbas
    assert not addresses.is_short(numbas)


AFTER_ANOTHER_USER = """
import numba
assert numba.njit(lambda x: x + 1)(1) == 2
import numpy as np
from realitygap.kernels.math import elementary
from realitygap.kernels.neat import distances
measure = distances.make_measure(0, 4, 3, True)
behaviors = distances.make_behaviors(2, 12)
for row, cells in enumerate(([0, 5, 7], [1, 5])):
    distances.describe(measure, np.array(cells, np.uint8), len(cells), 0.5, 0.25, behaviors, row)
print(float(elementary.tanh(0.7)).hex(), behaviors[0].sum())
"""


@pytest.mark.slow
def test_all_files_have_short_addresses_that_lead_nowhere_else(tmp_path: Path):
    environment = {"PATH": "/usr/bin:/bin", "REALITYGAP_CACHE": str(tmp_path)}
    printed = {
        subprocess.run(
            [sys.executable, "-c", AFTER_ANOTHER_USER],
            capture_output=True,
            text=True,
            env={**environment, **plainly},
            check=True,
        ).stdout
        for plainly in ({}, {}, {"REALITYGAP_PLAIN_NUMBA": "1"})  # compiled, loaded, and by Numba alone
    }
    assert len(printed) == 1
    used = []
    for path in tmp_path.rglob("*.kernel"):
        key, stored, *_ = kernel_cache.read_sealed(path)
        code = stored["code"] if isinstance(stored, dict) else stored[0][2][0]
        used.append(key[-1][-1])
        assert used[-1] == "" or addresses.is_closed(code), path
    assert {"", "short"} == set(used)
