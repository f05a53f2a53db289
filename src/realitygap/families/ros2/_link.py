"""The link between a driver and its robot: a port that carries lines, and the gateway as such a port."""

from __future__ import annotations

import contextlib
import json
import os
import select
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

from realitygap._limits import parse_json
from realitygap.errors import RobotError
from realitygap.robots import Port, reason_of, serial_port

from ._address import Address
from ._lines import IDLE

ANSWER_S = 2.0
"""Longest wait for an answer [s]."""
PIECE_S = 0.1
"""Longest uninterrupted wait [s]."""
START_S = 10.0
"""Longest wait for the gateway's first answer [s]: it imports DDS."""
MOST_ANSWER = 16 << 20
"""Largest length of an answer [bytes]."""
NEEDS_EXTRA = "A robot on ROS 2 needs cyclonedds, and no ROS. Install it: pip install 'realitygap[ros2]'."


class GatewayPort:
    """A gateway process as a port.

    Args:
        address: Address of the robot.
        settings: Its topics, as `_gateway.Gateway` has them.

    Raises:
        RobotError: The process cannot be started.
    """

    def __init__(self, address: Address, settings: dict[str, Any]) -> None:
        if find_spec("cyclonedds") is None:
            raise RobotError(NEEDS_EXTRA)
        self.timeout: float | None = PIECE_S
        self._settings = settings | {"domain": address.domain, "interface": address.interface}
        self._ours, theirs = socket.socketpair()
        with theirs:
            self._process = self._start(theirs.fileno(), {"program": os.getpid()})
        self._ours.settimeout(ANSWER_S)
        self._spare: subprocess.Popen[bytes] | None = None

    def stand_by(self) -> None:
        """Start another gateway, which publishes zeros if the gateway, or it and this program, die or are frozen.

        Raises:
            RobotError: It cannot be started.
        """
        more = {"halts": True, "topics": {}, "program": os.getpid()}
        self._spare = self._start(subprocess.PIPE, more)

    def _start(self, stream: int, more: dict[str, Any]) -> subprocess.Popen[bytes]:
        try:
            return subprocess.Popen(
                [
                    *(sys.executable, "-P", "-m", "realitygap.families.ros2._gateway"),
                    json.dumps(self._settings | more),
                ],
                stdin=stream,
                stdout=subprocess.DEVNULL if stream == subprocess.PIPE else stream,
                stderr=subprocess.DEVNULL,
                start_new_session=True,  # so that Ctrl-C and a closed terminal do not reach it
            )
        except (OSError, TypeError) as error:
            raise RobotError(
                f"The gateway to ROS 2 cannot be started: {error}. Nothing was driven."
            ) from error

    @property
    def process_id(self) -> int:
        """Number of the gateway's process."""
        return self._process.pid

    @property
    def processes(self) -> list[subprocess.Popen[bytes]]:
        """The gateway, and the spare one if it was started."""
        return [self._process, *([self._spare] if self._spare else [])]

    @property
    def in_waiting(self) -> int:
        """1 if bytes wait, otherwise 0."""
        return int(bool(select.select([self._ours], [], [], 0.0)[0]))

    def open(self) -> None:
        """Do nothing: the process runs."""

    def read(self, size: int = 1) -> bytes:
        """Return the bytes that are there within `timeout`, at most 64 KiB.

        Raises:
            OSError: The gateway has ended.
        """
        if not select.select([self._ours], [], [], self.timeout)[0]:
            return b""
        data = self._ours.recv(max(size, 1 << 16))
        if not data:
            raise OSError("the gateway has ended")
        return data

    def write(self, data: bytes) -> int:
        """Send bytes to the gateway."""
        self._ours.sendall(data)
        return len(data)

    def close(self) -> None:
        """Let the gateway publish zeros and end. This is safe if called twice."""
        self._ours.close()
        try:
            self._process.wait(ANSWER_S)
        except subprocess.TimeoutExpired:
            self.replace()
            return
        if self._spare is not None:
            _tell(self._spare, IDLE)
            try:
                self._spare.wait(ANSWER_S)
            except subprocess.TimeoutExpired:  # it is frozen, and there is nothing to do
                self._spare.kill()
                self._spare.wait()
            self._spare = None

    def replace(self) -> None:
        """End a gateway that is frozen or lost, and let another one stop the robot."""
        if self._spare is None:
            self.stand_by()
        if self._spare is not None:
            _tell(self._spare, b"")
        self._process.kill()
        self._process.wait()
        self._ours.close()
        self._process, self._spare = self._spare or self._process, None
        with contextlib.suppress(subprocess.TimeoutExpired):  # it stops the robot, and ends by itself
            self._process.wait(ANSWER_S)


class Link:
    """Questions and answers over a port.

    Args:
        port: An open port.
        name: Name of the port, for messages.
        tell: Called with the name of each request, the bytes that were sent, and those that came.
    """

    def __init__(self, port: Port, name: str) -> None:
        self.port, self.name = port, name
        self.is_open = True
        self.tell: Callable[[str, bytes, bytes], object] = lambda *_: None
        self._held = b""
        self._number = 0

    def ask(self, what: str, wait_s: float = ANSWER_S, **values: float) -> dict[str, Any]:
        """Return the answer to a request.

        Raises:
            RobotError: No answer came, or it is an error.
        """
        if not self.is_open:
            raise RobotError(f"The link to {self.name} is closed: connect again.")
        self._number += 1
        request = json.dumps({"do": what, "id": self._number, **values}).encode() + b"\n"
        try:
            self.port.write(request)
            answer = self._answer(wait_s)
        except OSError as error:
            self._lose()
            raise RobotError(
                f"The link to {self.name} is lost: {reason_of(error)}. Connect again."
            ) from error
        self.tell(what, request, answer)
        reply: dict[str, Any] = parse_json(answer)
        if "error" in reply:
            raise RobotError(f"{self.name}: {str(reply['error']).rstrip('.')}.")
        return reply

    def _answer(self, wait_s: float) -> bytes:
        """Return the line with the number of the last request."""
        wanted = b'"id": %d}' % self._number
        until = time.monotonic() + wait_s
        while time.monotonic() < until:
            line, newline, rest = self._held.partition(b"\n")
            if newline:
                self._held = rest
                if line.endswith(wanted):
                    return line
                continue
            if len(self._held) > MOST_ANSWER:
                raise OSError("it sends too much")
            self._held += self.port.read(max(1, self.port.in_waiting))
        raise OSError(f"no answer within {wait_s:g} s")

    def _lose(self) -> None:
        self.is_open = False
        if isinstance(self.port, GatewayPort):
            self.port.replace()
        else:
            self.port.close()

    def close(self) -> None:
        """Close the port. This is safe if called twice."""
        if self.is_open:
            self.is_open = False
            self.port.close()


def _tell(spare: subprocess.Popen[bytes], word: bytes) -> None:
    """Tell a spare gateway that there is nothing to do, or by the end of its input that its time has come."""
    with contextlib.suppress(OSError):  # it was killed
        if spare.stdin is not None:
            spare.stdin.write(word)
            spare.stdin.close()


def open_link(address: Address, settings: dict[str, Any]) -> Link:
    """Open the link to a robot.

    Args:
        address: Its address.
        settings: Its topics, as the gateway has them.

    Raises:
        RobotError: It cannot be opened; the message says what to do.
    """
    if not address.port:
        port = GatewayPort(address, settings)
        return Link(port, f"ros2:{address.namespace}")
    serial: Any = serial_port(address.port, 9600, PIECE_S)
    return open_port(serial, address.port)


def open_port(port: Any, name: str) -> Link:
    """Open a port of pyserial, and return the link.

    Raises:
        RobotError: It cannot be opened.
    """
    try:
        port.open()
    except (OSError, ValueError) as error:
        raise RobotError(f"{name} cannot be opened: {reason_of(error)}. Is the emulator running?") from error
    return Link(port, name)
