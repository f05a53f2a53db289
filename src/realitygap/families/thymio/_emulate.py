"""`realitygap emulate thymio`."""

from __future__ import annotations

from typing import Annotated

import typer

from realitygap._terminal import echo
from realitygap.emulator import open_arena
from realitygap.emulator.command import ArenaOption, QuietOption, WitnessOption, ended_by_signals, report


def emulate(
    arena: ArenaOption = "paper",
    tcp: Annotated[
        int, typer.Option(metavar="PORT", min=0, max=65535, help="TCP port of this machine; 0 for any.")
    ] = 0,
    speed: Annotated[float, typer.Option(help="Seconds of the robot per real second, 0.1 to 8.")] = 1.0,
    witness: WitnessOption = None,
    window: Annotated[bool, typer.Option("--window", help="Show the playground in its window.")] = False,
    quiet: QuietOption = False,
) -> None:
    """Emulate a Thymio II in Aseba's playground.

    The first line is the name of the port, a TCP port of this machine. The playground has to be installed (Debian:
    aseba dbus iproute2 faketime).

    Example: realitygap emulate thymio --speed 8 --witness 7002

    In Python: realitygap.families.thymio.Playground(speed=8)
    """
    from .playground._playground import LACKS, Playground
    from .playground._port import PlaygroundServer

    with (
        Playground(open_arena(arena), speed=speed, port=tcp, window=window) as playground,
        PlaygroundServer(playground, witness) as server,
        ended_by_signals(server.stop),
    ):
        report(f"thymio:{playground.port}", server.witness_address)
        if not quiet:
            echo(LACKS, err=True)
        server.run()
