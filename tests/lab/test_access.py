"""Who may see the lab."""

from __future__ import annotations

from typing import Any

import pytest

from realitygap.lab._access import CLASS_FILES, CLASS_SOCKET, FOREIGN_HEADERS, LARGEST_BODY, Access

COOKIE = "realitygap_lab_8321"
OWN = {"host": "127.0.0.1:8321", "cookie": f"{COOKIE}=secret"}


def asked(access: Access, **scope: Any) -> tuple[int, dict[bytes, bytes], bytes]:
    """Status, headers, and body of the answer to a request; status 0 for a closed websocket."""
    sent: list[Any] = []

    async def receive() -> Any:
        return {"type": "http.request", "body": b"", "more_body": False}

    async def send(message: Any) -> None:
        sent.append(message)

    headers = [(key.encode(), value.encode("latin-1")) for key, value in scope.pop("headers", {}).items()]
    whole = {"type": "http", "method": "GET", "path": "/", "query_string": b"", "headers": headers, **scope}
    with pytest.raises(
        StopIteration
    ):  # nothing in it waits; and a browser may have a loop of its own going on
        access(whole, receive, send).send(None)
    return sent[0].get("status", 0), dict(sent[0].get("headers", [])), sent[-1].get("body", b"")


def access(*, is_local: bool = True) -> Access:
    return Access(page, "secret", port=8321, is_local=is_local)


async def page(scope: Any, receive: Any, send: Any) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept", "status": 101})
        return
    headers = FOREIGN_HEADERS if scope["path"] == "/foreign" else {}
    encoded = [(key.encode(), value.encode()) for key, value in headers.items()]
    await send({"type": "http.response.start", "status": 200, "headers": encoded})
    await send({"type": "http.response.body", "body": b"a page"})


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example:8321", "", "[::1"])
def test_local_lab_refuses_other_host_names(host):
    assert asked(access(), headers={**OWN, "host": host})[0] == 421
    assert asked(access(), type="websocket", headers={**OWN, "host": host})[0] == 0


@pytest.mark.parametrize("host", ["127.0.0.1:1", "localhost:1", "[::1]:1"])
def test_local_lab_answers_by_the_names_of_loopback(host):
    assert asked(access(), headers={**OWN, "host": host})[0] == 200


def test_lab_for_a_network_answers_by_any_name():
    assert asked(access(is_local=False), headers={**OWN, "host": "robot.lan"})[0] == 200


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize("is_local", [True, False])
@pytest.mark.parametrize(
    "cookie",
    [
        "",
        f"{COOKIE}=secreT",
        f"{COOKIE}=",
        "realitygap_lab_8322=secret",
        f"x{COOKIE}=secret",
        f"{COOKIE}=\xe9",
    ],
)
def test_nothing_is_served_without_the_token(kind, is_local, cookie):
    headers = {"host": "127.0.0.1:8321", "cookie": cookie}
    status, _, body = asked(access(is_local=is_local), type=kind, headers=headers)
    assert status == (403 if kind == "http" else 0)
    assert b"a page" not in body


@pytest.mark.parametrize("cookie", [f'a={{"b": "c"}}; {COOKIE}=secret', f"{COOKIE}=old; {COOKIE}=secret"])
def test_token_is_found_among_other_cookies(cookie):
    assert asked(access(), headers={**OWN, "cookie": cookie})[0] == 200


def test_wall_tells_where_the_address_is_and_takes_a_token():
    status, headers, body = asked(access(), path='/"><script>', headers={"host": "localhost:8321"})
    assert status == 403
    assert b"printed in its terminal" in body
    assert b'name="token"' in body
    assert b"<script" not in body
    assert headers[b"cache-control"] == b"no-store"


@pytest.mark.parametrize("given", [b"secret", b"http%3A%2F%2Fx%3A1%2F%3Ftoken%3Dsecret", b"+secret"])
def test_token_becomes_a_strict_cookie_and_leaves_the_address(given):
    query = b"token=" + given + b"&a=1"
    status, headers, body = asked(access(), path="/new", query_string=query, headers={"host": "localhost"})
    assert status == 200
    assert headers[b"set-cookie"].startswith(b"realitygap_lab_8321=secret; Path=/; HttpOnly; SameSite=Strict")
    assert headers[b"referrer-policy"] == b"no-referrer"
    assert b'content="0; url=/new?a=1"' in body
    assert b"secret" not in body


def test_wrong_token_is_refused_in_words():
    status, headers, body = asked(access(), query_string=b"token=secret2", headers={"host": "localhost"})
    assert status == 403
    assert b"set-cookie" not in headers
    assert b"not the one of this lab" in body


@pytest.mark.parametrize(
    ("path", "next_path"), [("//evil.example/x", "/evil.example/x"), ('/";x', "/%22%3Bx")]
)
def test_entry_never_leads_to_another_host(path, next_path):
    _, _, body = asked(access(), path=path, query_string=b"token=secret", headers={"host": "localhost"})
    assert f'content="0; url={next_path}"'.encode() in body


@pytest.mark.parametrize("origin", ["http://evil.example", "http://127.0.0.1:9999", "null", "http://["])
def test_page_from_elsewhere_can_neither_act_nor_listen(origin):
    headers = {**OWN, "origin": origin}
    assert asked(access(), method="POST", headers=headers)[0] == 403
    assert asked(access(), type="websocket", headers=headers)[0] == 0


def test_own_page_can_act_and_listen():
    headers = {**OWN, "origin": "http://127.0.0.1:8321"}
    assert asked(access(), method="POST", headers=headers)[0] == 200
    assert asked(access(), type="websocket", headers=headers)[0] == 101


def test_uploads_are_bounded():
    headers = {**OWN, "content-length": str(LARGEST_BODY + 1)}
    assert asked(access(), method="POST", headers=headers)[0] == 413


def test_pages_load_nothing_from_elsewhere_and_are_shown_in_no_frame():
    _, headers, _ = asked(access(), headers=OWN)
    assert b"default-src 'self'" in headers[b"content-security-policy"]
    assert b"frame-ancestors 'none'" in headers[b"content-security-policy"]
    assert headers[b"x-frame-options"] == b"DENY"
    assert headers[b"x-content-type-options"] == b"nosniff"
    assert headers[b"referrer-policy"] == b"no-referrer"


def test_files_of_a_results_folder_are_served_in_a_sandbox():
    _, headers, _ = asked(access(), path="/foreign", headers=OWN)
    assert headers[b"content-security-policy"].startswith(b"sandbox allow-scripts; default-src 'none'")
    assert headers[b"x-content-type-options"] == b"nosniff"


STRANGER = {"host": "127.0.0.1:8321"}


def with_class() -> Access:
    return Access(page, "secret", port=8321, is_local=True, has_class=True)


def test_student_needs_no_token_for_the_page_of_the_class_and_its_websocket():
    assert all(asked(with_class(), path=path, headers=STRANGER)[0] == 200 for path in CLASS_FILES)
    assert asked(with_class(), type="websocket", path=CLASS_SOCKET, headers=STRANGER)[0] == 101


@pytest.mark.parametrize(
    "path", ["/", "/class/board", "/class/", "/class/../", "/robot", "/stop", "/lab-files/frame.js"]
)
def test_student_can_open_nothing_else(path):
    assert asked(with_class(), path=path, headers=STRANGER)[0] == 403
    assert asked(with_class(), path=path, method="POST", headers=STRANGER)[0] == 403
    assert asked(with_class(), type="websocket", path=path, headers=STRANGER)[0] == 0


def test_student_cannot_post_to_the_page_of_the_class():
    assert asked(with_class(), path="/class", method="POST", headers=STRANGER)[0] == 403


def test_page_of_another_site_cannot_open_the_websocket_of_the_class():
    foreign = {**STRANGER, "origin": "http://evil.example"}
    assert asked(with_class(), type="websocket", path=CLASS_SOCKET, headers=foreign)[0] == 0
    other_host = {"host": "evil.example:8321"}
    assert asked(with_class(), type="websocket", path=CLASS_SOCKET, headers=other_host)[0] == 0


def test_lab_without_a_class_has_no_open_page():
    assert all(asked(access(), path=path, headers=STRANGER)[0] == 403 for path in CLASS_FILES)
    assert asked(access(), type="websocket", path=CLASS_SOCKET, headers=STRANGER)[0] == 0
