"""The families of robots on ports, and the functions of each that `realitygap robot` needs."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

from realitygap.errors import RobotError

from .scribbler._ports import PortGuess, find_ports

BARE = "scribbler"
"""The family of a port without a name before it."""
_FAMILIES = {"scribbler": ".scribbler._terminal", "thymio": ".thymio._terminal"}


class Terminal(Protocol):
    """A family's module for the terminal."""

    def find_ports(self) -> list[PortGuess]:
        """Return the ports behind which its robots may be."""
        ...

    def open_robot(self, port: str, record: Path | None, watchdog_s: float | None) -> Any:
        """Connect to a robot on a port, without the family's name before it.

        Its motors stop if the program is silent for `watchdog_s` [s], or sooner.
        """
        ...

    def info(self, robot: Any) -> Mapping[str, Any]:
        """Return facts about a robot, for people."""
        ...

    def sense(self, robot: Any) -> Mapping[str, Any]:
        """Return a reading of each sensor."""
        ...

    def battery(self, robot: Any) -> tuple[str, float]:
        """Return the name of the battery's reading, with its unit, and its value."""
        ...


def split_port(port: str) -> tuple[str, str]:
    """Return the family and the port itself of a port as users name it."""
    name, colon, rest = port.partition(":")
    return (name, rest) if colon and name in _FAMILIES else (BARE, port)


def is_in_this_program(port: str) -> bool:
    """Return whether a port belongs to an emulator in this program."""
    return split_port(port)[1].startswith("emulator:")


def terminal_of(family: str) -> Any:
    """Return the `Terminal` of a family."""
    return import_module(_FAMILIES[family], __package__)


def list_ports() -> list[PortGuess]:
    """Return the serial ports of this machine. Each family names the ports of devices that it recognizes."""
    own: dict[str, PortGuess] = {}
    for family in _FAMILIES:
        if family != BARE:
            found = terminal_of(family).find_ports()
            own |= {each.port: each._replace(port=f"{family}:{each.port}") for each in found}
    return [*own.values(), *(each for each in find_ports() if each.port not in own)]


def open_on(port: str, record: Path | None = None, watchdog_s: float | None = None) -> tuple[Any, Any]:
    """Connect to the robot on a port; return its family's `Terminal`, and the robot.

    Args:
        port: Name of the port; one without a family's name is that of a Scribbler.
        record: A new file for the recording of all messages.
        watchdog_s: Silence of the program after which the motors stop [s]. None: the default of the family.

    Raises:
        RobotError: The robot cannot be reached.
    """
    family, name = split_port(port)
    if not name:
        raise RobotError(f"{port!r} names no port, expected {family}:PORT.")
    terminal = terminal_of(family)
    return terminal, terminal.open_robot(name, record, watchdog_s)
