"""`realitygap emulate`: a robot for real client programs."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from realitygap._terminal import echo
from realitygap.errors import RobotError

if TYPE_CHECKING:
    from types import FrameType

    from realitygap.emulator import Emulator, PlaygroundServer, Server

ROBOTS = ("scribbler", "thymio")
"""Robots that can be emulated."""


def emulate(
    robot: Annotated[
        str,
        typer.Argument(
            metavar="ROBOT",
            help="Robot to emulate: scribbler, a Parallax Scribbler; or thymio, a Thymio II in Aseba's playground.",
        ),
    ],
    model: Annotated[
        str | None, typer.Option(help="Model: s1, or s2 for an S2 or S3. [default: s2]", show_default=False)
    ] = None,
    fluke: Annotated[
        str | None, typer.Option(help="Board with the camera: none, 1 or 2. [default: that of the model]")
    ] = None,
    arena: Annotated[
        str, typer.Option(metavar="NAME", help="Arena by name, or a TOML or SVG file.")
    ] = "paper",
    twin: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Twin that moves as the robot, from `realitygap twin sample`."),
    ] = None,
    link: Annotated[
        Path | None, typer.Option(metavar="PATH", help="Symbolic link to make to the pseudo-terminal.")
    ] = None,
    tcp: Annotated[
        int | None,
        typer.Option(
            metavar="PORT",
            min=0,
            max=65535,
            help="TCP port of this machine, instead of a pseudo-terminal; 0 for any.",
        ),
    ] = None,
    speed: Annotated[
        float,
        typer.Option(
            min=0,
            max=1000,
            help="Seconds of the robot per real second. 0: the witness sets the time, as fast as possible. "
            "A playground takes 0.1 to 8.",
        ),
    ] = 1.0,
    timing: Annotated[
        str | None,
        typer.Option(
            metavar="on|off",
            help="Time that bytes, tones and sensors take: on, or off for none. [default: on]",
        ),
    ] = None,
    faults: Annotated[
        str,
        typer.Option(metavar="LIST", help="Faults, such as drop=0.001,delay=0.05,hangup=60,sag=0.2."),
    ] = "",
    witness: Annotated[
        int | None,
        typer.Option(
            metavar="PORT", min=0, max=65535, help="Serve pose, path and cells on this TCP port; 0 for any."
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="Seed of sensor noise and faults. A playground has none. [default: 0]"),
    ] = None,
    window: Annotated[bool, typer.Option("--window", help="Show the playground in its window.")] = False,
    state: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File that keeps name, password, data and settings.")
    ] = None,
    command: Annotated[
        str | None,
        typer.Option(
            "--exec",
            metavar="COMMAND",
            help="Run this program with its port in {port} and REALITYGAP_PORT, and end with it. For Myro 2.9.9.",
        ),
    ] = None,
    quiet: Annotated[
        bool,
        typer.Option("--quiet", help="Print only the port, and the witness's address if there is one."),
    ] = False,
) -> None:
    """Emulate a robot on a pseudo-terminal or TCP port.

    The first line is the name of the port: a pseudo-terminal, for other commands and programs, or
    a TCP port. In a terminal, a live view of a Scribbler follows. It shows the arena, the robot, its path and lights,
    and the last command.

    A Thymio is the one of Aseba's playground, if that is installed (Debian: aseba dbus iproute2 faketime). It takes
    --arena, --speed, --tcp, --witness and --window.

    Example: realitygap emulate scribbler --model s2 --fluke 2

    Example: realitygap emulate scribbler --tcp 7001 --witness 7002 --faults drop=0.001,hangup=60

    Example: realitygap emulate scribbler --twin worn-1.toml

    Example: realitygap emulate scribbler --model s1 --fluke 1 --exec "python2 program.py {port}"

    Example: realitygap emulate thymio --speed 8 --witness 7002

    In Python: realitygap.emulator.serve_pty(realitygap.emulator.Emulator("s2", "2"))
    """
    if robot not in ROBOTS:
        raise RobotError(f"Unknown robot {robot!r}. Known: {', '.join(ROBOTS)}.")
    if robot == "thymio":
        given: dict[str, object] = {"--model": model, "--fluke": fluke, "--twin": twin, "--link": link}
        given |= {
            "--timing": timing,
            "--faults": faults or None,
            "--seed": seed,
            "--state": state,
            "--exec": command,
        }
        wrong = [option for option, value in given.items() if value is not None]
        if wrong:
            raise RobotError(
                f"{wrong[0]} is only for scribbler. Leave it out: a playground does not have this setting."
            )
        _emulate_thymio(arena, speed, tcp, witness, window=window, quiet=quiet)
        return
    if window:
        raise RobotError("--window is only for thymio. Leave it out: the terminal shows a Scribbler.")
    if speed == 0 and witness is None:
        raise RobotError(
            "With --speed 0 a witness lets time pass. Add --witness PORT, or give another speed."
        )
    if link is not None and tcp is not None:
        raise RobotError(
            "--link goes with a pseudo-terminal, and --tcp asks for a TCP port. Give one of them."
        )
    from realitygap.emulator import make_emulator

    options = {"arena": arena, "seed": str(seed or 0), "timing": timing or "on", "faults": faults}
    if fluke is not None:
        options["fluke"] = fluke
    if twin is not None:
        options["twin"] = str(twin)
    if state is not None:
        options["state"] = str(state)
    emulator = make_emulator(model or "s2", options)
    _serve(emulator, link, tcp, speed=speed, witness=witness, command=command, quiet=quiet)


def _emulate_thymio(
    arena: str, speed: float, tcp: int | None, witness: int | None, *, window: bool, quiet: bool
) -> None:
    """Serve a playground until it ends, or until a signal."""
    from realitygap.emulator import LACKS, Playground, PlaygroundServer, open_scene

    where = open_scene(arena).arena
    with (
        Playground(where, speed=speed, port=tcp or 0, window=window) as playground,
        PlaygroundServer(playground, witness) as server,
        _ended_by_signals(server),
    ):
        echo(f"thymio:{playground.port}")
        if server.witness_address:
            echo(f"witness {server.witness_address}")
        sys.stdout.flush()
        if not quiet:
            echo(LACKS, err=True)
        server.run()


def _serve(
    emulator: Emulator,
    link: Path | None,
    tcp: int | None,
    *,
    speed: float,
    witness: int | None,
    command: str | None,
    quiet: bool,
) -> None:
    from realitygap.emulator import LiveView, PtyChannel, Server, TcpChannel

    channel = PtyChannel(link) if tcp is None else TcpChannel(tcp)
    with ExitStack() as stack:
        view = None
        if sys.stdout.isatty() and not quiet and command is None:
            view = LiveView(f"{emulator.model}, Fluke {emulator.fluke_model}: {channel.name}")
        server = Server(emulator, channel, speed=speed, witness=witness, watch=view.show if view else None)
        if command is not None:
            stack.enter_context(_exit_on_sigterm())
        stack.enter_context(server)
        if command is None:
            stack.enter_context(_ended_by_signals(server))
        echo(server.name)
        if server.witness_address:
            echo(f"witness {server.witness_address}")
        sys.stdout.flush()
        if command is not None:
            raise typer.Exit(_run(server, command))
        if view:
            stack.enter_context(view)
        server.run()


def _run(server: Server, command: str) -> int:
    """Serve while a client program runs; its status."""
    from realitygap.emulator import run_client

    server.start()
    return run_client(command, server.name)


@contextmanager
def _exit_on_sigterm() -> Iterator[None]:
    """Let SIGTERM leave the program as an exception does, so that the link is removed."""

    def leave(number: int, frame: FrameType | None) -> None:
        raise SystemExit(128 + number)

    before = signal.signal(signal.SIGTERM, leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def _ended_by_signals(server: Server | PlaygroundServer) -> Iterator[None]:
    """Let Ctrl-C and SIGTERM end a server like a normal end."""

    def stop(number: int, frame: FrameType | None) -> None:
        server.stop()

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
