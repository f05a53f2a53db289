"""A port on which a robot is looked for, as the pages see it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ._job import Job

_SHOWN = ("port", "label")
"""Facts that are shown next to the others anyway."""


class IdentifyJob(Job):
    """A robot that is asked for its name, once, because a visitor wants it.

    Attributes:
        port: Name of the port.
    """

    STOPPED = "Stopped."
    LOST = "The process that looked for a robot ended (status {status}). Try again."

    def __init__(self, port: str, root: Path, changed: Callable[[], None]) -> None:
        self.port = port
        self._answer = ""
        super().__init__({"work": "identify", "port": port}, root, changed)

    @property
    def reply(self) -> str:
        """Reply on the port, in words."""
        if self.outcome is None:
            return "Looking for a robot…"
        return f"No robot found. {self.outcome}" if self.is_failed else self.outcome

    def _on_met(self, message: dict[str, Any]) -> None:
        facts = dict(message["facts"])
        name = facts.pop("name", "A robot without a name")
        words = [f"{key.replace('_', ' ')} {value}" for key, value in facts.items() if key not in _SHOWN]
        self._answer = f"{name} answered ({message['label']}): {', '.join(words)}."

    def _on_ended(self, message: dict[str, Any]) -> None:
        if self._answer:
            self.outcome = self.outcome or self._answer  # not before the port is free again
        super()._on_ended(message)
