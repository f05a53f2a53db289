"""Signal handlers that make a terminated program stop the motors first."""

from __future__ import annotations

import contextlib
import signal
import threading
from types import FrameType
from typing import Any

_ENDING = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)]
"""Signals that end a program without an exception by default: from `kill`, or a closed terminal or window."""


class Exits:
    """While a robot is open, converts signals that end the program to `SystemExit`, so that `with` blocks are left.

    This affects only signals that have no other handler. It works in the main thread only, as Python requires. Each
    open robot registers once.
    """

    def __init__(self) -> None:
        self._n_open = 0
        self._changed: dict[Any, Any] = {}
        self._lock = threading.Lock()

    def hold(self) -> None:
        """Register one more open robot."""
        with self._lock:
            self._n_open += 1
            if self._changed or threading.current_thread() is not threading.main_thread():
                return
            for number in _ENDING:
                if signal.getsignal(number) is signal.SIG_DFL:
                    self._changed[number] = signal.signal(number, _end)

    def release(self) -> None:
        """Unregister an open robot."""
        with self._lock:
            self._n_open -= 1
            if self._n_open or threading.current_thread() is not threading.main_thread():
                return
            for number, handler in self._changed.items():
                with contextlib.suppress(ValueError):
                    if signal.getsignal(number) is _end:
                        signal.signal(number, handler)
            self._changed.clear()


def _end(number: int, _: FrameType | None) -> None:
    raise SystemExit(128 + number)


EXITS = Exits()
