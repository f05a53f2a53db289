"""Access to the lab: visitors need its token, and pages load only the lab's own files."""

from __future__ import annotations

import hmac
import html
import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any
from urllib.parse import parse_qsl, quote, urlencode, urlsplit

from ._connections import SHOWN, checked

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
Headers = list[tuple[bytes, bytes]]

VISITOR = "realitygap_visitor"
"""The cookie that tells one browser from another."""
LARGEST_BODY = 32 * 1024 * 1024
"""Largest size of an upload [bytes]. A photograph of 24 million pixels has a third of it."""
_TALK = "/_nicegui_ws/"
"""Address of the websockets of pages. Other transports at this address are refused, because they would pass
unchecked."""
CLASS_SOCKET = "/class/ws"
"""Address of the websockets of students, which need no token; their messages have a check of their own."""
CLASS_FILES = frozenset(
    {"/class", "/class/class.css", "/class/class.js", "/class/drive_pad.js", "/lab-player/player.css"}
    | {"/lab-player/player.js", "/lab-tokens/tokens.css"}
)
"""Addresses that a student can read without the token."""
LOOPBACK = ("127.0.0.1", "localhost", "::1")

_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self' ws: wss:; frame-src 'self'; "
    "object-src 'none'; base-uri 'self'; form-action 'self'; frame-ancestors 'none'"
)
"""A page loads nothing from elsewhere, and no other site can show it in a frame."""
_PLAIN_POLICY = "default-src 'none'; style-src 'unsafe-inline'; form-action 'self'; frame-ancestors 'none'"
FOREIGN_HEADERS = {
    "content-security-policy": (
        "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
        "img-src data:; font-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
    ),
    "x-frame-options": "SAMEORIGIN",
}
"""Headers of files from a results folder, which somebody else may have written: their scripts run in an origin of their
own. They reach neither the lab nor any other address."""
_OWN_HEADERS = {"content-security-policy": _POLICY, "x-frame-options": "DENY"}
_ALL_HEADERS = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
}

_WALL = """<!doctype html>
<html lang="en-US"><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>realitygap lab</title>
<style>:root {{ color-scheme: light dark }}
body {{ font: 1.1rem/1.5 system-ui, sans-serif; max-width: 34rem; margin: 3rem auto; padding: 0 1rem }}
input, button {{ font: inherit; padding: .5rem; box-sizing: border-box; width: 100%; margin: .3rem 0 }}</style>
<h1>The lab needs its token</h1>
<p>{message}</p>
<p>Open the address that <code>realitygap lab</code> printed in its terminal. It ends in <code>?token=</code> and the
token. Each start of the lab makes a new one.</p>
<p>If you have opened that address since, <a href="{path}">load this page again</a>.</p>
<form><label for="token">Or paste the address or the token here:</label>
<input id="token" name="token" type="password" autocomplete="off" required><button>Open the lab</button></form>
"""
_ENTRY = """<!doctype html>
<html lang="en-US"><meta charset="utf-8"><meta http-equiv="refresh" content="0; url={address}">
<style>:root {{ color-scheme: light dark }}</style>
<title>realitygap lab</title><p><a href="{address}">Open the lab</a></p>
"""


class Access:
    """Checks the token before each page, websocket, file, and upload.

    The token comes in the address once. From then on the browser sends it in a cookie.

    Args:
        app: What is behind.
        token: The secret of this start of the lab.
        port: Port of the lab. It is in the cookie's name, because a browser sends the cookies of one host to all its
            ports, and two labs must not overwrite each other's.
        is_local: Whether the lab answers this machine alone. It then refuses all other host names, so that no page
            from elsewhere can pose as the lab's by pointing its own name here.
        has_class: Whether students can open the page of the class, and nothing else, without the token.
    """

    def __init__(self, app: Any, token: str, *, port: int, is_local: bool, has_class: bool = False) -> None:
        self.app = app
        self._has_class = has_class
        self.cookie = f"realitygap_lab_{port}"
        self._token = token
        self._is_local = is_local

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, or pass on."""
        if scope["type"] == "http":
            await self._http(scope, receive, send)
        elif scope["type"] == "websocket":
            if (
                self._has_class
                and scope["path"] == CLASS_SOCKET
                and self._is_known_host(scope)
                and self._is_own(scope)
            ):
                _note_shown(scope)
                await self.app(scope, receive, send)
            elif self._is_known_host(scope) and self._has_token(scope) and self._is_own(scope):
                _note_shown(scope)
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
            return
        given = self._given_token(scope)
        if given is not None and _same(given, self._token):
            _note_shown(scope)
            await self._let_in(scope, send)
        elif not self._has_token(scope) and not self._is_of_class(scope):
            await self._stop(scope, send, is_wrong=given is not None)
        else:
            _note_shown(scope)
            await self._act(scope, receive, send)

    async def _act(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["method"] not in ("GET", "HEAD", "OPTIONS") and not self._is_own(scope):
            await _refuse(send, 403, "A page from elsewhere cannot act here.")
        elif scope["path"].startswith(_TALK):
            await _refuse(send, 400, "Pages talk to the lab over a websocket.")
        elif _announced(scope) > LARGEST_BODY:
            await _refuse(send, 413, f"Too large: expected at most {LARGEST_BODY // 1024 // 1024} MB.")
        else:
            new = None if _cookies(scope, VISITOR) else secrets.token_urlsafe(12)
            if new is not None:
                scope = {**scope, "headers": [*_with_cookie(scope, VISITOR, new)]}
            await self.app(scope, _bounded(receive), _with_policy(send, new))

    def _is_known_host(self, scope: Scope) -> bool:
        if not self._is_local:
            return True
        try:
            return urlsplit("//" + _header(scope, b"host")).hostname in LOOPBACK
        except ValueError:
            return False

    def _is_own(self, scope: Scope) -> bool:
        """Return True if the request is of a page of the lab, or of a program that is no browser and names no page."""
        origin = _header(scope, b"origin")
        return not origin or origin.partition("://")[2] == _header(scope, b"host")

    def _has_token(self, scope: Scope) -> bool:
        return any(_same(value, self._token) for value in _cookies(scope, self.cookie))

    def _is_of_class(self, scope: Scope) -> bool:
        return self._has_class and scope["method"] in ("GET", "HEAD") and scope["path"] in CLASS_FILES

    def _given_token(self, scope: Scope) -> str | None:
        """The token in the address, or in an address that was pasted in its place; None if there is none."""
        given = dict(parse_qsl(scope["query_string"].decode("latin-1"))).get("token")
        return None if given is None else given.strip().rpartition("token=")[2]

    async def _let_in(self, scope: Scope, send: Send) -> None:
        """Store the token in a cookie, and have the browser load the page without it in the address.

        A redirect would not do: a browser that comes from another site, or from a file, sends a strict cookie only to
        the requests that begin at a page of the lab.
        """
        rest = [pair for pair in parse_qsl(scope["query_string"].decode("latin-1")) if pair[0] != "token"]
        address = html.escape(_path(scope) + (f"?{urlencode(rest)}" if rest else ""))
        cookie = f"{self.cookie}={self._token}; Path=/; HttpOnly; SameSite=Strict; Max-Age=2592000"
        await _answer(send, 200, _ENTRY.format(address=address), [(b"set-cookie", cookie.encode())])

    async def _stop(self, scope: Scope, send: Send, *, is_wrong: bool) -> None:
        message = (
            "The token is not the one of this lab." if is_wrong else "This browser does not have it yet."
        )
        await _answer(send, 403, _WALL.format(message=message, path=html.escape(_path(scope))))


def _note_shown(scope: Scope) -> None:
    """Report that the connection of a request has shown the token."""
    shown = scope.get("state", {}).get(SHOWN)
    if shown is not None:
        shown()


def _same(one: str, other: str) -> bool:
    return hmac.compare_digest(one.encode(), other.encode())


def _path(scope: Scope) -> str:
    """The path as an address has it, which never leads to another host."""
    return "/" + quote(scope["path"].lstrip("/\\"), errors="replace")


def _header(scope: Scope, name: bytes) -> str:
    found: bytes = next((value for key, value in scope["headers"] if key == name), b"")
    return found.decode("latin-1")


def _cookies(scope: Scope, name: str) -> list[str]:
    """The values of all cookies of this name; other programs of this host may have set cookies of any form."""
    pairs = (part.strip().partition("=") for part in _header(scope, b"cookie").split(";"))
    return [value for key, _, value in pairs if key == name]


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
    """Pass on a request's body up to the limit; a body without a length is cut off there."""
    left = LARGEST_BODY

    async def limited() -> MutableMapping[str, Any]:
        nonlocal left
        message = await receive()
        left -= len(message.get("body", b""))
        return message if left >= 0 else {"type": "http.disconnect"}

    return limited


def _with_policy(send: Send, visitor: str | None) -> Send:
    """Answer with the policy, and with a cookie for a new browser."""
    cookie = f"{VISITOR}={visitor}; Path=/; HttpOnly; SameSite=Strict; Max-Age=31536000"

    async def sent(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            headers: Headers = list(message.get("headers", []))
            has_policy = any(key == b"content-security-policy" for key, _ in headers)
            headers += _encoded(_ALL_HEADERS if has_policy else {**_OWN_HEADERS, **_ALL_HEADERS})
            if visitor:
                headers.append((b"set-cookie", cookie.encode()))
            message = {**message, "headers": headers}
        await send(message)

    return sent


def _encoded(headers: dict[str, str]) -> Headers:
    return [(key.encode(), value.encode()) for key, value in headers.items()]


async def _answer(send: Send, status: int, page: str, headers: Headers | None = None) -> None:
    """Answer with a plain page, which nobody keeps."""
    plain = {"content-security-policy": _PLAIN_POLICY, "x-frame-options": "DENY", "cache-control": "no-store"}
    await _send(send, status, "text/html", page, [*_encoded(plain), *(headers or [])])


async def _refuse(send: Send, status: int, text: str) -> None:
    await _send(send, status, "text/plain", text)


async def _send(send: Send, status: int, media_type: str, text: str, headers: Headers | None = None) -> None:
    body = text.encode()
    about = {"content-type": f"{media_type}; charset=utf-8", "content-length": str(len(body))}
    start = [*_encoded({**about, **_ALL_HEADERS}), *(headers or [])]
    await send({"type": "http.response.start", "status": status, "headers": start})
    await send({"type": "http.response.body", "body": body})
