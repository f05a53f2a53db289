"""Ports: of pyserial, of any family of robots, and the functions of each family that `realitygap robot` needs."""

from __future__ import annotations

import contextlib
import os
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import serial

from realitygap.errors import RobotError
from realitygap.robot_families import default_family, find_family, load, robot_families

_EMULATOR = "realitygap.emulator"
"""The package that pyserial imports for names that begin with emulator://."""
_PSEUDO_TERMINAL = re.compile(
    r"/dev/(pts/\d+|pty\w+)$" if sys.platform != "darwin" else r"/dev/(ttys\d+|pty\w+)$"
)
_NUMBER = re.compile(r"\[Errno (\d+)\]|\((\d+), '")


class Port(Protocol):
    """The methods of a port that drivers use, with the names of `serial.Serial`."""

    timeout: float | None

    @property
    def in_waiting(self) -> int: ...
    def read(self, size: int = 1, /) -> bytes: ...
    def write(self, data: bytes, /) -> int | None: ...
    def open(self) -> None: ...
    def close(self) -> None: ...


class PortGuess(NamedTuple):
    """A port and its probable device.

    Attributes:
        port: Name of the port.
        seems: Probable device, in words.
        description: Description by the system.
    """

    port: str
    seems: str
    description: str


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
    return (name, rest) if colon and find_family(name) else (default_family().name, port)


def typed_port(port: str) -> str:
    """Return a port as short as users may write it: without the name of the default family."""
    name, rest = split_port(port)
    return rest if name == default_family().name else port


def is_in_this_program(port: str) -> bool:
    """Return whether a port belongs to an emulator in this program."""
    return split_port(port)[1].startswith("emulator:")


def list_ports() -> list[PortGuess]:
    """Return the serial ports of this machine. Each family names the ports of devices that it recognizes."""
    own: dict[str, PortGuess] = {}
    for family in robot_families():
        if not family.is_default:
            guesses = load(family.terminal).find_ports()
            own |= {guess.port: guess._replace(port=family.named(guess.port)) for guess in guesses}
    rest = load(default_family().terminal).find_ports()
    return [*own.values(), *(guess for guess in rest if guess.port not in own)]


def open_on(port: str, record: Path | None = None, watchdog_s: float | None = None) -> tuple[Any, Any]:
    """Connect to the robot on a port; return its family's `Terminal`, and the robot.

    Args:
        port: Name of the port; one without a family's name belongs to the default family.
        record: A new file for the recording of all messages.
        watchdog_s: Silence of the program after which the motors stop [s]. None: the default of the family.

    Raises:
        RobotError: The robot cannot be reached.
    """
    name, rest = split_port(port)
    if not rest:
        raise RobotError(f"{port!r} names no port, expected {name}:PORT.")
    family = find_family(name) or default_family()
    terminal = load(family.terminal)
    return terminal, terminal.open_robot(rest, record, watchdog_s)


def is_pseudo_terminal(name: str) -> bool:
    """Return whether a port is a pseudo-terminal, which no real robot has."""
    return _PSEUDO_TERMINAL.match(os.path.realpath(name)) is not None


def serial_port(name: str, baud: int, timeout_s: float, write_s: float | None = None) -> Any:
    """Return a port of pyserial that is not open yet, and will be open in one program only, if the system can do that.

    Args:
        name: Name of the port.
        baud: Rate [baud].
        timeout_s: Longest wait for bytes [s].
        write_s: Longest wait until bytes are written [s]. Default: no limit.

    Raises:
        ValueError: The name has an unknown scheme.
    """
    if _EMULATOR not in serial.protocol_handler_packages:
        serial.protocol_handler_packages.append(_EMULATOR)
    port = serial.serial_for_url(
        name, do_not_open=True, baudrate=baud, timeout=timeout_s, write_timeout=write_s
    )
    with contextlib.suppress(AttributeError, NotImplementedError, ValueError):
        port.exclusive = True
    return port


def reason_of(error: Exception) -> str:
    """Return the reason without the numbers, names, and calls that pyserial puts around it."""
    if number := _NUMBER.search(str(error)):
        return os.strerror(int(number[1] or number[2]))
    return str(error)
