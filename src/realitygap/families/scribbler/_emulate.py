"""`realitygap emulate scribbler`."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from realitygap.emulator.command import (
    ArenaOption,
    ExecOption,
    LinkOption,
    QuietOption,
    SpeedOption,
    TcpOption,
    View,
    WitnessOption,
    serve,
)

if TYPE_CHECKING:
    from .emulator import Emulator


def emulate(
    model: Annotated[str, typer.Option(help="Model: s1, or s2 for an S2 or S3.")] = "s2",
    fluke: Annotated[
        str | None, typer.Option(help="Board with the camera: none, 1 or 2. [default: that of the model]")
    ] = None,
    arena: ArenaOption = "paper",
    twin: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Twin that moves as the robot, from `realitygap twin sample`."),
    ] = None,
    link: LinkOption = None,
    tcp: TcpOption = None,
    speed: SpeedOption = 1.0,
    timing: Annotated[
        str,
        typer.Option(metavar="on|off", help="Time that bytes, tones and sensors take: on, or off for none."),
    ] = "on",
    faults: Annotated[
        str,
        typer.Option(metavar="LIST", help="Faults, such as drop=0.001,delay=0.05,hangup=60,sag=0.2."),
    ] = "",
    witness: WitnessOption = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of sensor noise and faults.")] = 0,
    state: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File that keeps name, password, data and settings.")
    ] = None,
    command: ExecOption = None,
    quiet: QuietOption = False,
) -> None:
    """Emulate a Parallax Scribbler on a pseudo-terminal or TCP port.

    The first line is the name of the port: a pseudo-terminal, for other commands and programs, or a TCP port. In a
    terminal, a live view follows. It shows the arena, the robot, its path and lights, and the last command. Programs of
    Myro 2.9.9 run with --exec.

    Example: realitygap emulate scribbler --model s2 --fluke 2

    Example: realitygap emulate scribbler --tcp 7001 --witness 7002 --faults drop=0.001,hangup=60

    Example: realitygap emulate scribbler --twin worn-1.toml

    Example: realitygap emulate scribbler --model s1 --fluke 1 --exec "python2 program.py {port}"

    In Python: realitygap.emulator.serve_pty(realitygap.families.scribbler.emulator.Emulator("s2", "2"))
    """
    from .emulator._port import make_emulator

    options = {"arena": arena, "seed": str(seed), "timing": timing, "faults": faults}
    if fluke is not None:
        options["fluke"] = fluke
    if twin is not None:
        options["twin"] = str(twin)
    if state is not None:
        options["state"] = str(state)
    emulator = make_emulator(model, options)
    serve(
        emulator,
        link=link,
        tcp=tcp,
        speed=speed,
        witness=witness,
        command=command,
        view=None if quiet else partial(_live_view, emulator),
    )


def _live_view(emulator: Emulator, channel: str) -> View:
    from .emulator._view import LiveView  # Rich, which a terminal alone needs

    return LiveView(emulator, f"{emulator.model}, Fluke {emulator.fluke_model}: {channel}")
