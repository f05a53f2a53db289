"""Progress of a study, in words and as a bar."""

from __future__ import annotations

from nicegui import ui

from realitygap.lab._standing import Standing


class Progress:
    """Progress that changes in place, because drawing a page again after each run would keep the server busy."""

    def __init__(self) -> None:
        self._words: ui.label | None = None
        self._bar: ui.linear_progress | None = None

    def show_words(self) -> ui.label:
        """Show the words."""
        self._words = ui.label()
        return self._words

    def show_bar(self) -> None:
        """Show the bar."""
        self._bar = ui.linear_progress(show_value=False)

    def put(self, standing: Standing) -> None:
        """Show the progress of this state."""
        if self._words is not None:
            self._words.text = standing.progress
        if self._bar is not None:
            self._bar.value = standing.share
            self._bar.props["aria-label"] = f"{100 * standing.share:.0f} % done"
