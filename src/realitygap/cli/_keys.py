"""Lines, decisions, and single keys from a terminal."""

from __future__ import annotations

import contextlib
import os
import select
import sys
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from realitygap.trials import Verdict

_NAMES = {
    "\x1b[A": "up", "\x1b[B": "down", "\x1b[C": "right", "\x1b[D": "left",
    "\x1bOA": "up", "\x1bOB": "down", "\x1bOC": "right", "\x1bOD": "left",
    "\r": "enter", "\n": "enter", " ": "space", "\x1b": "escape", "\x7f": "backspace", "\x08": "backspace",
}  # fmt: skip

_REST_S = 0.05
"""Maximum time for the remaining letters of an arrow key."""


def read_line() -> str:
    """Return a typed line, without blanks around it.

    Ctrl-C ends it immediately. A plain `input` would continue to read, because polars has interrupted calls restarted,
    but `select` is never restarted.

    Raises:
        KeyboardInterrupt: Ctrl-C, or the terminal is gone.
    """
    if sys.platform != "win32":
        select.select([sys.stdin], [], [])
    line = sys.stdin.readline()
    if not line:
        raise KeyboardInterrupt
    return line.strip()


class NoKeys:
    """Keys without a terminal: no key is ever pressed."""

    def read(self, timeout_s: float | None = None) -> str | None:
        """Return None, because no key is ever pressed."""
        return None


if sys.platform == "win32":
    import msvcrt
    import time

    _WINDOWS = {"H": "up", "P": "down", "M": "right", "K": "left"}

    class Keys:
        """Keys of the console."""

        def read(self, timeout_s: float | None = None) -> str | None:
            """Return the next key by its name or letter; None if none arrives in time."""
            until = None if timeout_s is None else time.monotonic() + timeout_s
            while not msvcrt.kbhit():
                if until is not None and time.monotonic() >= until:
                    return None
                time.sleep(0.01)
            letter = msvcrt.getwch()
            if letter in ("\x00", "\xe0"):
                return _WINDOWS.get(msvcrt.getwch(), "")
            if letter == "\x03":
                raise KeyboardInterrupt
            return _NAMES.get(letter, letter)

    @contextlib.contextmanager
    def single_keys() -> Iterator[Keys | NoKeys]:
        """Yield keys as they are pressed, while in the block."""
        yield Keys() if sys.stdin is not None and sys.stdin.isatty() else NoKeys()

else:
    import termios
    import tty

    class Keys:
        """Keys of a terminal in cbreak mode."""

        def __init__(self, descriptor: int) -> None:
            self._descriptor = descriptor

        def read(self, timeout_s: float | None = None) -> str | None:
            """Return the next key by its name or letter; None if none arrives in time.

            Raises:
                KeyboardInterrupt: The terminal is gone.
            """
            if not self._is_there(timeout_s):
                return None
            text = self._letter()
            while text in ("\x1b", "\x1b[", "\x1bO") and self._is_there(_REST_S):
                text += self._letter()
            return _NAMES.get(text, text)

        def _is_there(self, timeout_s: float | None) -> bool:
            return bool(select.select([self._descriptor], [], [], timeout_s)[0])

        def _letter(self) -> str:
            data = os.read(self._descriptor, 1)
            if not data:
                raise KeyboardInterrupt
            return data.decode("latin-1")

    @contextlib.contextmanager
    def single_keys() -> Iterator[Keys | NoKeys]:
        """Yield keys as they are pressed, while in the block; the terminal is as it was afterwards."""
        if sys.stdin is None or not sys.stdin.isatty():
            yield NoKeys()
            return
        descriptor = sys.stdin.fileno()
        before = termios.tcgetattr(descriptor)
        try:
            tty.setcbreak(descriptor, termios.TCSANOW)
            yield Keys(descriptor)
        finally:
            termios.tcsetattr(descriptor, termios.TCSANOW, before)


def ask_verdict(ask: Callable[[], str]) -> Verdict:
    """Ask until a person has decided about a trial that was cut off."""
    while True:
        answer = ask().lower()
        if answer in ("v", "void", "d", "driven"):
            return "void" if answer.startswith("v") else "driven"
