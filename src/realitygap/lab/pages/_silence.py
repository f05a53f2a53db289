"""A robot that does not answer in a trial: what the page states meanwhile."""

from __future__ import annotations

from nicegui import ui

from realitygap.lab._pace import duration


class Silence:
    """A line that is shown while a robot does not answer."""

    def __init__(self) -> None:
        # no live region: the bar of Stop announces it, once
        self._words = ui.label("").classes("lab-problem")
        self._words.set_visibility(False)

    def look(self, silent_s: float) -> None:
        """Show for how long the robot has been silent; hide the line if this is 0."""
        if silent_s:
            self._words.text = (
                f"No answer for {duration(silent_s)}. The link is being opened again. If the robot moves, "
                "switch it off."
            )
        self._words.set_visibility(bool(silent_s))
