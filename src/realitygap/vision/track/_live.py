"""Tracking of a robot while it drives, in a separate thread."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from realitygap._closing import ClosedOnExit
from realitygap.errors import VisionError

from ._source import Source
from ._tracker import Tracker
from ._video import Marks, Tracked

PATIENCE_S = 3.0
"""Maximum time for a picture before the camera counts as disconnected."""


class LiveTrack(ClosedOnExit):
    """A track from a live camera: it processes every picture, and returns the robot's poses since `begin`.

    Args:
        source: The camera, whose times are those of `clock`.
        marks: Tags, arena and lens.
        clock: Tells the time [s].
    """

    def __init__(self, source: Source, marks: Marks, clock: Callable[[], float] = time.monotonic) -> None:
        self.marks = marks
        self.now = clock
        self._source = source
        self._tracker = Tracker(marks.tag)
        self._has_come = threading.Condition()
        self._last = -float("inf")
        self._is_closed = False
        self._problem = ""
        self._thread = threading.Thread(target=self._watch, name="camera", daemon=True)
        self._thread.start()

    def _watch(self) -> None:
        problem = f"{self._source.name} gives no more pictures. Is it plugged in?"
        try:
            for at, image in self._source:
                with self._has_come:
                    if self._is_closed:
                        return
                    self._tracker.take(at, image)
                    self._last = at
                    self._has_come.notify_all()
        except Exception as error:  # reported to the thread that waits for a picture
            problem = f"{self._source.name} failed: {error}"
        with self._has_come:
            self._problem = problem
            self._has_come.notify_all()

    def begin(self) -> None:
        """Forget the robot's poses. The corner tags are kept."""
        with self._has_come:
            self._tracker.forget()

    def tracked(self, until_s: float | None = None) -> Tracked:
        """Return the result of tracking since `begin`.

        Args:
            until_s: Wait for a picture of this time or later [s].

        Raises:
            VisionError: The camera is gone, or what it saw does not do, as `Marks.tracked`.
        """
        with self._has_come:
            while until_s is not None and self._last < until_s:
                before = self._last  # each picture counts, as many may still wait to be processed
                self._has_come.wait_for(
                    lambda before=before: self._last > before or bool(self._problem),  # type: ignore[misc]
                    PATIENCE_S,
                )
                if self._last <= before:
                    raise VisionError(
                        self._problem or f"{self._source.name} gave no picture for {PATIENCE_S:g} s."
                    )
            found = self._tracker.sightings()
        return self.marks.tracked(found)

    def close(self) -> None:
        """Let go of the camera; safe to call twice."""
        with self._has_come:
            self._is_closed = True
        self._thread.join(PATIENCE_S)
        self._source.close()
