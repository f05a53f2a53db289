"""Reading of an answer from a port, and errors for missing bytes."""

from __future__ import annotations

from realitygap.errors import ProtocolError, RobotError, RobotTimeout
from realitygap.robots import Port

from ._codec import Request
from .opcodes import COUNTED, JPEG_SCAN, LINE, PACKET

GAP_S = 0.5
"""Silence after which an answer that has begun has lost a byte [s]."""
LONGEST_LINE = 512
LONGEST_SCAN = 1 << 20


class Fault(Exception):  # noqa: N818  # none leaves the driver
    """A command that did not get its answer.

    Attributes:
        kind: Exception to raise if recovery fails.
        understood: Whether the robot has certainly read the whole command.
        got: The bytes that arrived.
    """

    def __init__(
        self, text: str, kind: type[RobotError], got: bytes = b"", *, understood: bool = False
    ) -> None:
        super().__init__(text)
        self.kind = kind
        self.got = got
        self.understood = understood


class HangUp(Fault):
    """The port has disappeared."""


def read_answer(port: Port, request: Request, fluke: str) -> bytes:
    """Read the bytes of an answer, with its echo.

    Args:
        port: The port that the command was written to.
        request: The command.
        fluke: Present Fluke: "none", "1" or "2".

    Raises:
        Fault: The bytes do not arrive.
    """
    kind = request.answer
    if kind >= 0:
        return _read_counted(port, request, PACKET if request.echoed else 0, fluke)
    if kind == LINE:
        return _read_until(port, b"\n", request.wait_s, LONGEST_LINE)
    if kind == JPEG_SCAN:
        return _read_until(port, b"\xff\xd9", request.wait_s, LONGEST_SCAN, more=12)
    length = _read_exactly(port, 2, request.wait_s)
    n = int.from_bytes(length, "big" if kind == COUNTED else "little")
    return length + (_read_exactly(port, n, GAP_S) if n else b"")


def _read_counted(port: Port, request: Request, n_echo: int, fluke: str) -> bytes:
    try:
        return _read_exactly(port, n_echo + request.answer, request.wait_s, n_echo)
    except Fault as fault:
        if request.may_stay_out and fluke == "2" and fault.got == request.data:
            return fault.got
        raise


def _read_exactly(port: Port, n: int, wait_s: float, n_echo: int = 0) -> bytes:
    """Read `n` bytes. Raise `Fault` after `wait_s` of silence before the answer, or after a gap within it."""
    got = port.read(n)
    if len(got) == n:
        return got
    buffer = bytearray(got)
    silent = 0.0 if got else GAP_S
    while len(buffer) < n:
        patience = wait_s if len(buffer) <= n_echo else GAP_S
        if silent >= patience:
            raise _short(bytes(buffer), n, patience, n_echo)
        got = port.read(n - len(buffer))
        buffer += got
        silent = 0.0 if got else silent + GAP_S
    return bytes(buffer)


def _read_until(port: Port, end: bytes, wait_s: float, longest: int, more: int = 0) -> bytes:
    """Read bytes up to an end mark, and `more` bytes after it."""
    buffer = bytearray()
    silent, searched = 0.0, 0
    while (at := buffer.find(end, searched)) < 0:
        searched = max(len(buffer) - len(end) + 1, 0)
        if len(buffer) > longest:
            raise Fault(f"{len(buffer)} bytes arrived without an end", ProtocolError, bytes(buffer[:64]))
        if silent >= (GAP_S if buffer else wait_s):
            raise _short(bytes(buffer), len(buffer) + 1 + more, silent, 0)
        got = port.read(max(port.in_waiting, 1 + more))
        buffer += got
        silent = 0.0 if got else silent + GAP_S
    n = at + len(end) + more
    if len(buffer) < n:
        buffer += _read_exactly(port, n - len(buffer), GAP_S)
    if len(buffer) > n:
        raise Fault("More bytes arrived than the answer has", ProtocolError, bytes(buffer), understood=True)
    return bytes(buffer)


def _short(got: bytes, n: int, patience: float, n_echo: int) -> Fault:
    if not got:
        return Fault(f"No answer within {patience:.1f} s", RobotTimeout)
    text = f"Only {len(got)} of {n} bytes arrived within {patience:.1f} s"
    return Fault(text, RobotTimeout, got, understood=len(got) >= max(n_echo, 1))
