"""Calls over D-Bus to the playground."""

from __future__ import annotations

import socket
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jeepney import DBusAddress, DBusErrorResponse, new_method_call
from jeepney.io.blocking import DBusConnection
from jeepney.wrappers import unwrap_msg

from realitygap.errors import RobotError

ANSWER_S = 5.0
_GONE = "org.freedesktop.DBus.Error.ServiceUnknown"


class Bus:
    """A connection to a bus at the path of its socket. Several threads may call.

    Args:
        path: Path of the socket.
        destination: Name of the program on the bus that answers.

    Raises:
        RobotError: Nobody answers there.
    """

    def __init__(self, path: Path, destination: str) -> None:
        self._destination = destination
        self._lock = threading.Lock()
        connected = socket.socket(socket.AF_UNIX)
        try:
            connected.settimeout(ANSWER_S)
            connected.connect(str(path))
            _authenticate(connected)
            self._connection = DBusConnection(connected)
        except RobotError:
            connected.close()
            raise
        except (OSError, DBusErrorResponse) as error:
            connected.close()
            raise RobotError(f"The playground's bus does not answer: {error}.") from error

    def call(
        self, path: str, interface: str, member: str, signature: str = "", *values: object
    ) -> Sequence[Any]:
        """Call a method of an object, and return the values of the answer.

        Raises:
            RobotError: It does not answer, or answers with an error.
        """
        address = DBusAddress(path, self._destination, interface)
        message = new_method_call(address, member, signature or None, values)
        try:
            with self._lock:
                answer = self._connection.send_and_get_reply(message, timeout=ANSWER_S)
            body: Sequence[Any] = unwrap_msg(answer)
        except DBusErrorResponse as error:
            if error.name == _GONE:
                raise RobotError("The playground has ended.") from error
            reason = error.data[0] if error.data else "no reason given"
            raise RobotError(f"The playground cannot do {member}: {reason}.") from error
        except ConnectionError as error:
            raise RobotError("The playground has ended.") from error
        except (OSError, ValueError) as error:
            raise RobotError(f"The playground does not answer: {error}.") from error
        return body

    def close(self) -> None:
        """Close the connection; safe to call twice."""
        self._connection.close()


def _authenticate(connected: socket.socket) -> None:
    """Authenticate without a user, whom jeepney would name: in the user namespace of the bus it is another."""
    connected.sendall(b"\0AUTH EXTERNAL\r\nDATA\r\n")
    with connected.makefile("rb", buffering=0) as answers:
        answers.readline()
        accepted = answers.readline()
    if not accepted.startswith(b"OK"):
        raise RobotError(f"The playground's bus refuses us: {accepted.decode(errors='replace')}")
    connected.sendall(b"BEGIN\r\n")
