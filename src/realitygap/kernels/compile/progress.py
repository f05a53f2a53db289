"""Reports of kernels that are compiled; free of imports that take long."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

# Shorter ones are not worth a line.
LONG_S = 1.0

_listener: Callable[[str], None] | None = None
_started: dict[str, tuple[threading.Timer, float]] = {}


def report_compiling(listener: Callable[[str], None]) -> None:
    """Call `listener` with a line when a kernel takes over a second to compile, and with its time at the end."""
    global _listener
    _listener = listener


def begin_compiling(name: str) -> None:
    """Note that the kernel `name` is being compiled."""
    if _listener is None:
        return
    timer = threading.Timer(LONG_S, _listener, [f"Compiling the kernel {name} (once per version) ..."])
    timer.daemon = True
    timer.start()
    _started[name] = (timer, time.monotonic())


def end_compiling(name: str) -> None:
    """Note that the kernel `name` is compiled."""
    if _listener is None or name not in _started:
        return
    timer, start = _started.pop(name)
    timer.cancel()
    seconds = time.monotonic() - start
    if seconds > LONG_S:
        _listener(f"Compiled {name} in {seconds:.0f} s.")
