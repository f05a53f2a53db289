"""A part of a page that is shown anew when what it shows has changed, and only then."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from nicegui import ui

T = TypeVar("T")


class Part(Generic[T]):
    """A part of a page.

    What is under a finger stays: a tap on a button that is taken away in that moment is lost. So each part has its own
    state, and shows the state that it was compared by, not what has become of it since.

    Args:
        stand: What there is to show: something that can be compared.
        show: Shows it.
    """

    def __init__(self, stand: Callable[[], T], show: Callable[[T], None]) -> None:
        self._stand = stand
        self._show = show
        self._shown: T

    def show(self) -> None:
        """Show it, for the first time."""
        now = self._stand()
        self._refreshable = ui.refreshable(self._show)
        self._refreshable(now)
        self._shown = now

    def look(self) -> bool:
        """Show it anew where it has changed; whether it has."""
        now = self._stand()
        if now == self._shown:
            return False
        self._refreshable.refresh(now)
        self._shown = now  # only once it is shown: where that failed the next look tries again
        return True
