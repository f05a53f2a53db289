"""Work in its own process, as the pages see it."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar

from ._child import Child

MOST_POINTS = 4000
"""Largest number of points of a robot's line on a page: 200 s."""


class Job:
    """Something at work.

    Each thing that its process says changes it, by the method that is named for it, such as `_on_done`. The process
    speaks from the beginning on: attributes are there before this class is initialized.

    Attributes:
        ask: What somebody has to answer before it goes on; None where nothing waits.
        outcome: What it ended with: a message; None while it goes on.
        is_failed: Whether that was a failure.
        is_link_lost: Whether it failed because the robot did not answer or did not obey.

    Args:
        order: What the process is told first.
        root: Where it works.
        changed: Called after each change, but those of which too many come, from another thread.
    """

    QUIET: ClassVar[frozenset[str]] = frozenset()
    """Kinds of messages that are so frequent that pages poll for them."""

    STOPPED: ClassVar = "Stopped."
    LOST: ClassVar = "Its process ended (status {status})."

    def __init__(self, order: Mapping[str, Any], root: Path, changed: Callable[[], None]) -> None:
        self.ask: dict[str, Any] | None = None
        self.outcome: str | None = None
        self.is_failed = self.is_link_lost = False
        self._asking = threading.Lock()
        self._changed = changed
        self._child = Child(order, root, self._hear)

    @property
    def is_over(self) -> bool:
        """True if it has ended."""
        return self.outcome is not None

    @property
    def has_met(self) -> bool:
        """True if a robot has answered."""
        return False

    @property
    def is_lost(self) -> bool:
        """True if it had a robot, and the link to it has failed."""
        return self.is_link_lost and self.has_met

    def answer(self, number: int, **values: Any) -> bool:
        """Answer the question of this number; False where it is not asked any more.

        A tap belongs to the question that it was made for: a second one must not answer what is asked next.
        """
        with self._asking:
            if self.ask is None or self.ask["number"] != number:
                return False
            self.ask = None
        self._child.tell({"do": "answer", "number": number, **values})
        self._changed()
        return True

    def ask_to_end(self) -> None:
        """Ask the process to stop its motors and to end. Recorded data are kept."""
        self._child.ask_to_end()

    def end(self) -> None:
        """Ask the process to end, and wait for its end."""
        self._child.end()

    def _hear(self, message: dict[str, Any]) -> None:
        kind = message.get("kind")
        handler = getattr(self, f"_on_{kind}", None)
        if handler is not None:
            with contextlib.suppress(KeyError, TypeError):
                handler(message)
        if kind not in self.QUIET:
            self._changed()

    def _on_ask(self, message: dict[str, Any]) -> None:
        with self._asking:
            self.ask = message

    def _on_answered(self, message: dict[str, Any]) -> None:
        with self._asking:
            if self.ask is not None and self.ask["number"] == message["number"]:
                self.ask = None

    def _on_error(self, message: dict[str, Any]) -> None:
        self.is_link_lost = bool(message.get("is_of_robot"))
        self.outcome, self.is_failed = message["text"], True

    def _on_interrupted(self, message: dict[str, Any]) -> None:
        self.outcome = self.STOPPED

    def _on_ended(self, message: dict[str, Any]) -> None:
        self.ask = None
        if self.outcome is None:
            self.outcome, self.is_failed = self.LOST.format(status=message["status"]), True
