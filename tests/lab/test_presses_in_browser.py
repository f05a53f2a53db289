"""A control that is drawn again while it is pressed, or before the lab handles the press, still does what it says.

The page of the class shows this: its buttons are drawn again when a student joins.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from .conftest import DESKTOP, PATIENCE_MS, PHONE, RunningLab, expect

pytestmark = pytest.mark.slow

HEAR = """() => socket.io.engine.on("message", (text) => { window.isDrawn ||= text.includes("2 students joined"); })"""
HOLD = """() => {
  window.sent = [];
  const emit = socket.emit.bind(socket);
  socket.emit = (kind, ...more) => (kind === "event" ? window.sent.push([kind, ...more]) : emit(kind, ...more));
  window.deliver = () => window.sent.splice(0).forEach((message) => emit(...message));
}"""


@pytest.fixture
def lab(tmp_path: Path, lab_port: int) -> Iterator[RunningLab]:
    running = RunningLab(tmp_path / "studies", port=lab_port, has_class=True)
    running.start()
    yield running
    running.stop()
    assert "Traceback" not in running.said


@pytest.fixture
def board(visitors: Any, lab: RunningLab, visit: Callable[..., Any]) -> tuple[Any, Callable[[], None]]:
    """The board, and what has a second student join, which draws its buttons again."""
    allowed = (lab.address, lab.address.replace("http", "ws"), "data:")

    def phone(name: str) -> Any:
        page = visitors.open_page(PHONE, allowed, PATIENCE_MS, cookies=[])
        page.goto(lab.address + "class")
        page.fill("#who", name)
        return page.get_by_role("button", name="Join")

    page = visit("class/board", DESKTOP)
    phone("Ada").click()
    second = phone("Ben")
    page.get_by_text("1 student joined").wait_for()
    return page, second.click


@pytest.mark.parametrize("way", ["mouse", "key"])
def test_button_that_is_drawn_again_between_press_and_release_is_pressed(board, way):
    board, join = board
    start = board.get_by_role("button", name="Start round")
    board.evaluate(HEAR)
    if way == "key":
        start.focus()
        board.keyboard.down("Space")
    else:
        box = start.bounding_box()
        board.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        board.mouse.down()
    join()
    board.wait_for_function("() => window.isDrawn")
    board.keyboard.up("Space") if way == "key" else board.mouse.up()
    expect(board.locator(".class-heading")).to_contain_text("Round 1")
    board.get_by_text("2 students joined").wait_for()


@pytest.mark.parametrize(("way_px", "counts"), [(0, True), (60, False)])
def test_button_that_moves_away_between_press_and_release_is_pressed_unless_the_pointer_moved(
    board, way_px, counts
):
    board, _ = board
    start = board.get_by_role("button", name="Start round")
    start.evaluate("""it => addEventListener("click", ({ target }) => {
      window.clicked = window.clicked || it.contains(target);
    }, true)""")
    box = start.bounding_box()
    board.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    board.mouse.down()
    start.evaluate("it => { it.style.transform = 'translateY(150px)'; }")
    board.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2 + way_px)
    board.mouse.up()
    board.wait_for_function("() => 'clicked' in window")
    assert board.evaluate("() => clicked") is counts


def test_press_of_a_button_that_was_drawn_again_before_it_arrived_counts_once(board):
    board, join = board
    board.evaluate(HOLD)
    for _ in range(2):
        board.get_by_role("button", name="Start round").click()
    assert board.evaluate("() => sent.length") == 2
    join()
    board.get_by_text("2 students joined").wait_for()
    board.evaluate("() => deliver()")
    expect(board.locator(".class-heading")).to_contain_text("Round 1")
    board.get_by_role("button", name="Reset").click()
    board.evaluate("() => deliver()")
    expect(board.locator(".class-heading")).to_have_text("Practice")
    assert board.locator(".q-notification").count() == 0, "the second press was refused as a second round"
