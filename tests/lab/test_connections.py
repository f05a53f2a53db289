"""A page that answers too late is told that its connection is over."""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor

import engineio
from engineio.async_socket import AsyncSocket

from realitygap.lab._connections import end_lost_sockets


class Websocket:
    """A websocket whose page sends nothing."""

    def __init__(self) -> None:
        self.closed = asyncio.Event()

    async def wait(self) -> None:
        await self.closed.wait()

    async def send(self, _: object) -> None:
        pass

    async def close(self) -> None:
        self.closed.set()


def test_websocket_of_a_page_that_answers_too_late_is_closed(monkeypatch):
    monkeypatch.setattr(
        AsyncSocket, "check_ping_timeout", AsyncSocket.check_ping_timeout
    )  # put back afterwards
    end_lost_sockets()
    end_lost_sockets()  # as by a second lab in one process

    async def talk() -> None:
        server = engineio.AsyncServer(async_mode="asgi", ping_interval=1000, ping_timeout=8)
        socket, websocket = AsyncSocket(server, "page"), Websocket()
        handling = asyncio.create_task(socket._websocket_handler(websocket))
        socket.last_ping = 1.0  # long ago
        assert not await socket.check_ping_timeout()
        await handling
        assert websocket.closed.is_set()

    with ThreadPoolExecutor(1) as pool:  # a browser of other tests runs an event loop in this thread
        pool.submit(asyncio.run, talk()).result()
