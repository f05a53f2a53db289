"""`realitygap again`."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from realitygap._terminal import echo
from realitygap.orders import read_order

from ._app import app_for


def again(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="Report of a gap (.html), calibration (.toml), folder of results, or result of --json (.json).",
        ),
    ],
    options: Annotated[
        list[str] | None,
        typer.Argument(metavar="OPTIONS", help="Options of the command that replace those of the result."),
    ] = None,
) -> None:
    """Repeat a measurement from its result.

    A result states the command that made it, with all settings. This command runs it again, in the current folder, from
    which the names of files are resolved. New trials are driven, unless -o names a file that has them.

    Example: realitygap again gap.html

    Example: realitygap again fit.toml -o fit-2.toml

    Example: realitygap again gap.html --trials 20 --report gap-2.html

    In Python: realitygap.orders.read_order("gap.html")
    """
    order = read_order(file)
    given = {option.partition("=")[0] for option in options or ()}
    words = [*order.words(leave_out=given), *(options or ())]
    echo(f"realitygap {shlex.join(words)}", err=True)
    app_for(words)(words, prog_name="realitygap")
