"""Connections: how many may not have shown the token, which messages a page may send, and when they end.

A connection without the token is limited in time and bytes, so that it cuts nobody else off.
"""

from __future__ import annotations

import asyncio
import functools
import sys
from collections.abc import Awaitable, Callable, MutableMapping
from functools import partial
from typing import Any

from realitygap._limits import parse_json

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


def end_lost_sockets() -> None:
    """Have Engine.IO close the websocket of a page that answered too late, so that the page connects again soon.

    Engine.IO forgets such a page, and does not tell it (its issue 323). Until the page misses the next sign of life, up
    to 24 s later, all presses on it are lost, and meanwhile NiceGUI deletes what it shows.
    """
    from engineio.async_socket import AsyncSocket

    check = AsyncSocket.check_ping_timeout
    if hasattr(check, "__wrapped__"):
        return

    @functools.wraps(check)
    async def check_and_end(socket: AsyncSocket) -> bool:
        is_there: bool = await check(socket)
        if not is_there:
            await socket.queue.put(None)  # ends the task that sends, which closes the websocket
        return is_there

    AsyncSocket.check_ping_timeout = check_and_end


Message = MutableMapping[str, Any]

LONGEST_LOG = 2000
"""Largest length of a report of a page to the server's log [letters]."""
REFUSED = "This is no message of a page of the lab."
_VIOLATION = 1008
_TEXTS = ("client_id", "listener_id", "request_id", "tab_id", "document_id", "old_tab_id", "level", "message")
_NUMBERS = ("id", "next_message_id")
_NEEDED = {
    "event": ("client_id", "id", "listener_id", "args"),
    "ack": ("client_id", "next_message_id"),
    "javascript_response": ("client_id", "request_id"),
    "log": ("client_id", "level", "message"),
    "handshake": ("client_id", "tab_id", "document_id"),
}


def checked(
    receive: Callable[[], Awaitable[Message]], send: Callable[[Message], Awaitable[None]]
) -> Callable[[], Awaitable[Message]]:
    """Pass on messages up to the first one that no page sends, which ends the connection.

    Args:
        receive, send: Of a websocket, as ASGI has them.
    """

    async def heard() -> Message:
        message = await receive()
        if message["type"] == "websocket.receive" and not is_of_page(message.get("text")):
            await send({"type": "websocket.close", "code": _VIOLATION, "reason": REFUSED})
            return {"type": "websocket.disconnect", "code": _VIOLATION}
        return message

    return heard


def is_of_page(frame: str | None) -> bool:
    """Return True if a frame is one of Engine.IO, or an event in the form that the pages' library expects."""
    if not isinstance(frame, str):
        return False
    if not frame.startswith("42"):
        return frame in ("1", "2", "2probe", "3", "5", "40", "40{}", "41")
    text = frame[2:].lstrip("0123456789") if frame[2:3].isdigit() else frame[2:]
    try:
        match _value(text):
            case [str(what), dict(said)]:
                return _fits(what, said)
    except ValueError:
        pass
    return False


def _fits(what: str, said: dict[str, Any]) -> bool:
    needed = _NEEDED.get(what)
    if needed is None or any(key not in said for key in needed):
        return False
    return all(_is_right(key, value) for key, value in said.items())


def _is_right(key: str, value: Any) -> bool:
    if key in _TEXTS:
        return isinstance(value, str) and len(value) <= LONGEST_LOG
    if key in _NUMBERS:
        return type(value) is int and abs(value) < 2**53
    if key == "args":
        return isinstance(value, list) and all(each is None or _is_json(each) for each in value)
    return True


def _is_json(text: Any) -> bool:
    if isinstance(text, str):
        _value(text)
        return True
    return False


def _value(text: str) -> Any:
    """Parse JSON with finite numbers and valid characters only.

    Raises:
        ValueError: It is none, or holds others.
    """
    return parse_json(text, large=True)
