"""Showing a page in the user's browser."""

from __future__ import annotations

import webbrowser
from pathlib import Path

from realitygap._terminal import echo


def show_page(path: Path) -> None:
    """Open a page in the user's browser; if there is no browser, print the page's address on standard error."""
    address = path.resolve().as_uri()
    try:
        opened = webbrowser.open(address)
    except (webbrowser.Error, OSError):
        opened = False
    if not opened:
        echo(f"realitygap: note: no browser could be opened here. The page is at {address}", err=True)
