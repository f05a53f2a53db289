"""The link to a client: bytes that leave one after another, and the faults of a real link.

Bytes are lost or late, the link hangs up, and its supply sags.
"""

from __future__ import annotations

import random
from collections import deque
from dataclasses import dataclass, fields

from realitygap.emulator import SECOND, nanoseconds
from realitygap.errors import RobotError, did_you_mean

MOST_WAITING = 8 << 20  # bytes that wait for a client who does not read; more are lost
HANG_UP_S = (1.0, 3.0)  # how long the link stays away; chosen
SAG_HANG_UP_S = 3.0  # after the supply dropped out


@dataclass(frozen=True)
class Faults:
    """The rates and sizes of a link's faults.

    Attributes:
        drop: Share of the bytes that are lost, either way, 0 to 1.
        extra: Share of the bytes that are followed by a random one, either way, 0 to 1.
        flip: Share of the bytes with one flipped bit, either way, 0 to 1.
        delay: Maximum delay of a piece of data [s]. The delay is random.
        hangup: Mean time between hang-ups [s], 0 for none. The link is interrupted for one to three seconds, in which
            the robot continues with its last command.
        sag: Share of its voltage that the supply loses while the motors work as hard as they can, 0 to 1. Below 5.5 V
            Bluetooth drops out.
    """

    drop: float = 0.0
    extra: float = 0.0
    flip: float = 0.0
    delay: float = 0.0
    hangup: float = 0.0
    sag: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            most = 3600.0 if field.name in ("delay", "hangup") else 1.0
            if not 0 <= value <= most:
                raise RobotError(f"fault {field.name}={value:g}: expected 0 to {most:g}.")

    @classmethod
    def parse(cls, text: str) -> Faults:
        """Return faults as on the command line: drop=0.001,delay=0.05,hangup=60,sag=0.2.

        Raises:
            RobotError: A name is not known or a value is out of range.
        """
        values: dict[str, float] = {}
        known = [field.name for field in fields(cls)]
        for part in filter(None, (piece.strip() for piece in text.split(","))):
            name, _, value = part.partition("=")
            if name not in known:
                raise RobotError(f"Unknown fault {name!r}. {did_you_mean(name, known)}")
            try:
                values[name] = float(value)
            except ValueError:
                raise RobotError(f"fault {name}={value}: expected a number, as in drop=0.001.") from None
        return cls(**values)

    @property
    def any_on_the_wire(self) -> bool:
        """True if bytes may be lost, changed, added, or late."""
        return bool(self.drop or self.extra or self.flip or self.delay)


class FaultyLink:
    """A link with faults, which are equal for equal seeds and bytes.

    Args:
        faults: Rates and sizes of the faults.
        seed: Seed of their times.
    """

    def __init__(self, faults: Faults, seed: int) -> None:
        self._faults = faults
        self._random = random.Random(f"{seed} faults")
        self.away_until = 0  # [ns]
        self.n_hang_ups = 0
        self._next_hang_up = self._after(0)

    def _after(self, now: int) -> int | None:
        if not self._faults.hangup:
            return None
        return now + nanoseconds(self._random.expovariate(1 / self._faults.hangup))

    def is_up(self, now: int) -> bool:
        """Return whether the link works at a time [ns]."""
        while self._next_hang_up is not None and self._next_hang_up <= now:
            self.hang_up(self._next_hang_up, self._random.uniform(*HANG_UP_S))
            self._next_hang_up = self._after(self.away_until)
        return now >= self.away_until

    def hang_up(self, now: int, seconds: float) -> None:
        """Let the link be away for a while."""
        self.n_hang_ups += 1
        self.away_until = max(self.away_until, now + nanoseconds(seconds))

    def spoil(self, data: bytes) -> bytes:
        """Return the bytes that arrive when `data` is sent."""
        faults = self._faults
        if not (faults.drop or faults.extra or faults.flip):
            return data
        out = bytearray()
        for byte in data:
            chance = self._random.random()
            if chance < faults.drop:
                continue
            if self._random.random() < faults.flip:
                byte ^= 1 << self._random.randrange(8)
            out.append(byte)
            if self._random.random() < faults.extra:
                out.append(self._random.randrange(256))
        return bytes(out)

    def lateness(self) -> int:
        """Return the delay of a piece of data [ns]."""
        return int(self._random.random() * self._faults.delay * SECOND) if self._faults.delay else 0


@dataclass(slots=True)
class _Chunk:
    """Bytes that leave one after another."""

    due: int  # of the next one [ns]
    byte_ns: int
    data: bytes
    next: int = 0


class Line:
    """A queue of the bytes that were sent and that the client has not taken yet."""

    def __init__(self) -> None:
        self._chunks: deque[_Chunk] = deque()
        self._free = 0
        self._n_waiting = 0

    def send(self, data: bytes, ready: int, byte_ns: int) -> None:
        """Send bytes from a time on [ns], each of which takes `byte_ns`."""
        if not data or self._n_waiting + len(data) > MOST_WAITING:
            return
        first = (self._free if self._free > ready else ready) + byte_ns
        self._free = first + (len(data) - 1) * byte_ns
        self._chunks.append(_Chunk(first, byte_ns, data))
        self._n_waiting += len(data)

    def take(self, now: int) -> bytes:
        """Return the bytes that are out by now."""
        taken = []
        while self._chunks and self._chunks[0].due <= now:
            chunk = self._chunks[0]
            left = len(chunk.data) - chunk.next
            n = min(left, (now - chunk.due) // chunk.byte_ns + 1) if chunk.byte_ns else left
            taken.append(chunk.data[chunk.next : chunk.next + n])
            if n < left:
                chunk.next += n
                chunk.due += n * chunk.byte_ns
                break
            self._chunks.popleft()
        out = taken[0] if len(taken) == 1 else b"".join(taken)
        self._n_waiting -= len(out)
        return out

    def drop(self) -> None:
        """Lose what has not been taken."""
        self._chunks.clear()
        self._n_waiting = 0

    def due(self, n: int) -> int | None:
        """Return the time at which `n` of the queued bytes have been sent [ns]; None if there are fewer."""
        for chunk in self._chunks:
            left = len(chunk.data) - chunk.next
            if n <= left:
                return chunk.due + (n - 1) * chunk.byte_ns
            n -= left
        return None
