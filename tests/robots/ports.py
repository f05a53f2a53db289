"""Ports for tests, on a clock that tests move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol


@dataclass
class HandClock:
    """Time that passes only when somebody lets it."""

    time: float = 0.0

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        assert seconds >= 0
        self.time += seconds


class BufferPort:
    """What pyserial offers, over a buffer; a read that would wait lets time pass."""

    name = "/dev/test"

    def __init__(self) -> None:
        self.clock = HandClock()
        self.timeout: float | None = 1.0
        self.incoming = bytearray()
        self.is_open = True

    @property
    def in_waiting(self) -> int:
        return len(self.incoming)

    def read(self, size: int = 1) -> bytes:
        if len(self.incoming) < size:
            self.clock.sleep(self.timeout or 0.0)
            self.wake()
        got = bytes(self.incoming[:size])
        del self.incoming[:size]
        return got

    def wake(self) -> None:
        """Called after time passed."""

    def write(self, data: bytes) -> int:
        raise NotImplementedError

    def open(self) -> None:
        self.is_open = True

    def close(self) -> None:
        self.is_open = False


@dataclass
class Wire:
    """What may happen to bytes on their way; each gets a byte's number and gives what arrives."""

    to_robot: Callable[[int, int], bytes] = lambda number, byte: bytes((byte,))
    to_host: Callable[[int, int], bytes] = lambda number, byte: bytes((byte,))
    n_to_robot: int = 0
    n_to_host: int = 0


class Peer(Protocol):
    """A robot that answers byte by byte."""

    def receive(self, byte: int, now: float) -> bytes: ...


class WiredPort(BufferPort):
    """A robot at the other end of a wire."""

    write_s = 0.0
    """Time that a write takes [s]."""

    def __init__(self, robot: Peer, wire: Wire | None = None) -> None:
        super().__init__()
        self.robot = robot
        self.wire = wire or Wire()
        self.writes: list[bytes] = []
        self.gone = False

    def check(self) -> None:
        if self.gone or not self.is_open:
            raise OSError(5, "Input/output error")

    def write(self, data: bytes) -> int:
        self.check()
        self.writes.append(data)
        self.clock.sleep(self.write_s)
        for byte in data:
            number, self.wire.n_to_robot = self.wire.n_to_robot, self.wire.n_to_robot + 1
            for arriving in self.wire.to_robot(number, byte):
                self.send(self.robot.receive(arriving, self.clock.now()))
        return len(data)

    def send(self, data: bytes) -> None:
        for byte in data:
            number, self.wire.n_to_host = self.wire.n_to_host, self.wire.n_to_host + 1
            self.incoming += self.wire.to_host(number, byte)

    def read(self, size: int = 1) -> bytes:
        self.check()
        return super().read(size)

    def open(self) -> None:
        if self.gone:
            raise OSError(2, "No such file or directory")
        super().open()
