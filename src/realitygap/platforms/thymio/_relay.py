"""A process that passes bytes between an inherited socket outside a network namespace and a port within it.

It is run as `python -I -S FILE DESCRIPTOR PORT`: the listening socket, and the port on loopback of its namespace.
"""

from __future__ import annotations

import contextlib
import select
import socket
import sys


def main() -> None:
    """Serve one connection after the other."""
    listener = socket.socket(fileno=int(sys.argv[1]))
    while True:
        outside, _ = listener.accept()
        with (
            outside,
            contextlib.suppress(OSError),
            socket.create_connection(("127.0.0.1", int(sys.argv[2]))) as inside,
        ):
            for each in (outside, inside):
                each.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            _pass_on(outside, inside)


def _pass_on(outside: socket.socket, inside: socket.socket) -> None:
    """Pass bytes on in both directions until one side closes."""
    while True:
        for source in select.select([outside, inside], [], [])[0]:
            data = source.recv(4096)
            if not data:
                return
            (inside if source is outside else outside).sendall(data)


if __name__ == "__main__":
    main()
