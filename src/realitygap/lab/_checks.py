"""Study files that are read and checked in their own processes, within a time limit."""

from __future__ import annotations

import contextlib
import threading
from concurrent.futures import Future, InvalidStateError
from pathlib import Path
from typing import Any, Literal

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


class Check:
    """A study file that is being read or checked.

    Attributes:
        found: Its result, as `_check_work` gives it.

    Args:
        child: The process, which waits for it.
        found: Is given the result.
        wish: What to do with which text.
    """

    def __init__(self, child: Child, found: Future[dict[str, Any]], wish: dict[str, str]) -> None:
        self.found = found
        self._child = child
        self._timer = threading.Timer(LIMIT_S, self.end, [_LATE])
        self._timer.daemon = True
        self._timer.start()
        found.add_done_callback(lambda _: self._timer.cancel())
        child.tell(wish)

    def end(self, why: str = "The check was canceled.") -> None:
        """Stop it."""
        _answer(self.found, {"mistakes": why})
        self._child.kill()


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
        self._ready: tuple[Child, Future[dict[str, Any]]] | None = None
        self._going: list[Check] = []

    def prepare(self) -> None:
        """Have a process ready for the next check."""
        with self._lock:
            if self._ready is None or not self._ready[0].is_alive:
                self._ready = self._start()

    def begin(self, do: Literal["read", "check"], text: str) -> Check:
        """Read or check a study file.

        Raises:
            StudyError: The text is far too long, or several checks are running.
        """
        if len(text) > LONGEST_TEXT:
            raise StudyError(f"The file has {len(text):,} letters, expected at most {LONGEST_TEXT:,}.")
        with self._lock:
            self._going = [check for check in self._going if not check.found.done()]
            if len(self._going) >= MOST:
                raise StudyError(f"{MOST} checks are running. Wait until one is done, or cancel it.")
        self.prepare()
        with self._lock:
            (child, found), self._ready = self._ready or self._start(), None
            check = Check(child, found, {"do": do, "text": text})
            self._going.append(check)
        self.prepare()
        return check

    def end(self) -> None:
        """End all processes."""
        with self._lock:
            ready, self._ready = self._ready, None
            going, self._going = self._going, []
        if ready is not None:
            ready[0].kill()
        for check in going:
            check.end()

    def _start(self) -> tuple[Child, Future[dict[str, Any]]]:
        found: Future[dict[str, Any]] = Future()

        def hear(message: dict[str, Any]) -> None:
            kind = message.get("kind")
            if kind == "found":
                _answer(found, message)
            elif kind in ("error", "ended"):
                _answer(found, {"mistakes": message.get("text") or "The process that checks the file ended."})

        order = {"work": "check", "root": str(self._root), "allow_code": self._allow_code}
        return Child(order, self._root, hear), found


def _answer(found: Future[dict[str, Any]], result: dict[str, Any]) -> None:
    with contextlib.suppress(InvalidStateError):
        found.set_result(result)
