"""Handling of Ctrl-C at moments at which Python would drop it, or at which it would break other code."""

from __future__ import annotations

import _thread
import contextlib
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType

AGAIN_S = 0.05
"""Time after which an interrupt is repeated [s]; by then Python runs other code."""
CALLBACKS = ("_raw_object_cache_notify", "_raw_object_cache_getbuffer")
"""Functions of llvmlite that LLVM calls. A signal during a compilation is handled in the first of them."""
RUST_LIBRARY = "polars"
"""Its compiled code calls its Python code, and panics with a backtrace if an exception comes out of that."""

_repeats: list[threading.Timer] = []


@contextlib.contextmanager
def kept_interrupts() -> Iterator[None]:
    """Repeat, until the end of a block, each Ctrl-C that Python would drop.

    Python cannot raise KeyboardInterrupt in a callback from C, in the callback of a weak reference, or in a
    finalizer: it prints "Exception ignored" there and continues. Numba compiles and loads kernels through callbacks
    from C, and fails later if one of them was cut off. So interrupts wait for the end of such a callback, and for the
    end of a call of polars.

    Raises:
        KeyboardInterrupt: An interrupt was still to be repeated when the block ended or failed.
    """
    usual = sys.unraisablehook

    def repeat_interrupt(unraisable: sys.UnraisableHookArgs) -> None:
        if unraisable.exc_type is KeyboardInterrupt:
            _repeat_later()
        else:
            usual(unraisable)

    is_main = threading.current_thread() is threading.main_thread()
    installs = is_main and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    sys.unraisablehook = repeat_interrupt
    if installs:
        signal.signal(signal.SIGINT, on_interrupt)
    try:
        yield
    finally:
        sys.unraisablehook = usual
        if installs and signal.getsignal(signal.SIGINT) is on_interrupt:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        is_pending = any(timer.is_alive() for timer in _repeats)
        for timer in _repeats:
            timer.cancel()
        _repeats.clear()
        if is_pending:
            raise KeyboardInterrupt


@contextlib.contextmanager
def held_interrupts() -> Iterator[None]:
    """Hold Ctrl-C back until the end of a block; a second one is immediate.

    In another library's code, such as a finalizer, it may be lost or become that library's own error. If another
    handler is installed, and in threads other than the main one, nothing changes.

    Raises:
        KeyboardInterrupt: It came in the block.
    """
    is_main = threading.current_thread() is threading.main_thread()
    handler = signal.getsignal(signal.SIGINT)
    if not is_main or handler not in (signal.default_int_handler, on_interrupt):
        yield
        return
    came = False

    def note(*_: object) -> None:
        nonlocal came
        if came:
            raise KeyboardInterrupt
        came = True

    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
    if came:
        raise KeyboardInterrupt


def on_interrupt(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, or repeat the signal later if code that must not be cut off is running."""
    while frame is not None:
        library = str(frame.f_globals.get("__name__")).partition(".")[0]
        if frame.f_code.co_name in CALLBACKS or library == RUST_LIBRARY:
            _repeat_later()
            return
        frame = frame.f_back
    raise KeyboardInterrupt


def _repeat_later() -> None:
    timer = threading.Timer(AGAIN_S, interrupt)
    timer.daemon = True
    timer.start()
    _repeats.append(timer)


def interrupt() -> None:
    """Interrupt the main thread as Ctrl-C does, also while it waits."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        _thread.interrupt_main()
