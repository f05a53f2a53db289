"""Notices of a page, placed so that they cover no button at its foot."""

from __future__ import annotations

from typing import Any

from nicegui import ui


def notify(message: str, **options: Any) -> None:
    """Show a notice for some seconds, below the way to the other pages.

    Args:
        message: What happened, then what to do.
        options: As `ui.notify` takes them.
    """
    ui.notify(message, position="top", **options)
