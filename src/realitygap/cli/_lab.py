"""`realitygap lab`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

import realitygap
from realitygap._terminal import echo


def lab(
    folder: Annotated[Path, typer.Argument(metavar="[DIR]", help="Folder of the studies.")] = Path("results"),
    port: Annotated[
        int, typer.Option(min=0, max=65535, metavar="N", help="Port to answer at; 0 takes a free port.")
    ] = 8321,
    host: Annotated[
        str | None,
        typer.Option(
            metavar="H",
            help="Address to answer at. 0.0.0.0 also answers phones in the same network and prints a QR code. "
            "[default: 127.0.0.1; with --class 0.0.0.0]",
        ),
    ] = None,
    classroom: Annotated[
        bool,
        typer.Option(
            "--class",
            help="Add a class: students scan a code and drive emulated robots from their phones, without the token.",
        ),
    ] = False,
    robot: Annotated[
        str,
        typer.Option(
            metavar="PORT",
            help="Robot that the students of --class drive in turns. Without it, each drives an emulated robot.",
        ),
    ] = "",
    witness: Annotated[
        str,
        typer.Option(
            metavar="HOST:PORT", help="Witness of --robot, if it is an emulator in another program."
        ),
    ] = "",
    allow_code: Annotated[
        bool,
        typer.Option("--allow-code", help="Let every visitor start studies that run Python files in DIR."),
    ] = False,
    no_open: Annotated[bool, typer.Option("--no-open", help="Don't open the page in the browser.")] = False,
) -> None:
    """Serve the web interface for studies, robots, and trials.

    Every browser needs the token in the address that is printed. Each start makes a new one.

    The lab needs the extra 'lab', and no network beyond this machine. Each entry is saved immediately, in the study's
    folder and its ledger. You can reload the page or restart the lab without losing an entry. Ctrl-C stops the robot,
    then ends the lab.

    Example: realitygap lab

    Example: realitygap lab results --host 0.0.0.0

    Example: realitygap lab class --class

    Example: realitygap lab class --class --robot /dev/rfcomm0

    In Python: realitygap.lab.open_lab("results")
    """
    realitygap.lab.open_lab(
        folder,
        port=port,
        host=host,
        show=not no_open,
        tell=_say,
        allow_code=allow_code,
        classroom=classroom,
        robot=robot,
        witness=witness,
    )


def _say(line: str) -> None:
    echo(line)
    sys.stdout.flush()
