"""Notices of a page, placed so that they cover no button at its foot."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import run, ui

from realitygap.errors import RealityGapError

WRONG = (RealityGapError, ValueError, TypeError, OSError)
"""What people can mend."""


def notify(message: str, **options: Any) -> None:
    """Show a notice for some seconds, below the way to the other pages.

    Args:
        message: What happened, then what to do.
        options: As `ui.notify` takes them.
    """
    ui.notify(message, position="top", **options)


def told(act: Callable[[], Any]) -> bool:
    """Do something that waits for nothing; what is wrong with it is shown. Whether it was done."""
    try:
        act()
    except WRONG as error:
        show_error(error)
        return False
    return True


async def attempt(act: Callable[[], Any], done: str = "", **options: Any) -> bool:
    """Do something in a thread, because it may wait for a disk, and show a notice of how it ended.

    Args:
        act: Does it.
        done: The notice when it is done; none where it is empty.
        options: Of that notice, as `ui.notify` takes them.

    Returns:
        Whether it was done.
    """
    with ui.context.client:  # the button that was pressed may be gone by then
        try:
            await run.io_bound(act)
        except WRONG as error:
            show_error(error)
            return False
        if done:
            notify(done, **options)
        return True


def show_error(error: Exception) -> None:
    """Show what is wrong."""
    close = {"label": "Close", "color": "white", "noCaps": True}
    notify(str(error), type="negative", multi_line=True, timeout=8000, actions=[close])
