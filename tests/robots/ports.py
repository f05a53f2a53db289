"""Ports for tests, on a clock that tests move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


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
