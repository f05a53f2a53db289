"""A class as students and their lecturer see it, in a browser."""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest
from websockets.asyncio.client import connect

from realitygap.lab._access import CLASS_SOCKET, VISITOR
from realitygap.world import paper_arena

from .conftest import DESKTOP, PATIENCE_MS, RunningLab, expect
from .test_screenshots_in_browser import FINE, keep

pytestmark = pytest.mark.slow
PHONE = (390, 800)
NAME = "<b>Ada</b>"


@pytest.fixture
def lab(tmp_path: Path, lab_port: int) -> Iterator[RunningLab]:
    running = RunningLab(tmp_path / "studies", port=lab_port, has_class=True)
    running.start()
    yield running
    running.stop()
    assert "Traceback" not in running.said


@pytest.fixture
def student(visitors: Any, lab: RunningLab) -> Iterator[Any]:
    """A phone without the token at the page of the class."""
    allowed = (lab.address, lab.address.replace("http", "ws"), "data:")
    page = visitors.open_page(PHONE, allowed, PATIENCE_MS, cookies=[])
    page.goto(lab.address + "class")
    yield page
    visitors.leave(lab.address.rstrip("/"))


def test_student_joins_drives_a_round_and_is_on_the_board(lab, student, visit):
    board = visit("class/board", DESKTOP)
    student.fill("#who", "  ")
    student.get_by_role("button", name="Join").click()
    expect(student.get_by_role("alert")).to_have_text("Enter a name, then press Join.")
    student.fill("#who", "n" * 31)  # as a paste; nothing is cut without notice
    student.get_by_role("button", name="Join").click()
    expect(student.get_by_role("alert")).to_have_text("At most 20 letters. You entered 31.")
    student.fill("#who", NAME)
    student.get_by_role("button", name="Join").click()
    expect(student.locator("#name")).to_have_text(NAME)
    expect(board.get_by_role("status").filter(has_text="1 student joined")).to_be_visible()
    board.get_by_role("button", name="Start round").click()
    expect(student.locator("#words")).to_have_text("Cover as many cells as you can.")
    student.locator("#pad").focus()
    student.keyboard.down("ArrowUp")
    student.wait_for_function("() => Number(document.getElementById('cells').textContent) >= 5")
    student.keyboard.up("ArrowUp")
    row = board.locator(".class-rows li")
    expect(row.locator("span").nth(1)).to_have_text(NAME)  # as text, not as markup
    expect(row).to_contain_text("EMULATED")
    expect(row.locator("b")).to_have_text(student.locator("#cells").inner_text())
    board.get_by_role("button", name="Reset").click()
    expect(student.locator("#words")).to_have_text("Practice. The lecturer starts the round.")
    board.get_by_text("Remove a name").click()
    board.get_by_role("button", name=NAME).click()
    expect(student.get_by_role("button", name="Join")).to_be_visible()


def test_driving_fits_the_screen_of_a_phone(student):
    student.fill("#who", "Ada")
    student.get_by_role("button", name="Join").click()
    expect(student.locator("#pad")).to_be_visible()
    assert student.evaluate("() => document.documentElement.scrollHeight") <= PHONE[1]
    assert student.evaluate("() => document.documentElement.scrollWidth") <= PHONE[0]
    for part in ("#clock", "#cells", ".rg-field", "#pad", "#stop"):
        box = student.locator(part).bounding_box()
        assert box["y"] >= 0
        assert box["y"] + box["height"] <= PHONE[1], part


def test_name_that_is_entered_without_a_link_joins_when_the_link_is_back(student):
    is_away = [True]
    student.route_web_socket(
        "**" + CLASS_SOCKET, lambda route: route.close() if is_away[0] else route.connect_to_server()
    )
    student.reload()
    student.locator(".class-offline").wait_for()
    student.fill("#who", "Ada")
    student.get_by_role("button", name="Join").click()
    is_away[0] = False
    expect(student.locator("#name")).to_have_text("Ada")


def test_phone_that_loads_its_page_again_keeps_its_name(student):
    student.fill("#who", "Ada")
    student.get_by_role("button", name="Join").click()
    expect(student.locator("#name")).to_have_text("Ada")
    student.reload()
    expect(student.locator("#name")).to_have_text("Ada")


def test_student_reaches_no_other_page(lab, student):
    for path in ("", "class/board", "robot", "new"):
        with pytest.raises(HTTPError, match="403"):
            urlopen(lab.address + path)


DRIVERS = {"Ada": 8, "Ben": 4, "Chen": 7, "Dora": 6, "Emil": 3}
"""Students who drive row by row, and the number of ends of rows that they reach."""


async def drive_rows(address: str, name: str, n_goals: int) -> None:
    """Join, and drive a round row by row."""
    grid = paper_arena().grid
    ends = [grid.x + 1.5 * grid.cell, grid.x + (grid.columns - 1.5) * grid.cell]
    rows = [grid.y + (row + 0.5) * grid.cell for row in (1, 2, 3, 4)]
    goals = [(x, y) for k, y in enumerate(rows) for x in (ends if k % 2 == 0 else ends[::-1])]
    async with connect(address, additional_headers={"Cookie": f"{VISITOR}={name}"}) as socket:
        await socket.send(json.dumps({"kind": "join", "name": name}))
        goal, phase, n = 0, "", 0
        async for text in socket:
            news = json.loads(text)
            if (phase := news.get("phase", phase)) == "over":
                break
            if news["kind"] != "now" or phase != "round":
                continue
            x, y, heading = news["pose"]
            while goal < n_goals and math.dist((x, y), goals[goal]) < 0.05:
                goal += 1
            if goal == n_goals:
                continue
            off = math.remainder(math.atan2(goals[goal][1] - y, goals[goal][0] - x) - heading, math.tau)
            n += 1
            pull = {"move": 1.0 if abs(off) < 0.5 else 0.0, "turn": max(-0.5, min(0.5, off)), "n": n}
            await socket.send(json.dumps({"kind": "drive", **pull}))


@pytest.mark.long
def test_pictures_of_a_class_and_its_comparison_with_evolution(lab, visit, visitors):
    """A whole round, until each phone shows its own path next to that of evolution."""
    allowed = (lab.address, lab.address.replace("http", "ws"), "data:")
    phone = visitors.open_page(PHONE, allowed, PATIENCE_MS, cookies=[], has_touch=True, **FINE)
    phone.goto(lab.address + "class")
    phone.fill("#who", "Fay")
    phone.get_by_role("button", name="Join").click()
    board = visit("class/board", size=(1000, 640))
    address = lab.address.replace("http", "ws").rstrip("/") + CLASS_SOCKET

    async def drive_all() -> None:
        await asyncio.gather(*(drive_rows(address, *driver) for driver in DRIVERS.items()))

    with ThreadPoolExecutor(1) as pool:
        driving = pool.submit(asyncio.run, drive_all())
        board.get_by_text("6 students joined").wait_for()
        board.get_by_role("button", name="Start round").click()
        for key, seconds in (
            ("ArrowUp", 5),
            ("ArrowLeft", 2.5),
            ("ArrowUp", 2),
            ("ArrowLeft", 2.5),
            ("ArrowUp", 3),
        ):
            phone.locator("#pad").press(key, delay=1000 * seconds)
        phone.locator("#pad").focus()
        phone.keyboard.down("ArrowUp")
        keep(phone, "class-phone")
        phone.keyboard.up("ArrowUp")
        expect(phone.locator("#words")).to_have_text("Time is up.")
        board.get_by_role("button", name="Show evolution").click()
        expect(phone.locator("#words")).to_contain_text("Evolution (SIM)")
        phone.locator(".rg-sim").wait_for()
        board.locator(".lab-label-sim").wait_for()
        keep(board, "class-board")
        driving.result()
