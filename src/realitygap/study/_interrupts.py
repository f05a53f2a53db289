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
