"""The figures of a study, and trials of it to be played, as the pages see them."""

from __future__ import annotations

import gzip
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypedDict

from realitygap.drawing import themed_file

from . import _messages as messages
from ._drawing import OF_ONE, Drawer, DrawingWish
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


class PackedFigure(TypedDict, total=False):
    """A `Figure` with its drawings packed by gzip, as they are served; another drawing has another `version`."""

    version: int
    caption: str
    alt: str
    wide: bytes
    narrow: bytes
    text: str


class Watcher:
    """Figures of a study, drawn once for all pages.

    Attributes:
        figures: Figures by name: caption, alt, and the two drawings (SVG, gzip); or why there is none.
        n_drawn: Counts drawings.
        rows: Condition, label, number of runs, median best coverage, and its interval, for each condition.
        curves: Best coverage of each condition by generation, as `curves_of` returns it.
        replays: What was asked to be played, by the key of who asked; or why it cannot be.
        archives: The elites of the typical run of each condition; or why they cannot be listed.
        report_problem: Why no report could be written; empty otherwise.
        report_stamp: Changes whenever one was written, or could not be.

    Args:
        folder: Of the study.
        drawer: The process that draws.
        changed: Called after each change, from another thread.
    """

    def __init__(self, folder: Path, drawer: Drawer, changed: Callable[[], None]) -> None:
        self.figures: dict[str, PackedFigure] = {}
        self.n_drawn = 0
        self.rows: list[messages.SummaryRow] = []
        self.curves: list[messages.Curve] = []
        self.replays: dict[str, messages.Replay | messages.ReplayRefused] = {}
        self.archives: dict[str, messages.Archive | messages.ReplayRefused] = {}
        self.report_problem = ""
        self.report_stamp = 0
        self._folder, self._drawer, self._changed = folder, drawer, changed
        self._lock = threading.Lock()
        self._stamp: tuple[int, int, bool] | None = None
        self._due = 0.0
        self._since = time.monotonic()
        self._not_before = 0.0
        self._is_drawing = False
        self._typical: set[str] = set()
        self._archive_of: dict[str, tuple[int, int, bool] | None] = {}
        self._archives_due: set[str] = set()
        self._drawn_of: dict[str, tuple[int, int, bool] | None] = {}
        self._version = 0
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
            for name, figure in figures.items():
                self._put(name, figure)
            self.n_drawn += 1
            self._changed()
            return
        self._stamp, self._is_drawing = stamp, True
        self._want(messages.FiguresWish(str(self._folder), done, list(LIVE) if is_running else None))

    def want_figures_of(self, condition: str) -> None:
        """Have the figures that show one condition drawn for this one, once after each drawing of all figures."""
        if not self._is_drawing and self._drawn_of.get(condition) != self._stamp:
            self._drawn_of[condition] = self._stamp
            self._want(messages.FiguresWish(str(self._folder), (), list(OF_ONE), condition))

    def _put(self, name: str, figure: messages.Figure) -> None:
        self._version += 1
        self.figures[name] = {**_packed(figure), "version": self._version}

    def want_thumbnail(self, done: tuple[int, int]) -> None:
        """Have the small picture and the summary of these runs saved in the study's folder, once."""
        if self._thumbnail != done:
            self._thumbnail = done
            self._want(messages.ThumbnailWish(str(self._folder), done))

    def typical(self, condition: str, done: int) -> messages.Replay | messages.ReplayRefused | None:
        """Return the typical run of a condition to be played, or why it cannot be; ask for it and return None before.

        Args:
            condition: Name of the condition.
            done: Number of complete runs. Another number asks again.
        """
        key = f"typical {done} {condition}"
        return self._once(messages.ReplayWish(str(self._folder), key, [{"condition": condition}]))

    def generations(
        self, condition: str, *, is_last: bool
    ) -> messages.Replay | messages.ReplayRefused | None:
        """Return the paths of a run by generation, or why there are none; ask for them and return None before.

        Args:
            condition: Name of the condition.
            is_last: Whether it is the last published run, anew with each drawing of figures, or the typical one.
        """
        key = f"run {self.n_drawn if is_last else self._stamp} {condition}"
        return self._once(messages.RunWish(str(self._folder), key, condition, is_last))

    def archive(self, condition: str) -> messages.Archive | messages.ReplayRefused | None:
        """Return the elites of the typical run of a condition, or why there are none; ask and return None before."""
        if condition not in self._archive_of or self._archive_of[condition] != self._stamp:
            self._archive_of[condition] = self._stamp
            self._archives_due.add(condition)
            self._want(messages.ArchiveWish(str(self._folder), condition, condition))
        return self.archives.get(condition)

    def _once(
        self, wish: messages.ReplayWish | messages.RunWish
    ) -> messages.Replay | messages.ReplayRefused | None:
        """Return the answer to a wish; ask and return None before."""
        with self._lock:
            found = self.replays.get(wish.key)
            if found is not None or wish.key in self._typical:
                return found
            self._typical.add(wish.key)
        self._play(wish)
        return None

    def replay(self, key: str, choices: list[messages.TrialChoice]) -> None:
        """Ask for trials to be played; they come into `replays` under the key."""
        self._play(messages.ReplayWish(str(self._folder), key, choices))

    def touch(
        self, key: str, choice: messages.TrialChoice, weights: dict[str, float], cut: list[str]
    ) -> None:
        """Ask for a trial with a changed network, as `replay` does."""
        self._play(messages.TouchWish(str(self._folder), key, choice, weights, cut))

    def _play(self, wish: messages.ReplayWish | messages.RunWish | messages.TouchWish) -> None:
        with self._lock:
            self.replays.pop(wish.key, None)
            while len(self.replays) >= MOST_REPLAYS:
                oldest = next(iter(self.replays))
                del self.replays[oldest]
                self._typical.discard(oldest)
        self._want(wish)

    def write_report(self) -> None:
        """Ask for the report to be written."""
        self.report_problem = ""
        self._want(messages.ReportWish(str(self._folder)))

    def _want(self, wish: DrawingWish) -> None:
        self._drawer.want(wish, self._hear)

    def _hear(self, message: messages.Message) -> None:
        match message:
            case messages.FigureDrawn():
                self._put(message.name, message.figure)
            case messages.FiguresDrawn():
                self.n_drawn += 1
                self._is_drawing = False
                now = time.monotonic()
                pause = min(SHARE * message.seconds, GROWTH * (now - self._since))
                self._due = now + max(LEAST_S, pause)
            case messages.StudySummary():
                self.rows, self.curves = message.rows, message.curves
            case messages.Archive() | messages.ReplayRefused() if message.key in self._archive_of:
                self.archives[message.key] = message
                self._archives_due.discard(message.key)
            case messages.Replay() | messages.ReplayRefused():
                self.replays[message.key] = message
            case messages.ReportWritten():
                self.report_problem = message.problem
                self.report_stamp += 1
            case messages.Ended():
                self._typical.intersection_update(self.replays)
                for condition in self._archives_due:  # without an answer, they are asked for again
                    del self._archive_of[condition]
                self._archives_due.clear()
                for condition in list(self._drawn_of):
                    if not any(name.endswith(f"-{condition}") for name in list(self.figures)):
                        del self._drawn_of[condition]
                if self._is_drawing:  # it ended before it had drawn what was asked for
                    self._stamp, self._is_drawing = None, False
                    self._not_before = time.monotonic() + RETRY_S
        self._changed()


def _packed(figure: messages.Figure) -> PackedFigure:
    if "wide" not in figure:
        return {"text": figure["text"]}
    return {
        "caption": figure["caption"],
        "alt": figure["alt"],
        "wide": gzip.compress(themed_file(figure["wide"]).encode(), 6),
        "narrow": gzip.compress(themed_file(figure["narrow"]).encode(), 6),
    }
