"""A class as students and their lecturer see it, in a browser."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest

from .conftest import DESKTOP, PATIENCE_MS, RunningLab, expect

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
