"""Ctrl-C at a moment of our choice."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator

from realitygap._interrupts import on_interrupt


@contextlib.contextmanager
def held_interrupts() -> Iterator[None]:
    """Hold Ctrl-C back until the end of a block; a second one is immediate.

    In the middle of another library's code it may be lost, as in a finalizer, or come out as that library's own error.
    Where somebody else handles it, and in other threads than the main one, nothing changes.

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
