"""The step from the argument of `initialize` to an open robot."""

from __future__ import annotations

import os
import sys

from realitygap._foreign_text import printable
from realitygap.errors import RobotError
from realitygap.families.scribbler import Scribbler as Driver
from realitygap.families.scribbler import find_ports

from ._mistakes import MyroError
from ._simulation import Option, Simulation, is_simulation, parse_simulation

_forced: str | None = None


def force_port(port: str | None) -> None:
    """Give every program this port, whatever it names; None restores the port that it names."""
    global _forced
    _forced = port


def open_port(port: str | int | None, **options: Option) -> tuple[Driver, Simulation | None]:
    """Open a robot.

    Args:
        port: A name, a number of a COM port, "sim", or None to ask in the terminal.
        options: Options of "sim".

    Returns:
        The driver, and the simulation, if there is one.

    Raises:
        MyroError: It cannot be opened.
    """
    name = _forced if _forced is not None else _name(port)
    if is_simulation(name):
        simulation = Simulation(**(parse_simulation(name) | options))
        return simulation.driver, simulation
    if options:
        raise MyroError(
            f'{", ".join(options)}: only a simulated robot has that, as initialize("sim", seed=3).'
        )
    try:
        return Driver(name), None
    except (RobotError, ValueError, OSError) as error:
        raise MyroError(f"{error}\n{_advice()}") from error


def _name(port: str | int | None) -> str:
    if isinstance(port, int) and not isinstance(port, bool):
        return f"COM{port}"
    if port is None or port == "":
        return _asked()
    if not isinstance(port, str):
        raise MyroError(
            f'initialize: the port is {port!r}, expected text as "/dev/rfcomm0", "COM3" or "sim".'
        )
    windows = port.lower().startswith("com") and port[3:].isdigit()
    return port.upper() if windows else port


def _asked() -> str:
    ports = find_ports()
    for found in ports:
        print(printable(f"  {found.port:20} {found.seems}"))
    try:
        given = input('Port of the robot ("sim" for a simulated one) [sim]: ').strip().strip("\"'")
    except EOFError:
        raise MyroError(
            'initialize() asks for the port of the robot, and nobody can answer here. Write it down: initialize("sim").'
        ) from None
    return given or "sim"


def _advice() -> str:
    ports = ", ".join(found.port for found in find_ports()) or "none"
    example = (
        "COM3" if sys.platform == "win32" else "/dev/cu.Fluke" if sys.platform == "darwin" else "/dev/rfcomm0"
    )
    text = f"Ports of this computer: {ports}. A robot's port is named like {example}; "
    if os.name == "posix" and sys.platform != "darwin":
        text += "on Linux it is there once the robot is paired and bound; "
    return text + 'initialize("sim") needs no robot.'
