"""Notifications of a page, below its header."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from weakref import WeakKeyDictionary

from nicegui import Client, run, ui

from realitygap.errors import RealityGapError
from realitygap.lab._mistakes import FormError

WRONG = (RealityGapError, ValueError, TypeError, OSError)
"""Errors that a visitor can correct."""
_errors: WeakKeyDictionary[Client, ui.notification] = WeakKeyDictionary()
"""The error that each page shows."""
_forms: WeakKeyDictionary[Client, Callable[[FormError], bool]] = WeakKeyDictionary()
"""The function of each page that shows mistakes at its fields; it returns False if the page lacks a field."""


def notify(message: str, **options: Any) -> None:
    """Show a notification for 5 s.

    Args:
        message: What happened, then what to do.
        options: Arguments of `ui.notify`.
    """
    ui.notify(message, position="top", **options)


def show_error(error: Exception) -> None:
    """Show an error until the visitor closes it, or acts again."""
    forget_error()
    show = _forms.get(ui.context.client)
    if isinstance(error, FormError) and show is not None and show(error):
        return
    close = {"label": "Close", "color": "white", "noCaps": True}
    options: Any = {"type": "negative", "multi_line": True, "timeout": 0, "actions": [close]}
    _errors[ui.context.client] = ui.notification(str(error), position="top", **options)


def show_at_fields(show: Callable[[FormError], bool]) -> None:
    """Have mistakes in fields of this page be shown there."""
    _forms[ui.context.client] = show


def forget_error() -> None:
    """Hide the last error of the page, because the visitor has acted again."""
    if (shown := _errors.pop(ui.context.client, None)) is not None and not shown.is_deleted:
        shown.dismiss()


def try_now(act: Callable[[], Any]) -> bool:
    """Call a function that waits for nothing, and show its error; return whether it succeeded."""
    forget_error()
    try:
        act()
    except WRONG as error:
        show_error(error)
        return False
    return True


async def attempt(act: Callable[[], Any], done: str = "", **options: Any) -> bool:
    """Call a function in a thread, because it may wait for a disk, and show its error.

    Args:
        act: The function.
        done: Notification after success; none if empty.
        options: Arguments of `ui.notify` for that notification.

    Returns:
        Whether it succeeded.
    """
    with ui.context.client:  # the button that was pressed may be gone by then
        forget_error()
        try:
            await run.io_bound(act)
        except WRONG as error:
            show_error(error)
            return False
        if done:
            notify(done, **options)
        return True
