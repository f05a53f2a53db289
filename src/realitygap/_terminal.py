"""The door to the terminal. Whatever the project prints goes through this module, because others wrote parts of it.

Names, notes and messages come from files, robots and people. In a terminal, an escape sequence among them could
rewrite lines, change the clipboard, or answer in the place of the user; a bidirectional control shows letters in
another order.
"""

from __future__ import annotations

from typing import Any

from realitygap._foreign_text import printable


def echo(text: object = "", *, err: bool = False, nl: bool = True) -> None:
    """Print a text, to standard error if asked."""
    import typer

    typer.echo(printable(str(text)), err=err, nl=nl)


def prompt(text: str, **options: Any) -> str:
    """Ask for a line; the options are those of `typer.prompt`."""
    import typer

    return str(typer.prompt(printable(text), **options))


def draw(codes: str, *, err: bool = False) -> None:
    """Write our own picture, with escape sequences; no text of others may be in it."""
    import typer

    typer.echo(codes, nl=False, err=err)
