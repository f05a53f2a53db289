"""A part of a page that is drawn again only when its content has changed."""

from __future__ import annotations

from collections.abc import Callable
from inspect import isawaitable
from typing import Any, Generic, TypeVar

from nicegui import ui

from realitygap.lab._lab import Lab

LOOK_S = 0.25
"""Time between two looks of a page for changes [s]."""

T = TypeVar("T")


class Part(Generic[T]):
    """A part of a page.

    What is under a finger stays, and keeps the focus. So each part has its own state, and is drawn from a single look
    at it, by which the next look is compared. `serve_late_presses` serves presses that arrive after a drawing.

    Args:
        stand: What there is to show: something that can be compared.
        show: Shows it.
    """

    def __init__(self, stand: Callable[[], T], show: Callable[[T], None]) -> None:
        self._stand = stand
        self._show = show
        self._shown: T
        self._is_due = False

    def show(self) -> None:
        """Show the part for the first time."""
        self._refreshable = ui.refreshable(self._draw)
        self._refreshable()

    def look(self) -> None:
        """Draw the part again if its content has changed."""
        if not self._is_due and self._stand() != self._shown:
            self._is_due = True
            self._refreshable.refresh()

    def refresh(self) -> None:
        """Draw the part again although its content is the same."""
        self._is_due = True
        self._refreshable.refresh()

    def _draw(self) -> None:
        self._is_due = False
        now = self._stand()
        self._show(now)
        self._shown = now  # only once it is shown: where that failed the next look tries again


def watching(lab: Lab, show: Callable[[], Any]) -> None:
    """Show something again whenever the lab has changed; `show` may be a coroutine."""
    seen = lab.version

    async def look() -> None:
        nonlocal seen
        if lab.version != seen:
            seen = lab.version
            shown = show()
            if isawaitable(shown):
                await shown

    ui.timer(LOOK_S, look)
