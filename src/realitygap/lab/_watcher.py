"""The figures of a study, and trials of it to be played, as the pages see them."""

from __future__ import annotations

import contextlib
import gzip
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from realitygap.drawing import themed_file

from ._drawer import Drawer
from ._figure_cache import read_figures

LEAST_S = 1.0
"""Shortest time between two drawings of the same figures [s]."""
SHARE = 25.0
"""For a long study, one processor draws its figures for at most one part in 25 of its time."""
GROWTH = 0.2
"""Before that, figures are drawn again after this share of the time for which they have been watched."""
RETRY_S = 5.0
"""Time until figures are drawn again after the process that draws them ended early [s]."""
LIVE = ("scores", "coverage")
"""Figures that are drawn while a study runs; all are drawn when it stops."""
MOST_REPLAYS = 64


class Watcher:
    """Figures of a study, drawn once for all pages.

    Attributes:
        figures: Figures by name: caption, alt, and the two drawings (SVG, gzip); or why there is none.
        n_drawn: Counts drawings.
        rows: Condition, label, number of runs, median best coverage, and its interval, for each condition.
        curves: Best coverage of each condition by generation, as `curves_of` returns it.
        replays: What was asked to be played, by the key of who asked; or why it cannot be.
        report_said: Why no report could be written; empty otherwise.
        report_stamp: Changes whenever one was written, or could not be.

    Args:
        folder: Of the study.
        drawer: The process that draws.
        changed: Called after each change, from another thread.
    """

    def __init__(self, folder: Path, drawer: Drawer, changed: Callable[[], None]) -> None:
        self.figures: dict[str, dict[str, Any]] = {}
        self.n_drawn = 0
        self.rows: list[dict[str, Any]] = []
        self.curves: list[dict[str, Any]] = []
        self.replays: dict[str, dict[str, Any]] = {}
        self.report_said = ""
        self.report_stamp = 0
        self._folder, self._drawer, self._changed = folder, drawer, changed
        self._lock = threading.Lock()
        self._stamp: Any = None
        self._due = 0.0
        self._since = time.monotonic()
        self._not_before = 0.0
        self._is_drawing = False
        self._typical: set[str] = set()
        self._thumbnail: tuple[int, int] | None = None

    def look(self, done: tuple[int, int], *, is_running: bool = False) -> None:
        """Have the figures drawn again if the study has changed, but not too often while it runs.

        Args:
            done: Number of complete runs: simulated, and driven.
            is_running: Whether the study runs.
        """
        stamp = (*done, is_running)
        earliest = max(self._due if is_running else 0.0, self._not_before)
        if self._is_drawing or stamp == self._stamp or time.monotonic() < earliest:
            return
        if self._stamp is None and (kept := read_figures(self._folder, done)) is not None:
            self._stamp = stamp
            self.rows, self.curves, figures = kept
            self.figures = {name: _packed(figure) for name, figure in figures.items()}
            self.n_drawn += 1
            self._changed()
            return
        self._stamp, self._is_drawing = stamp, True
        self._want(what="figures", names=list(LIVE) if is_running else None, done=list(done))

    def want_thumbnail(self, done: tuple[int, int]) -> None:
        """Have the small picture and the summary of these runs saved in the study's folder, once."""
        if self._thumbnail != done:
            self._thumbnail = done
            self._want(what="thumbnail", done=list(done))

    def typical(self, condition: str, done: int) -> dict[str, Any] | None:
        """Return the typical run of a condition to be played, or why it cannot be; ask for it and return None before.

        Args:
            condition: Name of the condition.
            done: Number of complete runs. Another number asks again.
        """
        key = f"typical {done} {condition}"
        with self._lock:
            found = self.replays.get(key)
            if found is not None or key in self._typical:
                return found
            self._typical.add(key)
        self.replay(key, [{"condition": condition}])
        return None

    def replay(self, key: str, choices: list[dict[str, Any]]) -> None:
        """Ask for trials to be played; they come into `replays` under the key."""
        with self._lock:
            self.replays.pop(key, None)
            while len(self.replays) >= MOST_REPLAYS:
                oldest = next(iter(self.replays))
                del self.replays[oldest]
                self._typical.discard(oldest)
        self._want(what="replay", key=key, choices=choices)

    def write_report(self) -> None:
        """Ask for the report to be written."""
        self.report_said = ""
        self._want(what="report", key="report")

    def _want(self, **wish: Any) -> None:
        self._drawer.want(self._folder, self._hear, **wish)

    def _hear(self, message: dict[str, Any]) -> None:
        kind = message.get("kind")
        with contextlib.suppress(KeyError):
            if kind == "figure":
                self.figures[message["name"]] = _packed(message)
            elif kind == "drawn":
                self.n_drawn += 1
                self._is_drawing = False
                now = time.monotonic()
                pause = min(SHARE * message["seconds"], GROWTH * (now - self._since))
                self._due = now + max(LEAST_S, pause)
            elif kind == "summary":
                self.rows, self.curves = message["rows"], message["curves"]
            elif kind == "replay":
                self.replays[message["key"]] = message
            elif kind == "report":
                self.report_stamp += 1
            elif kind == "refused" and message["key"] == "report":
                self.report_said = message["text"]
                self.report_stamp += 1
            elif kind == "refused" and message["key"]:
                self.replays[message["key"]] = message
            elif kind == "ended":
                self._typical.intersection_update(self.replays)
                if self._is_drawing:  # it ended before it had drawn what was asked for
                    self._stamp, self._is_drawing = None, False
                    self._not_before = time.monotonic() + RETRY_S
        self._changed()


def _packed(figure: dict[str, Any]) -> dict[str, Any]:
    """A figure, its drawings packed as they are served."""
    drawn: dict[str, Any] = {
        key: gzip.compress(themed_file(figure[key]).encode(), 6)
        for key in ("wide", "narrow")
        if key in figure
    }
    return {**figure, **drawn}
