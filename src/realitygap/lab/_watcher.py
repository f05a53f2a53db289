"""The figures of a study, and trials of it to be played, as the pages see them."""

from __future__ import annotations

import contextlib
import gzip
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ._child import Child

LEAST_S = 5.0
"""Between two drawings of the same figures [s]."""
SHARE = 25.0
"""Figures are drawn for at most one part in so many of a processor's time, however long they take."""
MOST_REPLAYS = 64


class Watcher:
    """What a study looks like now; one process draws for all who watch.

    Attributes:
        figures: Figures by name: caption, alt, and the two drawings (SVG, gzip); or why there is none.
        n_drawn: Counts drawings.
        replays: What was asked to be played, by the key of who asked; or why it cannot be.
        report_said: Why no report could be written; empty otherwise.
        report_stamp: Changes whenever one was written, or could not be.

    Args:
        folder: Of the study.
        root: Where the process works.
        changed: Called after each change, from another thread.
    """

    def __init__(self, folder: Path, root: Path, changed: Callable[[], None]) -> None:
        self.figures: dict[str, dict[str, Any]] = {}
        self.n_drawn = 0
        self.replays: dict[str, dict[str, Any]] = {}
        self.report_said = ""
        self.report_stamp = 0
        self._folder, self._root, self._changed = folder, root, changed
        self._child: Child | None = None
        self._lock = threading.Lock()
        self._stamp: Any = None
        self._due = 0.0
        self._is_drawing = False

    def look(self, stamp: Any) -> None:
        """Have the figures drawn anew where the study has changed, but not too often.

        Args:
            stamp: Changes whenever the study does.
        """
        if stamp == self._stamp or time.monotonic() < self._due:
            return
        self._stamp, self._is_drawing = stamp, True
        self._due = time.monotonic() + 600.0  # until they are drawn
        self._want(what="figures")

    def replay(self, key: str, **wish: Any) -> None:
        """Ask for trials to be played; they come into `replays` under the key."""
        with self._lock:
            self.replays.pop(key, None)
            while len(self.replays) >= MOST_REPLAYS:
                self.replays.pop(next(iter(self.replays)))
        self._want(what="replay", key=key, **wish)

    def write_report(self) -> None:
        """Ask for the report to be written."""
        self.report_said = ""
        self._want(what="report", key="report")

    def end(self) -> None:
        """End the process."""
        if self._child is not None:
            self._child.end()

    def _want(self, **wish: Any) -> None:
        with self._lock:
            if self._child is None or not self._child.is_alive:
                self._child = Child({"work": "watch", "folder": str(self._folder)}, self._root, self._hear)
            self._child.tell({"do": "want", **wish})

    def _hear(self, message: dict[str, Any]) -> None:
        kind = message.get("kind")
        with contextlib.suppress(KeyError):
            if kind == "figure":
                self.figures[message["name"]] = _packed(message)
            elif kind == "drawn":
                self.n_drawn += 1
                self._is_drawing = False
                self._due = time.monotonic() + max(LEAST_S, SHARE * message["seconds"])
            elif kind == "replay":
                self.replays[message["key"]] = message
            elif kind == "report":
                self.report_stamp += 1
            elif kind == "refused" and message["key"] == "report":
                self.report_said = message["text"]
                self.report_stamp += 1
            elif kind == "refused" and message["key"]:
                self.replays[message["key"]] = message
            elif kind == "ended" and self._is_drawing:  # it ended before it had drawn what was asked for
                self._stamp, self._is_drawing = None, False
                self._due = time.monotonic() + LEAST_S
        if kind != "figure":
            self._changed()


def _packed(figure: dict[str, Any]) -> dict[str, Any]:
    """A figure, its drawings packed as they are served."""
    drawn: dict[str, Any] = {
        key: gzip.compress(figure[key].encode(), 6) for key in ("wide", "narrow") if key in figure
    }
    return {**figure, **drawn}
