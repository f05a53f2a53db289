"""So that a program that is told to end does so by the way on which motors are stopped."""

from __future__ import annotations

import contextlib
import signal
import threading
from types import FrameType
from typing import Any

_ENDING = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)]
"""What ends a program without a word, where it has not said otherwise: `kill`, and a closed terminal or window."""


class Exits:
    """While a robot is open, turns signals that end the program into `SystemExit`, so that `with` blocks are left.

    Only signals that nobody else handles, and only from the main thread, where Python allows it. Each open robot
    holds it once.
    """

    def __init__(self) -> None:
        self._n_open = 0
        self._changed: dict[Any, Any] = {}
        self._lock = threading.Lock()

    def hold(self) -> None:
        """One more robot is open."""
        with self._lock:
            self._n_open += 1
            if self._changed or threading.current_thread() is not threading.main_thread():
                return
            for number in _ENDING:
                if signal.getsignal(number) is signal.SIG_DFL:
                    self._changed[number] = signal.signal(number, _end)

    def release(self) -> None:
        """One less is."""
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
