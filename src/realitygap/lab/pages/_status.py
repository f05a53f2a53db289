"""Lines of a page that say how far something is: steps, progress, and a robot that does not answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from nicegui import ui

from realitygap._wording import duration
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
            share = standing.state.share
            self._bar.value = share
            self._bar.props["aria-label"] = f"{100 * share:.0f} % done"


def show_steps(steps: Sequence[str], current: str, titles: Mapping[str, str] | None = None) -> None:
    """Show the steps.

    Args:
        steps: Names of the steps.
        current: The current one; empty if there is none.
        titles: Titles of steps that are not their names.
    """
    with ui.element("ol").classes("lab-steps").props('aria-label="Steps"'):
        for step in steps:
            with ui.element("li") as item:
                ui.label((titles or {}).get(step, step))
            if step == current:
                item.props('aria-current="step"')


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
