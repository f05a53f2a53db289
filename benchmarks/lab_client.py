"""A page of the lab without a browser: what it loads, hears and says, over plain HTTP and a websocket."""

from __future__ import annotations

import ast
import asyncio
import contextlib
import json
import re
import secrets
import time
from typing import Any
from urllib.parse import urlencode, urlsplit
from urllib.request import Request, urlopen

import websockets
from websockets.asyncio.client import ClientConnection, connect

ESCAPED = {"&lt;": "<", "&gt;": ">", "&#96;": "`", "&#36;": "$", "&amp;": "&"}
FIGURE = re.compile(r"/figures/[\w./-]+-wide\.svg\?v=\d+")


class PageClient:
    """A page, as a browser shows it: its elements are as the server last said.

    Args:
        address: Of the page, with the token that the lab printed.
        looks: Whether to load the figures of the page, as they come.
    """

    def __init__(self, address: str, *, looks: bool = False) -> None:
        self.address, _, token = address.partition("?token=")
        self._cookie = {"Cookie": f"realitygap_lab_{urlsplit(self.address).port}={token}"}
        self.elements: dict[str, dict[str, Any]] = {}
        self.messages: list[tuple[float, str, Any]] = []
        self.n_heard = self.n_bytes = 0
        self.close_code: int | None = None
        self.close_reason: str | None = None
        self._looks = looks
        self._figures: set[str] = set()
        self._socket: ClientConnection | None = None
        self._client_id = ""
        self._heard = asyncio.Event()
        self._listening: asyncio.Task[None] | None = None

    async def __aenter__(self) -> PageClient:
        """Load the page, and connect."""
        html = await asyncio.to_thread(_load, self.address, self._cookie)
        query = ast.literal_eval(_found(r"query: (\{.*?\}),\n", html))
        self._client_id = query["client_id"]
        text = _found(r"createApp\(parseElements\(String\.raw`(.*?)`\)", html)
        for entity, letter in ESCAPED.items():
            text = text.replace(entity, letter)
        self.elements = json.loads(text)
        own = {"tab_id": secrets.token_hex(8), "document_id": secrets.token_hex(8), "old_tab_id": ""}
        sent = {**query, **own, "implicit_handshake": "true", "EIO": "4", "transport": "websocket"}
        address = urlsplit(self.address)
        self._socket = await connect(
            f"ws://{address.netloc}/_nicegui_ws/socket.io/?{urlencode(sent)}",
            origin=f"http://{address.netloc}",  # type: ignore[arg-type]
            additional_headers=self._cookie,
            compression=None,
            max_size=None,
        )
        await self._socket.recv()  # engine.io opens
        await self._socket.send("40")
        answer = await self._socket.recv()
        if not str(answer).startswith("40"):
            raise RuntimeError(f"The lab did not take the page in: {answer!r}")
        self._listening = asyncio.create_task(self._listen())
        return self

    async def __aexit__(self, *_: object) -> None:
        """Leave the page."""
        if self._listening is not None:
            self._listening.cancel()
        if self._socket is not None:
            await self._socket.close()

    # elements

    def find(self, **wanted: Any) -> str:
        """The number of the element with this text, label or other property."""
        for number, element in self.elements.items():
            shown = {**element.get("props", {}), "text": element.get("text")}
            if all(str(shown.get(key)).startswith(value) for key, value in wanted.items()):
                return number
        raise KeyError(f"no element with {wanted}")

    def listener(self, number: str, kind: str) -> str:
        """The number of what an element says when this happens to it."""
        for event in self.elements[number].get("events") or ():
            if event["type"] == kind:
                return str(event["listener_id"])
        raise KeyError(f"element {number} says nothing of {kind}")

    # talk

    async def happen(self, number: str, kind: str, *values: Any) -> None:
        """Say that something has happened to an element."""
        said = {
            "id": int(number),
            "client_id": self._client_id,
            "listener_id": self.listener(number, kind),
            "args": [json.dumps(value) for value in values],
        }
        await self.say("event", said)

    async def say(self, what: str, message: Any) -> None:
        """Say anything."""
        await self.send("42" + json.dumps([what, message]))

    async def send(self, frame: str | bytes) -> None:
        """Send a frame as it is."""
        await self._connection.send(frame)

    async def hear(self, what: str, since: float, seconds: float = 30.0) -> tuple[float, Any]:
        """When something was said first after `since`, and what."""
        end = time.perf_counter() + seconds
        while True:
            self._heard.clear()
            for when, kind, message in self.messages:
                if kind == what and when >= since:
                    return when, message
            await asyncio.wait_for(self._heard.wait(), end - time.perf_counter())

    async def left(self) -> None:
        """Wait until the server has closed the connection; `close_code` and `close_reason` say why."""
        await self._connection.wait_closed()
        self.close_code, self.close_reason = self._connection.close_code, self._connection.close_reason

    @property
    def is_open(self) -> bool:
        """Whether the server has not closed the connection."""
        return self._listening is not None and not self._listening.done()

    @property
    def _connection(self) -> ClientConnection:
        if self._socket is None:
            raise RuntimeError("The page is not open.")
        return self._socket

    async def _listen(self) -> None:
        with contextlib.suppress(websockets.ConnectionClosed):
            async for frame in self._connection:
                now = time.perf_counter()
                text = frame if isinstance(frame, str) else frame.decode()
                self.n_heard += 1
                self.n_bytes += len(text)
                if text == "2":
                    await self._connection.send("3")
                elif text.startswith("42"):
                    self._take(now, *json.loads(text[2:]))

    def _take(self, now: float, kind: str, message: Any = None) -> None:
        if kind == "update":
            for number, element in message.items():
                if number != "_id" and element is not None:
                    self.elements[number] = element
        self.messages = [*self.messages[-200:], (now, kind, message)]
        self._heard.set()
        if self._looks and kind == "update":
            for found in set(FIGURE.findall(json.dumps(message))) - self._figures:
                self._figures.add(found)
                address = urlsplit(self.address)
                asyncio.get_running_loop().run_in_executor(
                    None, _load, f"{address.scheme}://{address.netloc}{found}", self._cookie
                )


def _load(address: str, headers: dict[str, str]) -> str:
    with urlopen(Request(address, headers=headers)) as answer:
        body: bytes = answer.read()
        return "" if answer.headers.get("content-encoding") == "gzip" else body.decode()


def _found(pattern: str, text: str) -> str:
    match = re.search(pattern, text, re.DOTALL)
    if match is None:
        raise RuntimeError(f"The page holds no {pattern}")
    return match[1]
