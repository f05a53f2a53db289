"""Who may see the lab."""

from __future__ import annotations

from typing import Any

import pytest

from realitygap.lab._access import COOKIE, LARGEST_BODY, Access


def asked(access: Access, **scope: Any) -> tuple[int, dict[bytes, bytes]]:
    """Status and headers of the answer to a request; 0 for a closed websocket."""
    sent: list[Any] = []

    async def receive() -> Any:
        return {"type": "http.request", "body": b"", "more_body": False}

    async def send(message: Any) -> None:
        sent.append(message)

    headers = [(key.encode(), value.encode()) for key, value in scope.pop("headers", {}).items()]
    whole = {"type": "http", "method": "GET", "path": "/", "query_string": b"", "headers": headers, **scope}
    with pytest.raises(
        StopIteration
    ):  # nothing in it waits; and a browser may have a loop of its own going on
        access(whole, receive, send).send(None)
    return sent[0].get("status", 0), dict(sent[0].get("headers", []))


async def page(scope: Any, receive: Any, send: Any) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept", "status": 101})
        return
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b""})


OWN = {"host": "127.0.0.1:8321"}


def test_without_a_token_only_names_of_this_machine_are_answered():
    for host, status in {
        "127.0.0.1:1": 200,
        "localhost:1": 200,
        "[::1]:1": 200,
        "evil.example": 421,
        "": 421,
    }.items():
        assert asked(Access(page, None), headers={"host": host})[0] == status


@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_with_a_token_nobody_comes_in_without_it(kind):
    access = Access(page, "secret")
    refused = asked(access, type=kind, headers={"host": "robot.lan"})[0]
    welcome = asked(access, type=kind, headers={"host": "robot.lan", "cookie": f"{COOKIE}=secret"})[0]
    wrong = asked(access, type=kind, headers={"host": "robot.lan", "cookie": f"{COOKIE}=secreT"})[0]
    assert (refused, wrong, welcome) == ((401, 401, 200) if kind == "http" else (0, 0, 101))


def test_the_token_in_the_address_becomes_a_cookie_and_leaves_the_address():
    status, headers = asked(
        Access(page, "secret"), path="/new", query_string=b"token=secret&a=1", headers=OWN
    )
    assert status == 303
    assert headers[b"location"] == b"/new?a=1"
    assert b"HttpOnly" in headers[b"set-cookie"]


def test_the_way_on_never_leads_to_another_host():
    _, headers = asked(Access(page, "s"), path="//evil.example/x", query_string=b"token=s", headers=OWN)
    assert headers[b"location"] == b"/evil.example/x"


def test_a_page_from_elsewhere_can_neither_act_nor_listen():
    for kind, refused, welcome in (("http", 403, 200), ("websocket", 0, 101)):
        for origin, status in {"http://evil.example": refused, "http://127.0.0.1:8321": welcome}.items():
            headers = {**OWN, "origin": origin}
            assert asked(Access(page, None), type=kind, method="POST", headers=headers)[0] == status


def test_uploads_are_bounded():
    headers = {**OWN, "content-length": str(LARGEST_BODY + 1)}
    assert asked(Access(page, None), method="POST", headers=headers)[0] == 413


def test_pages_load_nothing_from_elsewhere():
    _, headers = asked(Access(page, None), headers=OWN)
    assert b"default-src 'self'" in headers[b"content-security-policy"]
