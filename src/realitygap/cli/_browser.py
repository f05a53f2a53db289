"""Showing a page to whoever sits at the machine."""

from __future__ import annotations

import webbrowser
from pathlib import Path

import typer


def show_page(path: Path) -> None:
    """Open a page in the user's browser; where there is none, say on standard error where the page is."""
    address = path.resolve().as_uri()
    try:
        opened = webbrowser.open(address)
    except (webbrowser.Error, OSError):
        opened = False
    if not opened:
        typer.echo(f"realitygap: note: no browser could be opened here. The page is at {address}", err=True)
