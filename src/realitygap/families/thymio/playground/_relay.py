"""A process that passes bytes between an inherited socket outside a network namespace and a port within it.

It is run as `python -I -S FILE DESCRIPTOR PORT`: the listening socket, and the port on loopback of its namespace. When
its standard input ends, the program that started it has ended. It then ends all processes of the playground.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import socket
import sys


def main() -> None:
    """Serve one connection after the other."""
    listener = socket.socket(fileno=int(sys.argv[1]))
    while True:
        _readable([listener])
        outside, _ = listener.accept()
        with (
            outside,
            contextlib.suppress(OSError),
            socket.create_connection(("127.0.0.1", int(sys.argv[2]))) as inside,
        ):
            for each in (outside, inside):
                each.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            _pass_on(outside, inside)


def _readable(sockets: list[socket.socket]) -> list[socket.socket]:
    """Return those of the sockets that have something to read; wait for it."""
    ready = select.select([0, *(each.fileno() for each in sockets)], [], [])[0]
    if 0 in ready:
        os.killpg(os.getpgrp(), signal.SIGKILL)
    return [each for each in sockets if each.fileno() in ready]


def _pass_on(outside: socket.socket, inside: socket.socket) -> None:
    """Pass bytes on in both directions until one side closes."""
    while True:
        for source in _readable([outside, inside]):
            data = source.recv(4096)
            source.setsockopt(
                socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1
            )  # until the next: the playground waits for it
            if not data:
                return
            (inside if source is outside else outside).sendall(data)


if __name__ == "__main__":
    main()
