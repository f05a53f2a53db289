"""A trial that is driven for those who look, as the pages see it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ._job import MOST_POINTS, Job


class LiveJob(Job):
    """A robot that is driven while pages look.

    Attributes:
        scene: What stands still; None before the robot is there.
        trials: What can be played: a trial in which nothing has happened yet, and in the end all of it.
        messages: What pages are told of it, in order; `n_told` of them so far, the older ones forgotten.

    Args:
        order: What the process is told.
        root: Where it works.
        changed: Called when it begins and ends, from another thread.
    """

    QUIET = frozenset({"told"})

    def __init__(self, order: dict[str, Any], root: Path, changed: Callable[[], None]) -> None:
        self.scene: dict[str, Any] | None = None
        self.trials: list[dict[str, Any]] = []
        self.messages: list[dict[str, Any]] = []
        self.n_told = 0
        self._trail: list[list[float]] = []
        self._cells: list[int] = []
        super().__init__({"work": "live", **order}, root, changed)

    @property
    def is_live(self) -> bool:
        """True if it drives."""
        return self.scene is not None and not self.is_over

    def since(self, n: int) -> list[dict[str, Any]]:
        """Return the messages after the first n; one message with everything if they were forgotten."""
        n_new = self.n_told - n
        if not self.messages or n_new <= 0:
            return []
        if n and n_new <= len(self.messages):
            return self.messages[-n_new:]
        last = {**self.messages[-1], "trail": self._trail[:-1], "cells": self._cells, "lasts": 0.0}
        return [{"kind": "begin"}, last]

    def _on_begun(self, message: dict[str, Any]) -> None:
        self.trials, self.scene = message["trials"], message["scene"]

    def _on_played(self, message: dict[str, Any]) -> None:
        self.trials = message["trials"]
        self.outcome = message["problem"] or "Driven."

    def _on_told(self, message: dict[str, Any]) -> None:
        """Remember where the robot was, for pages that come later."""
        content = message["content"]
        if content.get("kind") != "now":
            self._trail, self._cells, self.messages = [], [], []
            return
        self._trail = [*self._trail, *content["trail"], content["pose"][:2]][-MOST_POINTS:]
        self._cells += content["cells"]
        self.messages = [*self.messages[-40:], content]
        self.n_told += 1
