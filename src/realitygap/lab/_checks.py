"""Study files that are read and checked in their own processes, within a time limit."""

from __future__ import annotations

import contextlib
import threading
from concurrent.futures import Future, InvalidStateError
from pathlib import Path
from typing import Any, Literal, TypeVar

from realitygap.errors import StudyError

from ._child import Child
from ._files import LONGEST_TEXT

LIMIT_S = 30.0
"""How long a check may take [s]. A study of the paper takes about one, and starting Python some more."""
MOST = 4
"""Checks at a time."""

_LATE = (
    f"The check was stopped after {LIMIT_S:g} s; nothing was started. Reading the study, or one of its files, "
    "takes too long. Look at the files, then check again."
)


T = TypeVar("T")


class Check:
    """A process that reads or checks a study file, or waits for one.

    Attributes:
        found: Its result, as `_check_work` gives it.
        seconds: Computing time of the study on this machine [s], some time after `found`; None if it is unknown.

    Args:
        root: The lab's folder.
        allow_code: Whether Python files of tasks may run.
    """

    def __init__(self, root: Path, *, allow_code: bool) -> None:
        self.found: Future[dict[str, Any]] = Future()
        self.seconds: Future[float | None] = Future()
        order = {"work": "check", "root": str(root), "allow_code": allow_code}
        self._child = Child(order, root, self._hear)

    @property
    def is_alive(self) -> bool:
        """True if its process is still running."""
        return self._child.is_alive

    def begin(self, wish: dict[str, str]) -> None:
        """Do something with a text, within the time limit."""
        timer = threading.Timer(LIMIT_S, self.end, [_LATE])
        timer.daemon = True
        timer.start()
        self.seconds.add_done_callback(lambda _: timer.cancel())
        self._child.tell(wish)

    def end(self, why: str = "The check was canceled.") -> None:
        """Stop it."""
        self._answer({"mistakes": why})
        self._child.kill()

    def _hear(self, message: dict[str, Any]) -> None:
        kind = message.get("kind")
        if kind == "found" and "name" in message:  # an estimate follows
            _set(self.found, message)
        elif kind == "found":
            self._answer(message)
        elif kind == "estimated":
            _set(self.seconds, message.get("seconds"))
        elif kind in ("error", "ended"):
            self._answer({"mistakes": message.get("text") or "The process that checks the file ended."})

    def _answer(self, result: dict[str, Any]) -> None:
        """Set what is not known yet."""
        _set(self.found, result)
        _set(self.seconds, None)


class Checks:
    """Starts checks. One process is kept ready, because starting Python takes longer than most checks.

    Args:
        root: The lab's folder.
        allow_code: Whether Python files of tasks may run.
    """

    def __init__(self, root: Path, *, allow_code: bool) -> None:
        self._root = root
        self._allow_code = allow_code
        self._lock = threading.Lock()
        self._ready: Check | None = None
        self._going: list[Check] = []

    @property
    def is_idle(self) -> bool:
        """True if nothing is read, checked, or estimated."""
        with self._lock:
            return all(check.seconds.done() for check in self._going)

    def prepare(self) -> None:
        """Have a process ready for the next check."""
        with self._lock:
            if self._ready is None or not self._ready.is_alive:
                self._ready = self._start()

    def begin(self, do: Literal["read", "check"], text: str) -> Check:
        """Read or check a study file.

        Raises:
            StudyError: The text is far too long, or several checks are running.
        """
        if len(text) > LONGEST_TEXT:
            raise StudyError(f"The file has {len(text):,} letters, expected at most {LONGEST_TEXT:,}.")
        with self._lock:
            self._going = [check for check in self._going if not check.seconds.done()]
            if len(self._going) >= MOST:
                estimating = [check for check in self._going if check.found.done()]
                if not estimating:
                    raise StudyError(f"{MOST} checks are running. Wait until one is done, or cancel it.")
                estimating[0].end()
        self.prepare()
        with self._lock:
            check, self._ready = self._ready or self._start(), None
            self._going.append(check)
        check.begin({"do": do, "text": text})
        self.prepare()
        return check

    def end(self) -> None:
        """End all processes."""
        with self._lock:
            ready, self._ready = self._ready, None
            going, self._going = self._going, []
        for check in [*going, *([] if ready is None else [ready])]:
            check.end()

    def _start(self) -> Check:
        return Check(self._root, allow_code=self._allow_code)


def _set(future: Future[T], value: T) -> None:
    with contextlib.suppress(InvalidStateError):
        future.set_result(value)
