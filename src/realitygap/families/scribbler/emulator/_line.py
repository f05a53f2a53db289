"""A serial line out: bytes leave one after another, each in its time."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

MOST_WAITING = 8 << 20  # bytes that wait for a client who does not read; more are lost


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
