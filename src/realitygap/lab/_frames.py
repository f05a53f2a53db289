"""Messages that a page may send over its websocket; all others end the connection."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

from realitygap._limits import parse_json

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
