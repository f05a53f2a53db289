"""Ctrl-C ends a program, wherever Python is when it comes."""

import subprocess
import sys
from pathlib import Path

import pytest

from realitygap.errors import from_extra

pytestmark = pytest.mark.slow

DROPS = {
    "callback of a weak reference": """
import weakref
class Thing: pass
def drop():
    thing = Thing()
    watched = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))
    del thing
""",
    "callback from C": """
import ctypes
call = ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))
def drop():
    call()
""",
    "finalizer": """
class Thing:
    def __del__(self):
        signal.raise_signal(signal.SIGINT)
def drop():
    Thing()
""",
    "finalizers, twice": """
class Thing:
    def __init__(self, after):
        self.after = after
    def __del__(self):
        signal.raise_signal(signal.SIGINT)
        time.sleep(self.after)
def drop():
    Thing(0.0)
    Thing(0.3)  # it is repeated here, and dropped again
""",
}
DROPPING = """
import signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)
def wait():
    drop()
    print("dropped", flush=True)
    time.sleep(20)
    print("not interrupted")
"""
IN_LLVMS_CALLBACK = """
import ctypes
done = []
def _raw_object_cache_notify():
    signal.raise_signal(signal.SIGINT)
    done.append("whole")
call = ctypes.CFUNCTYPE(None)(_raw_object_cache_notify)
def drop():
    call()
    print(*done)
"""
WHILE_LLVM_COMPILES = """
import threading
import numba.core.codegen
import numba
from realitygap._interrupts import interrupt
Library = numba.core.codegen.JITCodeLibrary
finalize = Library._finalize_specific
def finalize_interrupted(library):
    Library._finalize_specific = finalize
    threading.Timer(0.002, interrupt).start()
    finalize(library)
@numba.njit
def work(x):
    return sorted([x, x + 1.0, x * 2.0])
def drop():
    Library._finalize_specific = finalize_interrupted
    work(1.0)
"""
IN_POLARS = """
import polars as pl
make = pl.List.__init__
def make_interrupted(self, inner):
    pl.List.__init__ = make
    signal.raise_signal(signal.SIGINT)
    make(self, inner)
frame = pl.LazyFrame({"a": [[1]]})
def drop():
    pl.List.__init__ = make_interrupted
    print(*frame.collect_schema())
"""
IN_A_CLASS_BODY = """
class Attribute:
    def __set_name__(self, owner, name):
        signal.raise_signal(signal.SIGINT)
def drop():
    try:
        class Owner:
            attribute = Attribute()
    except KeyboardInterrupt as error:  # Python 3.12 and newer; 3.11 does what follows
        raise RuntimeError("Error calling __set_name__") from error
"""
IN_A_BLOCK = """
from realitygap._interrupts import kept_interrupts
try:
    with kept_interrupts():
        wait()
except KeyboardInterrupt:
    print("interrupted")
"""
IN_A_COMMAND = """
import realitygap.study, realitygap.cli
realitygap.study.load_study = lambda *_, **__: wait()
sys.argv = ["realitygap", "run", "paper"]
realitygap.cli.main()
"""
IN_A_PROCESS_OF_THE_LAB = """
import os, types
import realitygap.lab._work as work
sys.modules["realitygap.lab._study"] = types.SimpleNamespace(run=lambda *_: wait())
end, order = os.pipe()
os.write(order, b'{"kind": "StudyWork", "folder": ""}\\n')  # and it stays open
sys.stdin = open(end)
sys.exit(work.main())
"""


def run(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", DROPPING + code], capture_output=True, text=True, timeout=300, check=False
    )


@pytest.mark.parametrize("place", DROPS)
def test_kept_interrupts_repeat_one_that_python_drops(place: str) -> None:
    done = run(DROPS[place] + IN_A_BLOCK)
    assert done.stdout.split() == ["dropped", "interrupted"]
    assert done.stderr == ""


def test_kept_interrupts_let_a_callback_of_llvm_end() -> None:
    done = run(IN_LLVMS_CALLBACK + IN_A_BLOCK)
    assert done.stdout.split() == ["whole", "dropped", "interrupted"]


def test_interrupt_while_llvm_compiles_is_kept() -> None:
    done = run(WHILE_LLVM_COMPILES + IN_A_BLOCK)
    assert done.stdout.split()[-1] == "interrupted"
    assert done.stderr == ""


def test_interrupt_in_a_callback_of_polars_waits_for_its_end() -> None:
    done = run(IN_POLARS + IN_A_BLOCK)
    assert done.stdout.split() == ["a", "dropped", "interrupted"]
    assert done.stderr == ""


def test_block_that_fails_after_a_dropped_interrupt_ends_with_the_interrupt() -> None:
    done = run(
        DROPS["callback from C"]
        + """
from realitygap._interrupts import kept_interrupts
try:
    with kept_interrupts():
        drop()
        raise RuntimeError("no compiled object yet")
except KeyboardInterrupt:
    print("interrupted")
    print(signal.getsignal(signal.SIGINT) is signal.default_int_handler)
"""
    )
    assert done.stdout.split() == ["interrupted", "True"]


def test_kept_interrupts_leave_other_errors_in_finalizers_visible() -> None:
    done = run("""
from realitygap._interrupts import kept_interrupts
class Thing:
    def __del__(self):
        raise ZeroDivisionError
with kept_interrupts():
    Thing()
""")
    assert "ZeroDivisionError" in done.stderr


def test_command_ends_with_130_after_an_interrupt_that_python_drops() -> None:
    done = run(DROPS["callback from C"] + IN_A_COMMAND)
    assert done.returncode == 130
    assert done.stdout.split() == ["dropped"]
    assert "Traceback" not in done.stderr


def test_process_of_the_lab_ends_with_130_after_an_interrupt_that_python_drops() -> None:
    done = run(DROPS["callback from C"] + IN_A_PROCESS_OF_THE_LAB)
    assert done.returncode == 130, done.stderr
    assert '"Interrupted"' in done.stdout


@pytest.mark.parametrize("place", [IN_A_COMMAND, IN_A_PROCESS_OF_THE_LAB])
def test_an_interrupt_in_a_class_body_ends_without_a_traceback(place: str) -> None:
    done = run(IN_A_CLASS_BODY + place)
    assert done.returncode == 130, done.stderr
    assert "Traceback" not in done.stderr


def test_interrupt_while_a_module_of_an_extra_is_loaded_is_no_missing_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """MuJoCo reports Ctrl-C as 'ImportError: initialization failed', whose cause is the interrupt."""
    (tmp_path / "loaded_in_c.py").write_text(
        "try:\n    raise KeyboardInterrupt\nexcept KeyboardInterrupt as error:\n"
        "    raise ImportError('initialization failed') from error\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        from_extra("loaded_in_c", "twin")
