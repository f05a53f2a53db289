"""Messages of the Aseba protocol: little-endian words in frames of a payload length, a source, and a type.

Source: aseba-community/aseba, `aseba/common/consts.h` and `aseba/transport/buffer/vm-buffer.c`, protocol 5.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

from realitygap.errors import ProtocolError

VERSION = 5
"""Version of the protocol that this module speaks."""
HOST = 0
"""Source of the messages of a host."""
MOST_PAYLOAD = 516
"""Largest payload of a message [bytes]."""
MOST_VARIABLES = 258
"""Largest number of words in a payload."""
_HEADER = struct.Struct("<HHH")


class Kind(IntEnum):
    """Type of a message; smaller numbers than 0x8000 are user events."""

    DESCRIPTION = 0x9000
    NAMED_VARIABLE = 0x9001
    LOCAL_EVENT = 0x9002
    NATIVE_FUNCTION = 0x9003
    VARIABLES = 0x9005
    NODE_PRESENT = 0x900C
    SET_BYTECODE = 0xA001
    RESET = 0xA002
    RUN = 0xA003
    STOP = 0xA006
    GET_VARIABLES = 0xA00B
    SET_VARIABLES = 0xA00C
    GET_NODE_DESCRIPTION = 0xA010
    LIST_NODES = 0xA011


FIRST_SYSTEM_TYPE = 0x8000
"""Types below are user events."""


class Message(NamedTuple):
    """A message.

    Attributes:
        source: Number of the node that sent it; 0 for a host.
        kind: Type: one of `Kind` or a user event.
        payload: Bytes of the message, at most 516.
    """

    source: int
    kind: int
    payload: bytes = b""

    def encoded(self) -> bytes:
        """Return the bytes on the wire.

        Raises:
            ValueError: The payload is too long.
        """
        if len(self.payload) > MOST_PAYLOAD:
            raise ValueError(f"The payload has {len(self.payload)} bytes, expected {MOST_PAYLOAD} or fewer.")
        return _HEADER.pack(len(self.payload), self.source, self.kind) + self.payload


class Decoder:
    """Cuts a stream of bytes into messages.

    A length that no message has, or a type that no node sends, means that a byte was lost or added. The decoder
    then raises an error once and drops all bytes that it holds.
    """

    def __init__(self) -> None:
        self._held = bytearray()

    def feed(self, data: bytes) -> None:
        """Add bytes that arrived."""
        self._held += data

    def clear(self) -> None:
        """Drop the bytes of an unfinished message."""
        self._held.clear()

    @property
    def missing(self) -> int:
        """Number of bytes to the end of the present header or message, at least 1."""
        held = len(self._held)
        if held < _HEADER.size:
            return _HEADER.size - held
        length: int = _HEADER.unpack_from(self._held)[0]
        return max(_HEADER.size + min(length, MOST_PAYLOAD) - held, 1)

    @property
    def is_empty(self) -> bool:
        """True if no byte waits for the rest of its message."""
        return not self._held

    def next(self) -> Message | None:
        """Return the next whole message, or None if more bytes are needed.

        Raises:
            ProtocolError: The bytes are no message.
        """
        if len(self._held) < _HEADER.size:
            return None
        length, source, kind = _HEADER.unpack_from(self._held)
        is_known = kind < FIRST_SYSTEM_TYPE or 0x9000 <= kind <= 0x90FF or 0xA000 <= kind <= 0xA0FF
        if length > MOST_PAYLOAD or not is_known:
            shown = bytes(self._held[:16]).hex(" ")
            self._held.clear()
            raise ProtocolError(f"The robot sent bytes that are no Aseba message: {shown}.")
        end = _HEADER.size + length
        if len(self._held) < end:
            return None
        payload = bytes(self._held[_HEADER.size : end])
        del self._held[:end]
        return Message(source, kind, payload)


def words(values: Sequence[int]) -> bytes:
    """Return 16-bit words, each -32768 to 65535, as bytes.

    Raises:
        ValueError: A value does not fit.
    """
    for value in values:
        if not -0x8000 <= value <= 0xFFFF:
            raise ValueError(f"A word is {value}, expected -32768 to 65535.")
    return struct.pack(f"<{len(values)}H", *(value & 0xFFFF for value in values))


def signed_words(payload: bytes) -> tuple[int, ...]:
    """Return the signed 16-bit words of a payload.

    Raises:
        ProtocolError: It has an odd number of bytes.
    """
    if len(payload) % 2:
        raise ProtocolError(f"The robot sent {len(payload)} bytes, expected whole words of two bytes.")
    return struct.unpack(f"<{len(payload) // 2}h", payload)


def list_nodes() -> bytes:
    """Ask all nodes to name themselves."""
    return Message(HOST, Kind.LIST_NODES, words([VERSION])).encoded()


def get_description(node: int) -> bytes:
    """Ask a node for its variables, events, and functions."""
    return Message(HOST, Kind.GET_NODE_DESCRIPTION, words([node, VERSION])).encoded()


def get_variables(node: int, offset: int, count: int) -> bytes:
    """Ask a node for `count` words of its variables."""
    return Message(HOST, Kind.GET_VARIABLES, words([node, offset, count])).encoded()


def set_variables(node: int, offset: int, values: Sequence[int]) -> bytes:
    """Set words of a node's variables; the node does not answer."""
    return Message(HOST, Kind.SET_VARIABLES, words([node, offset, *values])).encoded()


def set_bytecode(node: int, address: int, program: Sequence[int]) -> bytes:
    """Load words of a program into a node's memory, which forgets them when it is switched off."""
    return Message(HOST, Kind.SET_BYTECODE, words([node, address, *program])).encoded()


def control(kind: Kind, node: int) -> bytes:
    """RESET, RUN or STOP the program of a node."""
    return Message(HOST, kind, words([node])).encoded()


def user_event(event: int, values: Sequence[int]) -> bytes:
    """Send an event, whose values a program finds in `event.args`."""
    return Message(HOST, event, words(values)).encoded()


class Variables(NamedTuple):
    """Words of a node's variables, from an offset on."""

    offset: int
    values: tuple[int, ...]


def variables(payload: bytes) -> Variables:
    """Return the content of VARIABLES.

    Raises:
        ProtocolError: The payload is too short or has an odd number of bytes.
    """
    if len(payload) < 2:
        raise ProtocolError("The robot sent variables without an offset.")
    found = signed_words(payload)
    return Variables(found[0] & 0xFFFF, found[1:])


class Head(NamedTuple):
    """The first message of a description: the node's name, sizes in words, and the number of messages to follow."""

    name: str
    version: int
    bytecode: int
    stack: int
    variables: int
    n_variables: int
    n_events: int
    n_functions: int


def head(payload: bytes) -> Head:
    """Return the content of DESCRIPTION.

    Raises:
        ProtocolError: It is not whole.
    """
    name, rest = _text(payload)
    if len(rest) != 14:
        raise ProtocolError(f"The robot's description has {len(rest)} bytes after its name, expected 14.")
    return Head(name, *struct.unpack("<7H", rest))


def named_variable(payload: bytes) -> tuple[int, str]:
    """Return the number of words and the name of NAMED_VARIABLE.

    Raises:
        ProtocolError: It is not whole.
    """
    if len(payload) < 3:
        raise ProtocolError("The robot described a variable without a name.")
    name, _ = _text(payload[2:])
    return int.from_bytes(payload[:2], "little"), name


def local_event(payload: bytes) -> str:
    """Return the name of LOCAL_EVENT.

    Raises:
        ProtocolError: It is not whole.
    """
    return _text(payload)[0]


def node_present(message: Message) -> int:
    """Return the protocol version of NODE_PRESENT.

    Raises:
        ProtocolError: It is not whole.
    """
    found = signed_words(message.payload)
    if not found:
        raise ProtocolError("The robot named itself without a version.")
    return found[0]


def _text(payload: bytes) -> tuple[str, bytes]:
    if not payload or len(payload) < 1 + payload[0]:
        raise ProtocolError("The robot sent a name that is cut off.")
    end = 1 + payload[0]
    return payload[1:end].decode("utf-8", errors="replace"), payload[end:]
