"""Nonsense from the network: refused in words, nothing falls over, nothing is written outside the folder."""

from __future__ import annotations

import asyncio
import contextlib
import http.client
import importlib.util
import json
import random
import sys
import time
from collections.abc import Coroutine
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.exceptions import ConnectionClosed

from realitygap.lab._access import LARGEST_BODY
from realitygap.lab._connections import REFUSED, is_of_page

from .robot_study import make_study

PAGES = ("", "new", "robot", "calibrate", "gap", "study/by-robot/trials", "study/by-robot")
PATHS = (
    "../../etc/passwd",
    "..",
    "/etc/passwd",
    "a\x00b",
    "%2e%2e%2f",
    "~/x",
    "study.toml",
    "sim:../../x",
    "\\\\a\\b",
)
VALUES: list[Any] = [
    None, True, 0, -1, 3.5, 2**53, 10**40, 1e308, "", "x", "9" * 5000, "nan", "\ud7ff\U0001f600", [], {}, [[]], *PATHS,
    {"value": 10**9}, {"value": -1}, {"value": "x"}, {"move": "fast", "turn": None}, [True, 1.5, -4, 10**9, "0"],
]  # fmt: skip
MAYBE_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda each: st.lists(each) | st.dictionaries(st.text(), each),
)


def page_client() -> Any:
    """The class of pages without a browser."""
    if "lab_client" not in sys.modules:
        path = Path(__file__).parents[2] / "benchmarks" / "lab_client.py"
        spec = importlib.util.spec_from_file_location("lab_client", path)
        assert spec is not None
        assert spec.loader is not None
        sys.modules["lab_client"] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules["lab_client"])
    return sys.modules["lab_client"].PageClient


def carried_out(work: Coroutine[Any, Any, Any]) -> Any:
    """Its result; in a thread of its own, as a browser may have a loop in this one."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, work).result(120)


async def answers(page: Any) -> None:
    """It does still: a press of the stop is answered, by a notice or, if a robot is connected, by another label."""
    end = time.perf_counter() + 20.0
    button = None
    while button is None and time.perf_counter() < end:
        with contextlib.suppress(KeyError):  # for 5 s after a stop the label is another one
            button = page.find(label="Stop robot")
        await asyncio.sleep(0.1)
    now = time.perf_counter()
    await page.happen(button, "click", {})
    await asyncio.wait(
        [asyncio.create_task(page.hear(kind, now)) for kind in ("notify", "update")],
        return_when=asyncio.FIRST_COMPLETED,
    )
    assert any(when >= now and kind in ("notify", "update") for when, kind, _ in page.messages)


@pytest.mark.slow
@given(MAYBE_JSON)
def test_any_message_of_a_client_is_accepted_or_refused(value):
    assert is_of_page(json.dumps(["event", value])) is False
    assert is_of_page("42" + json.dumps([value, value])) is False
    said = (
        {"client_id": "a", "id": 1, "listener_id": "b", "args": [json.dumps(value, allow_nan=False)]}
        if _is_plain(value)
        else None
    )
    if said is not None:
        assert is_of_page("42" + json.dumps(["event", said]))


@given(st.text() | st.text('0123456789[]{}",:-eE.tfn\\u').map("42".__add__))
def test_no_text_is_too_much_for_it(text):
    is_of_page(text)


def _is_plain(value: Any) -> bool:
    try:
        json.dumps(value, allow_nan=False, ensure_ascii=False).encode()
    except ValueError:
        return False
    return True


@pytest.mark.parametrize(
    "frame",
    [
        b"\x00\x01",
        "",
        "0",
        "4",
        "42",
        "42[]",
        "42x",
        '42["event"]',
        '42["event",{}]',
        '42["event",{"client_id":1,"id":1,"listener_id":"a","args":[]}]',
        '42["event",{"client_id":"a","id":true,"listener_id":"a","args":[]}]',
        '42["event",{"client_id":"a","id":1,"listener_id":"a","args":["NaN"]}]',
        '42["event",{"client_id":"a","id":1,"listener_id":"a","args":["1e999"]}]',
        '42["event",{"client_id":"a","id":1,"listener_id":"a","args":["\\"\\\\ud800\\""]}]',
        '42["event",{"client_id":"a","id":1,"listener_id":"a","args":["' + "[" * 100_000 + '"]}]',
        '42["ack",{"client_id":"a","next_message_id":1e400}]',
        '42["log",{"client_id":"a","level":"error","message":"' + "x" * 5000 + '"}]',
        '42["shutdown",{"client_id":"a"}]',
        "451-[]",
        "44",
        "42" + "[" * 50_000,
    ],
    ids=lambda frame: str(frame[:40]),
)
def test_frames_that_no_page_sends_are_refused(frame):
    assert not is_of_page(frame)


def test_a_page_that_talks_nonsense_is_left_and_others_go_on(lab):
    async def talk() -> None:
        client = page_client()
        async with client(lab.entry()) as good:
            for frame in ("42nonsense", b"\x01\x02", "42" + json.dumps(["event", {"id": []}])):
                async with client(lab.entry()) as bad:
                    await bad.send(frame)
                    await asyncio.wait_for(bad.left(), 20)
                    assert (bad.close_code, bad.close_reason) == (1008, REFUSED)
            async with client(lab.entry()) as large:
                with contextlib.suppress(ConnectionClosed):  # the lab need not take all of it
                    await large.send("42" + "x" * 2**21)
                await asyncio.wait_for(large.left(), 20)
            await answers(good)

    carried_out(talk())


@pytest.mark.slow
@pytest.mark.parametrize("path", PAGES)
def test_whatever_the_fields_of_a_page_say_it_goes_on(lab, tmp_path, path):
    make_study(lab.root)
    before = _files(tmp_path, but=lab.root)
    rng = random.Random(path)

    async def talk() -> None:
        async with page_client()(lab.entry(path)) as page:
            for number in list(page.elements):
                for event in page.elements.get(number, {}).get("events") or ():
                    for value in rng.sample(VALUES, 4):
                        await page.happen(number, event["type"], value)
            await page.say("event", {"client_id": "nobody", "id": 1, "listener_id": "x", "args": []})
            await asyncio.sleep(0.3)
            assert page.is_open
        async with page_client()(lab.entry(path)) as page:
            await answers(page)

    carried_out(talk())
    assert _files(tmp_path, but=lab.root) == before
    assert {each.name for each in lab.root.iterdir()} <= {
        "by-robot",
        "gaps",
        "my-study",
        "my-robot.trials.sqlite",
    }


def test_paths_that_lead_elsewhere_lead_nowhere(lab):
    make_study(lab.root)
    for place in ("figures/", "reports/", "gaps/", "figures/by-robot/", "lab-files/", "lab-player/"):
        for name in PATHS:
            for written in (quote(name, safe=""), quote(name)):
                status, body = _asked(lab, "GET", "/" + place + written)
                assert status in (400, 404, 405), (place, name, status)
                assert b"root:" not in body
    for place in ("trials/", "study/"):
        for name in PATHS:
            status, body = _asked(lab, "GET", f"/{place}{quote(name, safe='')}")
            assert status in (200, 404), (place, name, status)  # a page that says so
            assert b"root:" not in body


def test_uploads_that_are_none_are_refused_in_words(lab, tmp_path):
    make_study(lab.root)
    before = _files(tmp_path, but=lab.root)

    async def address() -> None:
        async with page_client()(lab.entry("new")) as page:
            place = next(
                each["props"]["url"] for each in page.elements.values() if "url" in each.get("props", {})
            )
            kind = {"Content-Type": "multipart/form-data; boundary=b"}
            head = b'--b\r\nContent-Disposition: form-data; name="f"; filename="../../evil.toml"\r\n\r\n'
            tail = b"\r\n--b--\r\n"
            rng = random.Random(8)
            for body in (
                b"",
                b"--b",
                head,
                head + rng.randbytes(5000) + tail,
                head + b"a = " + b"[" * 9000 + tail,
            ):
                status, _ = await asyncio.to_thread(_asked, lab, "POST", place, body, kind)
                assert status in (200, 400, 422), status
            status, said = await asyncio.to_thread(
                _asked, lab, "POST", place, b"", {**kind, "Content-Length": str(LARGEST_BODY + 1)}
            )
            assert (status, said[:9]) == (413, b"Too large")
            status, _ = await asyncio.to_thread(
                _asked, lab, "POST", place, b"x", {"Content-Type": "text/plain"}
            )
            assert status in (200, 400, 422)
            await answers(page)

    carried_out(address())
    assert _files(tmp_path, but=lab.root) == before
    assert {each.name for each in lab.root.iterdir()} == {"by-robot"}


def _asked(
    lab: Any, how: str, path: str, body: bytes = b"", headers: dict[str, str] | None = None
) -> tuple[int, bytes]:
    connection = http.client.HTTPConnection(urlsplit(lab.address).netloc, timeout=30)
    cookie = f"{lab.cookie['name']}={lab.token}"
    connection.request(how, path, body, {"Cookie": cookie, **(headers or {})})
    answer = connection.getresponse()
    return answer.status, answer.read()


def _files(folder: Path, *, but: Path) -> set[Path]:
    """All files but those of the lab's own folder, and its log."""
    return {each for each in folder.rglob("*") if but not in (each, *each.parents) and each.name != "lab.log"}
