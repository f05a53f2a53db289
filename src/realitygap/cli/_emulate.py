"""`realitygap emulate`: robots for real client programs, by a command of each family that has an emulator."""

from __future__ import annotations

import typer

from realitygap.robot_families import load, own_families, robot_families

emulate = typer.Typer(
    name="emulate",
    help="Emulate a robot on a pseudo-terminal or TCP port.\n\n"
    "The first line of the output is the name of the port, for other commands and programs.\n\n"
    "In Python: realitygap.emulator.serve_pty(robot)",
    epilog="\n\n".join(
        f"Example: realitygap emulate {family.name}" for family in own_families() if family.emulate
    ),
    no_args_is_help=True,
    rich_markup_mode=None,
)
for _family in robot_families():
    if _family.emulate:
        emulate.command(_family.name)(load(_family.emulate))
