"""A small study on a robot, and what people do at its page."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path
from typing import Any

from realitygap.records import LEDGER_NAME, Ledger, ResultsFolder
from realitygap.study import parse_study

from .conftest import enter, playwright

CONNECT = re.compile("Connect robot|Reconnect")
FAST = "emulator://s2?fluke=2&speed=off"
SLOW = "emulator://s2?fluke=2&speed=1"

TEXT = """
[study]
name = "by-robot"
replicates = 1

[neat]
population = 2
generations = 2

[trials]
blind = {blind}
pens = ["red", "blue"]

[platform.scribbler]
steps = {steps}
wait_s = 0.5

[[condition]]
name = "coverage-robot"
platform = "scribbler"
"""


def make_study(root: Path, *, steps: int = 12, blind: bool = True) -> Path:
    """The folder of a study of which no trial is driven."""
    study = parse_study(TEXT.format(steps=steps, blind=str(blind).lower()), "study.toml")
    return ResultsFolder.create(root / "by-robot", study.description()).path


def begin_sitting(page: Any, port: str = FAST, who: str = "anna") -> None:
    name = page.get_by_label("Your name")
    if name.input_value() != who:  # then it is not shown any more
        name.fill(who)
    enter(page, "Port", port)
    page.get_by_role("button", name=CONNECT).click()


def pass_preflight(page: Any, question: Any) -> None:
    """Wait for a question; on a busy machine, the pre-flight check may find the link too slow before."""
    slow = page.locator(".lab-question", has_text="the link is too slow")
    anyway = slow.get_by_role("button", name="Drive anyway")
    for _ in range(20):
        question.or_(anyway).first.wait_for()
        if question.is_visible():
            return
        with contextlib.suppress(
            playwright.TimeoutError
        ):  # an answered question is shown until the lab has heard of the answer
            anyway.click(timeout=5000)
    question.wait_for()


def await_trial(page: Any, number: int) -> None:
    """Wait until a trial can be started."""
    pass_preflight(page, page.locator(f'.lab-question [data-trial="{number}"]'))


def start_trial(page: Any, number: int) -> None:
    await_trial(page, number)
    page.get_by_role("button", name="Start trial").click()


def tap(page: Any, *cells: int) -> None:
    """Tap cells of the grid that is being counted, one by one."""
    for cell in cells:
        page.locator(f'[data-counting] [data-cell="{cell}"]').click()


def count(page: Any, number: int, *cells: int) -> None:
    card = page.locator(f'[data-counting="{number}"]')
    card.wait_for()
    tap(page, *cells)
    card.get_by_text(f"{len(cells)} of 72 cells").wait_for()
    card.get_by_role("button", name="Save score").click()
    card.wait_for(state="detached")


def ledger_of(root: Path) -> Ledger:
    return Ledger.open(root / "by-robot" / LEDGER_NAME, writable=False)
