"""The command line: parse, call one function, print."""

from __future__ import annotations

import sys
import warnings

import typer

from realitygap.errors import RealityGapError

from ._app import app


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    typer.echo(f"realitygap: note: {message}", err=True)


def main() -> None:
    """Run a command; our own errors print as one message and end with status 1, Ctrl-C with 130."""
    warnings.showwarning = _show_warning
    try:
        app()
    except RealityGapError as error:
        typer.echo(f"realitygap: {error}", err=True)
        sys.exit(1)
    except (KeyboardInterrupt, BrokenPipeError):
        sys.exit(130)


__all__ = ["app", "main"]
