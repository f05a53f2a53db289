"""A TCP proxy in front of an emulator that loses, delays, repeats, and changes bytes.

with serve_tcp(Emulator("s2", "1")) as server, ByteProxy(server.name, seed=1) as proxy:
    with Scribbler(proxy.name) as robot:
        proxy.faults = WireFaults(drop=0.01)     # from now on, a share of all bytes
        proxy.strike("corrupt", "to_robot")      # the next byte to the robot, once
        proxy.cut()                              # both connections end
"""

from __future__ import annotations

import contextlib
import random
import socket
import threading
import time
from collections import Counter
from dataclasses import dataclass
from typing import Literal

Kind = Literal["drop", "delay", "duplicate", "corrupt"]
Direction = Literal["to_robot", "to_host"]

KINDS: tuple[Kind, ...] = ("drop", "delay", "duplicate", "corrupt")
DIRECTIONS: tuple[Direction, ...] = ("to_robot", "to_host")


@dataclass(frozen=True)
class WireFaults:
    """How often bytes are disturbed, in both directions.

    Attributes:
        drop, delay, duplicate, corrupt: Share of the bytes that are lost, late, sent twice, or have one bit changed.
        delay_s: Longest delay of a late byte and of all that follow it [s].
    """

    drop: float = 0.0
    delay: float = 0.0
    duplicate: float = 0.0
    corrupt: float = 0.0
    delay_s: float = 0.3


class ByteProxy:
    """Pass bytes between one client at a time and a TCP port of this machine.

    Args:
        target: Port of the emulator, `socket://HOST:PORT`.
        seed: Seed of the faults. Each direction has its own random numbers.
        faults: Shares of disturbed bytes; can be assigned again at any moment.

    Attributes:
        name: Port that the client opens.
        n_struck: Number of disturbed bytes so far, by kind.
    """

    def __init__(self, target: str, seed: int = 0, faults: WireFaults | None = None) -> None:
        host, _, port = target.removeprefix("socket://").rpartition(":")
        self._target = (host, int(port))
        self.faults = faults or WireFaults()
        self.n_struck: Counter[str] = Counter()
        self._random = {direction: random.Random(f"{seed} {direction}") for direction in DIRECTIONS}
        self._due: dict[Direction, list[Kind]] = {direction: [] for direction in DIRECTIONS}
        self._lock = threading.Lock()
        self._pair: tuple[socket.socket, ...] = ()
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.name = f"socket://127.0.0.1:{self._listening.getsockname()[1]}"
        threading.Thread(target=self._accept, daemon=True).start()

    def strike(self, kind: Kind, direction: Direction) -> None:
        """Disturb the next byte in a direction, once."""
        with self._lock:
            self._due[direction].append(kind)

    def cut(self) -> None:
        """End both connections, as a link that is lost does; the client can connect again."""
        with self._lock:
            pair, self._pair = self._pair, ()
        for side in pair:
            with contextlib.suppress(OSError):
                side.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """End the connections and stop listening."""
        with contextlib.suppress(OSError):
            self._listening.shutdown(socket.SHUT_RDWR)
        self._listening.close()
        self.cut()

    def __enter__(self) -> ByteProxy:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listening.accept()
            except OSError:
                return
            try:
                robot = socket.create_connection(self._target)
            except OSError:
                client.close()
                continue
            for side in (client, robot):
                side.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.cut()
            with self._lock:
                self._pair = (client, robot)
            to_robot = threading.Thread(target=self._pump, args=(client, robot, "to_robot"), daemon=True)
            to_host = threading.Thread(target=self._pump, args=(robot, client, "to_host"), daemon=True)
            for pump in (to_robot, to_host):
                pump.start()
            threading.Thread(
                target=_close_after, args=(client, robot, to_robot, to_host), daemon=True
            ).start()

    def _pump(self, source: socket.socket, sink: socket.socket, direction: Direction) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(4096):
                for piece, delay_s in self._disturbed(data, direction):
                    time.sleep(delay_s)
                    sink.sendall(piece)
        for side in (source, sink):
            with contextlib.suppress(OSError):
                side.shutdown(socket.SHUT_RDWR)

    def _disturbed(self, data: bytes, direction: Direction) -> list[tuple[bytes, float]]:
        """Return the pieces to pass on, each with the delay before it [s]."""
        pieces, piece, delay_s = [], bytearray(), 0.0
        rng, faults = self._random[direction], self.faults
        for byte in data:
            with self._lock:
                kinds = {self._due[direction].pop(0)} if self._due[direction] else set()
            kinds |= {kind for kind in KINDS if rng.random() < getattr(faults, kind)}
            self.n_struck.update(kinds)
            if "delay" in kinds:
                if piece:
                    pieces.append((bytes(piece), delay_s))
                piece, delay_s = bytearray(), rng.uniform(0, faults.delay_s)
            if "drop" in kinds:
                continue
            value = byte ^ (1 << rng.randrange(8)) if "corrupt" in kinds else byte
            piece += bytes((value, value)) if "duplicate" in kinds else bytes((value,))
        pieces.append((bytes(piece), delay_s))
        return pieces


def _close_after(client: socket.socket, robot: socket.socket, *pumps: threading.Thread) -> None:
    for pump in pumps:
        pump.join()
    client.close()
    robot.close()
