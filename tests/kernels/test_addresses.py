"""Constants by their distance: objects whose table of addresses has room for all its entries, wherever they are."""

from __future__ import annotations

import platform
import struct
import subprocess
import sys
from types import SimpleNamespace

import llvmlite.binding
import pytest
from numba.core.registry import cpu_target

from realitygap.kernels.compile import addresses

ON_LINUX = sys.platform == "linux" and platform.machine() == "x86_64"
pytestmark = pytest.mark.skipif(
    not ON_LINUX, reason="addresses are short on Linux with an x86 processor only"
)

CALLS = """
declare void @outside()
declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)
define void @inside(ptr %to, i64 %n) {
  call void @outside()
  call void @llvm.memset.p0.i64(ptr %to, i8 0, i64 %n, i1 false)
  ret void
}
"""
PLT32, RELA = 4, 4
SECTION, RELOCATION, SYMBOL = "<IIQQQQIIQQ", "<QQq", "<IBBHQQ"


def called_by_stub(code: bytes) -> set[str]:
    """Return the symbols of other objects that an object in ELF calls by a stub."""
    (start,) = struct.unpack_from("<Q", code, 0x28)
    size, n = struct.unpack_from("<HH", code, 0x3A)
    sections = [struct.unpack_from(SECTION, code, start + size * k) for k in range(n)]
    names = set()
    for section in sections:
        if section[1] != RELA:
            continue
        symbols = sections[section[6]]
        for place in range(section[4], section[4] + section[5], struct.calcsize(RELOCATION)):
            _, info, _ = struct.unpack_from(RELOCATION, code, place)
            entry = symbols[4] + struct.calcsize(SYMBOL) * (info >> 32)
            name, _, _, home, _, _ = struct.unpack_from(SYMBOL, code, entry)
            if info & 0xFFFFFFFF == PLT32 and home == 0:
                first = sections[symbols[6]][4] + name
                names.add(code[first : code.index(b"\0", first)].decode())
    return names


def test_calls_of_other_objects_need_no_entry_that_llvm_does_not_count():
    codegen = cpu_target.target_context.codegen()
    module = llvmlite.binding.parse_assembly(CALLS)
    assert called_by_stub(addresses._machine(codegen).emit_object(module)) == {"outside", "memset"}
    library = SimpleNamespace(_final_module=llvmlite.binding.parse_assembly(CALLS), _codegen=codegen)
    assert called_by_stub(addresses.emit(library)) == set()


FAR_APART = f"""
import mmap
import numba.core.codegen
held = []
finish = numba.core.codegen.CPUCodeLibrary._finalize_final_module
def hold_and_finish(library):
    held.append(mmap.mmap(-1, {3 << 30}))
    finish(library)
numba.core.codegen.CPUCodeLibrary._finalize_final_module = hold_and_finish
from realitygap.kernels.compile import addresses
from tests.kernels.test_compile import CODE_OF_SHARED
exec(CODE_OF_SHARED)
print(addresses.ARE_SHORT, len(held) > 2)
"""


@pytest.mark.slow
def test_objects_work_that_are_gigabytes_apart(tmp_path):
    """As in a process with large arrays: a distance has 31 bits."""
    environment = {"PATH": "/usr/bin:/bin", "REALITYGAP_CACHE": str(tmp_path), "PYTHONPATH": "."}
    for _ in range(2):  # compiled, and loaded
        done = subprocess.run(
            [sys.executable, "-c", FAR_APART], capture_output=True, text=True, env=environment, check=True
        )
        assert done.stdout.splitlines()[-1] == "True True"
