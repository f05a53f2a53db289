"""The command line: parse, call one function, print."""

from __future__ import annotations

import contextlib
import io
import os
import sys
import warnings

import typer

from realitygap.errors import RealityGapError

from ._app import app


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    typer.echo(f"realitygap: note: {message}", err=True)


def main() -> None:
    """Run a command; our own errors print as one message and end with status 1, as a closed pipe does, Ctrl-C with 130.

    A terminal without some letter shows a question mark in its place.
    """
    warnings.showwarning = _show_warning
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # closed ones are None
            stream.reconfigure(errors="replace")
    try:
        _run_command()
    except RealityGapError as error:
        typer.echo(f"realitygap: {error}", err=True)
        sys.exit(1)
    except BrokenPipeError:
        _forget_output()
        sys.exit(1)
    except OSError as error:
        what = error.filename or "The output cannot be written"
        typer.echo(f"realitygap: {what}: {error.strerror or error}.", err=True)
        _forget_output()
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)


def _run_command() -> None:
    """Run a command, to the last of what it prints."""
    try:
        app()
    finally:
        if sys.stdout is not None:
            sys.stdout.flush()


def _forget_output() -> None:
    """Leave nothing to be written when Python ends, which would be tried in vain once more."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


__all__ = ["app", "main"]
