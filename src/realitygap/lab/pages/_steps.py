"""The steps of a task, with the current one marked."""

from __future__ import annotations

from collections.abc import Sequence

from nicegui import ui


def show_steps(steps: Sequence[str], current: str) -> None:
    """Show the steps.

    Args:
        steps: Names of the steps.
        current: The current one; empty if there is none.
    """
    with ui.element("ol").classes("lab-steps").props('aria-label="Steps"'):
        for step in steps:
            with ui.element("li") as item:
                ui.label(step)
            if step == current:
                item.props('aria-current="step"')
