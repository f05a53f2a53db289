"""Connections that have not shown the token: limited in number, time, and bytes, so that they cut nobody else off."""

from __future__ import annotations

import asyncio
import sys
from functools import partial
from typing import Any

PATIENCE_S = 10.0
"""Time in which a connection must show the token [s]. A browser sends it with its first bytes."""
MOST_BYTES = 64 * 1024
"""Number of bytes that a connection may send before it shows the token."""
MOST = 64
"""Largest number of connections that have not shown the token."""
SHARE = 8
"""They get one of so many descriptors of the process at most."""
SHOWN = "realitygap_shown"
"""Name of the function in a connection's state that reports that it has shown the token."""


def most_strangers() -> int:
    """Return the largest number of connections without the token, which depends on the limit of descriptors."""
    if sys.platform == "win32":
        return MOST
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return MOST if limit == resource.RLIM_INFINITY else min(MOST, max(limit // SHARE, 1))


class Strangers:
    """The open connections that have not shown the token. If there are too many, the oldest is closed.

    Args:
        most: Largest number of them.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._timers: dict[asyncio.Transport, asyncio.TimerHandle] = {}

    def __contains__(self, transport: asyncio.Transport) -> bool:
        return transport in self._timers

    def meet(self, transport: asyncio.Transport) -> None:
        """Add a new connection."""
        loop = asyncio.get_running_loop()
        self._timers[transport] = loop.call_later(PATIENCE_S, self.drop, transport)
        if len(self._timers) > self._most:
            self.drop(next(iter(self._timers)))

    def forget(self, transport: asyncio.Transport) -> None:
        """Remove a connection that has shown the token, or is closed."""
        timer = self._timers.pop(transport, None)
        if timer is not None:
            timer.cancel()

    def drop(self, transport: asyncio.Transport) -> None:
        """Close a connection."""
        self.forget(transport)
        transport.abort()


def guarded_protocol(strangers: Strangers) -> type[asyncio.Protocol]:
    """Return the protocol of uvicorn whose connections are strangers until a request has shown the token."""
    from uvicorn.protocols.http.auto import AutoHTTPProtocol

    protocol: Any = AutoHTTPProtocol

    class GuardedProtocol(protocol):  # type: ignore[misc]
        n_heard = 0

        def connection_made(self, transport: asyncio.Transport) -> None:
            super().connection_made(transport)
            strangers.meet(transport)
            self.app_state: dict[str, Any] = {**self.app_state, SHOWN: partial(strangers.forget, transport)}

        def data_received(self, data: bytes) -> None:
            self.n_heard += len(data)
            super().data_received(data)
            if self.n_heard > MOST_BYTES and self.transport in strangers:
                # the first bytes of an upload may be more; the task that reads its token runs before this call
                asyncio.get_running_loop().call_soon(self.drop_stranger)

        def drop_stranger(self) -> None:
            if self.transport in strangers:
                strangers.drop(self.transport)

        def connection_lost(self, error: Exception | None) -> None:
            strangers.forget(self.transport)
            super().connection_lost(error)

    return GuardedProtocol
