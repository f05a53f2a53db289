"""Who may see the lab: this machine alone, or whoever has the token; and nothing but its own pages."""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qsl, urlencode, urlsplit

from ._frames import checked

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]

COOKIE = "realitygap_lab"
VISITOR = "realitygap_visitor"
"""The cookie that tells one browser from another."""
LARGEST_BODY = 32 * 1024 * 1024
"""Of an upload [bytes]: a photograph of 24 million pixels has a third of it."""
_TALK = "/_nicegui_ws/"
"""Where pages' websockets are; the same without one would go past what is checked."""
LOOPBACK = ("127.0.0.1", "localhost", "::1")

_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self' ws: wss:; frame-src 'self' data: blob:; "
    "object-src 'none'; base-uri 'self'; form-action 'self'; frame-ancestors 'self'"
)
"""A page loads nothing from elsewhere, and is shown within no other site's."""


class Access:
    """Lets those in who may: in front of the pages, their websockets and their uploads.

    Args:
        app: What is behind.
        token: That everyone must bring, in the address once and in a cookie from then on; None for nobody, and then the
            only names by which the lab answers are those of this machine's loopback, so that no page from elsewhere can
            pose as ours.
    """

    def __init__(self, app: Any, token: str | None) -> None:
        self.app = app
        self._token = token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, or pass on."""
        if scope["type"] == "http":
            await self._http(scope, receive, send)
        elif scope["type"] == "websocket":
            if self._is_welcome(scope) and self._is_own(scope):
                await self.app(scope, checked(receive, send), send)
            else:
                await receive()
                await send({"type": "websocket.close", "code": 1008})
        else:
            await self.app(scope, receive, send)

    async def _http(self, scope: Scope, receive: Receive, send: Send) -> None:
        if not self._is_known_host(scope):
            await _refuse(
                send, 421, "The lab answers at 127.0.0.1 and localhost. Open the address that it printed."
            )
        elif self._brings_token(scope):
            await self._take_in(scope, send)
        elif not self._has_token(scope):
            await _refuse(
                send, 401, "The lab needs its token. Open the address, or the QR code, that it printed."
            )
        elif scope["method"] not in ("GET", "HEAD", "OPTIONS") and not self._is_own(scope):
            await _refuse(send, 403, "A page from elsewhere cannot act here.")
        elif scope["path"].startswith(_TALK):
            await _refuse(send, 400, "Pages talk to the lab over a websocket.")
        elif _announced(scope) > LARGEST_BODY:
            await _refuse(send, 413, f"Too large: expected at most {LARGEST_BODY // 1024 // 1024} MB.")
        else:
            new = None if _cookie(scope, VISITOR) else secrets.token_urlsafe(12)
            if new is not None:
                scope = {**scope, "headers": [*_with_cookie(scope, VISITOR, new)]}
            await self.app(scope, _bounded(receive), _with_policy(send, new))

    def _is_welcome(self, scope: Scope) -> bool:
        return self._is_known_host(scope) and self._has_token(scope)

    def _is_known_host(self, scope: Scope) -> bool:
        if self._token is not None:  # who has it was told the address
            return True
        try:
            return urlsplit("//" + _header(scope, b"host")).hostname in LOOPBACK
        except ValueError:
            return False

    def _is_own(self, scope: Scope) -> bool:
        """Whether the page that asks is one of the lab's; what is no browser names none."""
        origin = _header(scope, b"origin")
        return not origin or urlsplit(origin).netloc == _header(scope, b"host")

    def _has_token(self, scope: Scope) -> bool:
        if self._token is None:
            return True
        return _same(_cookie(scope, COOKIE), self._token)

    def _brings_token(self, scope: Scope) -> bool:
        given = dict(parse_qsl(scope["query_string"].decode("latin-1")))
        return self._token is not None and "token" in given and _same(given["token"], self._token)

    async def _take_in(self, scope: Scope, send: Send) -> None:
        """Keep the token in a cookie, and show the page without it in the address."""
        rest = [pair for pair in parse_qsl(scope["query_string"].decode("latin-1")) if pair[0] != "token"]
        address = "/" + scope["path"].lstrip("/\\") + (f"?{urlencode(rest)}" if rest else "")
        cookie = f"{COOKIE}={self._token}; Path=/; HttpOnly; SameSite=Lax; Max-Age=2592000"
        headers = [
            (b"location", address.encode("latin-1", "ignore")),
            (b"set-cookie", cookie.encode()),
            (b"referrer-policy", b"no-referrer"),
            (b"content-length", b"0"),
        ]
        await send({"type": "http.response.start", "status": 303, "headers": headers})
        await send({"type": "http.response.body", "body": b""})


def _same(one: str, other: str) -> bool:
    return hmac.compare_digest(one.encode(), other.encode())


def _header(scope: Scope, name: bytes) -> str:
    found: bytes = next((value for key, value in scope["headers"] if key == name), b"")
    return found.decode("latin-1")


def _cookie(scope: Scope, name: str) -> str:
    """Its value; empty where there is none."""
    try:
        cookies = SimpleCookie(_header(scope, b"cookie"))
    except CookieError:
        return ""
    return cookies[name].value if name in cookies else ""


def _with_cookie(scope: Scope, name: str, value: str) -> list[tuple[bytes, bytes]]:
    """The headers as if the browser had brought a cookie."""
    rest = [pair for pair in scope["headers"] if pair[0] != b"cookie"]
    before = _header(scope, b"cookie")
    return [
        *rest,
        (b"cookie", (f"{before}; " if before else "").encode("latin-1") + f"{name}={value}".encode()),
    ]


def _announced(scope: Scope) -> int:
    text = _header(scope, b"content-length")
    return int(text) if text.isdecimal() else 0


def _bounded(receive: Receive) -> Receive:
    """What is sent, up to the limit: a body that announced no length is cut off there."""
    left = LARGEST_BODY

    async def limited() -> MutableMapping[str, Any]:
        nonlocal left
        message = await receive()
        left -= len(message.get("body", b""))
        return message if left >= 0 else {"type": "http.disconnect"}

    return limited


def _with_policy(send: Send, visitor: str | None) -> Send:
    """Answers with the policy, and with a cookie for a browser that has not been here."""
    cookie = f"{VISITOR}={visitor}; Path=/; HttpOnly; SameSite=Lax; Max-Age=31536000"

    async def sent(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            own = [
                (b"content-security-policy", _POLICY.encode()),
                (b"x-content-type-options", b"nosniff"),
                (b"referrer-policy", b"same-origin"),
                *([(b"set-cookie", cookie.encode())] if visitor else []),
            ]
            message = {**message, "headers": [*message.get("headers", []), *own]}
        await send(message)

    return sent


async def _refuse(send: Send, status: int, text: str) -> None:
    body = text.encode()
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
