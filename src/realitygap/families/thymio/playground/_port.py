"""A playground behind a serial port of pyserial, in a process of this program; and one that other programs use.

`serial.serial_for_url("emulator://playground?speed=8&arena=paper")` starts one and connects to its robot. Closing the
port ends it.
"""

from __future__ import annotations

import selectors
import socket
import weakref
from urllib.parse import parse_qsl, urlsplit

from serial.urlhandler.protocol_socket import Serial as SocketPort

from realitygap._closed_on_exit import ClosedOnExit
from realitygap.emulator import WitnessDoor
from realitygap.errors import DescriptionError, RobotError, did_you_mean
from realitygap.world import Arena, load_arena

from ._playground import Playground

HOST = "playground"
POLL_S = 0.02
"""Longest wait for bytes in one piece [s]."""
KEYS = ("speed", "arena", "window")
LOOK_S = 0.2
"""Time between two looks at whether the playground still runs [s]."""


class PlaygroundPort(SocketPort):  # type: ignore[misc]  # pyserial has no types
    """A port with the Thymio of a playground at its other end.

    Attributes:
        witness: The playground; None before the port is opened.
        arena: Arena of its robot if the port's name gives none. Default: the paper's.
    """

    witness: Playground | None = None
    arena: Arena | None = None
    _socket: socket.socket | None = None  # pyserial sets it when it connects, and closes ports that never did

    def open(self) -> None:
        """Start the playground and connect to its robot.

        Raises:
            RobotError: It cannot be started.
        """
        url: str = self.name
        arena, speed, window = options_of(url)
        self.witness = Playground(arena or self.arena, speed=speed, window=window)
        self._ends = weakref.finalize(self, self.witness.close)
        self.portstr = self.witness.port
        try:
            super().open()
        finally:
            self.portstr = url

    def fileno(self) -> int:
        """Raise an error, because no descriptor is needed: the robot ends with this program."""
        raise OSError("The playground ends with this program.")

    def close(self) -> None:
        """End the playground; safe to call twice."""
        if self.witness is not None:
            self._ends()
        self.is_open = False
        if self._socket is not None:
            self._socket.close()


def open_playground(url: str, arena: Arena | None = None) -> PlaygroundPort:
    """Start a playground and connect to its robot.

    Args:
        url: Name of the port, with or without `thymio:` before it.
        arena: Arena of its robot if the name gives none. Default: the paper's.

    Raises:
        RobotError: It cannot be started.
    """
    url = url.removeprefix("thymio:")
    options_of(url)
    port = PlaygroundPort(None, timeout=POLL_S)
    port.port, port.arena = url, arena
    port.open()
    return port


def options_of(url: str) -> tuple[Arena | None, float, bool]:
    """Return the arena if it is named, the speed and whether to show a window, of emulator://playground?speed=8&arena=avoid.

    Raises:
        RobotError: An option is unknown, or has a value that is none.
    """
    parts = urlsplit(url)
    options = dict(parse_qsl(parts.query, keep_blank_values=True))
    if parts.netloc != HOST:
        raise RobotError(
            f"{url}: an emulated Thymio is emulator://{HOST}, got {parts.netloc or 'nothing'!r}."
        )
    for key in options:
        if key not in KEYS:
            raise RobotError(f"{url}: unknown option {key!r}. {did_you_mean(key, KEYS)}")
    try:
        speed = float(options.get("speed", "1"))
    except ValueError:
        raise RobotError(f"{url}: speed={options['speed']}, expected a number such as 8.") from None
    if (window := options.get("window", "off")) not in ("on", "off"):
        raise RobotError(f"{url}: window={window}, expected on or off.")
    try:
        return load_arena(options["arena"]) if "arena" in options else None, speed, window == "on"
    except DescriptionError as error:
        raise RobotError(str(error)) from None


class PlaygroundServer(ClosedOnExit):
    """Serves the witness of a playground; its robot has a separate port.

    Args:
        playground: The playground.
        witness: Port of the witness, 0 for any that is free; None for no witness.

    Attributes:
        witness_address: Address of the witness, HOST:PORT; None without one.

    Raises:
        RobotError: The port cannot be used.
    """

    def __init__(self, playground: Playground, witness: int | None = None) -> None:
        self._playground = playground
        self._door = None if witness is None else WitnessDoor(playground, witness)
        self.witness_address = self._door.address if self._door else None
        self._selector = selectors.DefaultSelector()
        if self._door:
            self._door.watch(self._selector)
        self._is_stopped = False

    def run(self) -> None:
        """Serve until `stop`.

        Raises:
            RobotError: The playground has ended, as when its window is closed.
        """
        while not self._is_stopped:
            for key, _ in self._selector.select(LOOK_S):
                if self._door:
                    self._door.serve(key.fileobj)
            self._playground.pose()

    def stop(self) -> None:
        """Let `run` return; may be called from a signal handler."""
        self._is_stopped = True

    def close(self) -> None:
        """Let go of all who ask the witness."""
        if self._door:
            self._door.close()
        self._selector.close()
