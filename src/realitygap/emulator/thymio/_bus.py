"""Calls over D-Bus, as far as the playground needs them.

Source: D-Bus specification 0.43, "Type system", "Message protocol" and "Authentication protocol".
"""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
from pathlib import Path
from typing import Any

from realitygap.errors import RobotError

ANSWER_S = 5.0
_CALL, _RETURN, _ERROR = 1, 2, 3
_PATH, _INTERFACE, _MEMBER, _ERROR_NAME, _REPLY_TO, _DESTINATION, _SIGNATURE = 1, 2, 3, 4, 5, 6, 8
_GONE = "org.freedesktop.DBus.Error.ServiceUnknown"
_NUMBERS = {"y": "B", "b": "I", "n": "h", "q": "H", "i": "i", "u": "I", "x": "q", "t": "Q", "d": "d"}
_EIGHT = "xtd({"
"""First letters of the types that begin at a multiple of eight bytes."""
_HEADER = struct.Struct("<cBBBII")


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
        self._serial = 0
        self._socket = socket.socket(socket.AF_UNIX)
        self._socket.settimeout(ANSWER_S)
        try:
            self._socket.connect(str(path))
            self._file = self._socket.makefile("rb")
            # no name is claimed: in another user namespace ours would be a different one
            self._socket.sendall(b"\0AUTH EXTERNAL\r\nDATA\r\n")
            accepted = [self._file.readline(), self._file.readline()]
            if not accepted[1].startswith(b"OK"):
                raise RobotError(f"The playground's bus refuses us: {accepted[1].decode(errors='replace')}")
            self._socket.sendall(b"BEGIN\r\n")
            self._ask(
                "/org/freedesktop/DBus", "org.freedesktop.DBus", "Hello", "", (), "org.freedesktop.DBus"
            )
        except OSError as error:
            self.close()
            raise RobotError(f"The playground's bus does not answer: {error}.") from error
        except RobotError:
            self.close()
            raise

    def call(self, path: str, interface: str, member: str, signature: str = "", *values: Any) -> list[Any]:
        """Call a method of an object, and return the values of the answer.

        Raises:
            RobotError: It does not answer, or answers with an error.
        """
        try:
            return self._ask(path, interface, member, signature, values, self._destination)
        except (OSError, ValueError, struct.error) as error:
            raise RobotError(f"The playground does not answer: {error}.") from error

    def close(self) -> None:
        """Close the connection; safe to call twice."""
        with contextlib.suppress(AttributeError, OSError):
            self._file.close()
        self._socket.close()

    def _ask(
        self,
        path: str,
        interface: str,
        member: str,
        signature: str,
        values: tuple[Any, ...],
        destination: str,
    ) -> list[Any]:
        with self._lock:
            self._serial += 1
            fields = {_PATH: ("o", path), _INTERFACE: ("s", interface), _MEMBER: ("s", member)}
            fields[_DESTINATION] = ("s", destination)
            if signature:
                fields[_SIGNATURE] = ("g", signature)
            self._socket.sendall(_message(self._serial, fields, _encoded(signature, values)))
            while True:
                kind, answer, body = self._next()
                if answer.get(_REPLY_TO) == self._serial:
                    break
        if kind == _ERROR:
            if answer.get(_ERROR_NAME) == _GONE:
                raise RobotError("The playground has ended.")
            raise RobotError(f"The playground cannot do {member}: {body[0] if body else 'no reason given'}.")
        return body

    def _next(self) -> tuple[int, dict[int, Any], list[Any]]:
        """Return the next message: its kind, the fields of its header, and its values."""
        head = self._exactly(16)
        order, kind, _, _, body_size, _ = _HEADER.unpack_from(head)
        if order != b"l":
            raise RobotError("The playground's bus sends big-endian messages, expected little-endian ones.")
        (fields_size,) = struct.unpack_from("<I", head, 12)
        rest = self._exactly(_padded(fields_size, 8) + body_size)
        fields = dict(_Reader(head[12:16] + rest, 0, base=12).read("a(yv)"))
        signature = str(fields.get(_SIGNATURE, ""))
        reader = _Reader(rest[_padded(fields_size, 8) :], 0)
        return kind, fields, [reader.read(each) for each in _split(signature)]

    def _exactly(self, size: int) -> bytes:
        data = self._file.read(size)
        if data is None or len(data) < size:
            raise RobotError("The playground has ended.")
        return data


def _padded(size: int, to: int) -> int:
    return -(-size // to) * to


def _message(serial: int, fields: dict[int, tuple[str, str]], body: bytes) -> bytes:
    data = bytearray()
    for code, (kind, text) in fields.items():
        data += bytes(_padded(len(data), 8) - len(data))
        data += bytes([code, 1, ord(kind), 0]) + _encoded(kind, (text,))
    head = _HEADER.pack(b"l", _CALL, 0, 1, len(body), serial) + struct.pack("<I", len(data))
    return head + bytes(data) + bytes(_padded(len(data), 8) - len(data)) + body


def _encoded(signature: str, values: tuple[Any, ...]) -> bytes:
    """Return bytes of numbers, texts and, for `v`, numbers of type `d`."""
    data = bytearray()
    for kind, value in zip(signature, values, strict=True):
        if kind == "v":
            data += b"\x01d\0"
            kind = "d"
        size = 1 if kind in "gy" else 8 if kind in _EIGHT else 4
        data += bytes(_padded(len(data), size) - len(data))
        if kind in "sog":
            text = str(value).encode()
            data += struct.pack("<B" if kind == "g" else "<I", len(text)) + text + b"\0"
        else:
            data += struct.pack(f"<{_NUMBERS[kind]}", value)
    return bytes(data)


def _split(signature: str) -> list[str]:
    """Return the complete types of a signature."""
    found: list[str] = []
    start = depth = 0
    for k, letter in enumerate(signature):
        depth += (letter in "({") - (letter in ")}")
        if depth == 0 and letter != "a":
            found.append(signature[start : k + 1])
            start = k + 1
    return found


class _Reader:
    """A reader of values from bytes; `base` is the position of the bytes in their message."""

    def __init__(self, data: bytes, at: int, base: int = 0) -> None:
        self._data, self._at, self._base = data, at, base

    def read(self, kind: str) -> Any:
        """Read a value of a complete type."""
        first = kind[0]
        if first in "({":
            self._align(8)
            return tuple(self.read(each) for each in _split(kind[1:-1]))
        if first == "a":
            size = self._number("u")
            self._align(8 if kind[1] in _EIGHT else 1 if kind[1] in "gyv" else 4)
            end, values = self._at + size, []
            while self._at < end:
                values.append(self.read(kind[1:]))
            return values
        if first == "v":
            return self.read(self.read("g"))
        if first in "sog":
            size = self._number("y" if first == "g" else "u")
            text = self._data[self._at : self._at + size].decode()
            self._at += size + 1
            return text
        return self._number(first)

    def _number(self, kind: str) -> Any:
        layout = struct.Struct(f"<{_NUMBERS[kind]}")
        self._align(layout.size)
        (value,) = layout.unpack_from(self._data, self._at)
        self._at += layout.size
        return value

    def _align(self, size: int) -> None:
        self._at = _padded(self._at + self._base, size) - self._base
