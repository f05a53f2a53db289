"""The process that draws for all studies of a lab: starting one takes longer than drawing."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ._child import Child


class Drawer:
    """Passes wishes of all studies to one process, and its answers back.

    Args:
        root: Folder in which the process works.
    """

    def __init__(self, root: Path) -> None:
        self._root = root
        self._child: Child | None = None
        self._hearers: dict[str, Callable[[dict[str, Any]], None]] = {}
        self._lock = threading.Lock()

    def prepare(self) -> None:
        """Start the process, so that it is ready when a figure is needed."""
        with self._lock:
            self._start()

    def want(self, folder: Path, hear: Callable[[dict[str, Any]], None], **wish: Any) -> None:
        """Ask for something about a study.

        Args:
            folder: Folder of the study.
            hear: Takes each answer about this study, in another thread.
            wish: `what`, and the arguments of `_watch_work`.
        """
        with self._lock:
            self._hearers[str(folder)] = hear
            self._start().tell({"do": "want", "folder": str(folder), **wish})

    def end(self) -> None:
        """End the process."""
        if self._child is not None:
            self._child.end()

    @property
    def process_id(self) -> int | None:
        """Number of the process; None if there is none."""
        return None if self._child is None else self._child.process_id

    def _start(self) -> Child:
        if self._child is None or not self._child.is_alive:
            self._child = Child({"work": "watch"}, self._root, self._hear)
        return self._child

    def _hear(self, message: dict[str, Any]) -> None:
        if message.get("kind") == "ended":
            for hear in list(self._hearers.values()):
                hear(message)
        elif (hearer := self._hearers.get(str(message.get("folder")))) is not None:
            hearer(message)
