"""Nothing that a page does blocks the event loop, by which all pages and the stop are answered."""

from __future__ import annotations

import asyncio
import sqlite3
from contextlib import closing

import pytest

from realitygap.records import LEDGER_NAME

from .conftest import open_fold
from .robot_study import make_study
from .test_counts import begin, plan
from .test_fuzz import carried_out, page_client
from .test_studies_in_browser import TINY, start

pytestmark = pytest.mark.slow

LATE_S = 2.0
"""A loop that something blocks is late by many seconds; one on a busy machine, by less than this [s]."""


def test_check_that_does_not_end_blocks_no_page(lab, visit):
    make_study(lab.root)
    lab.make_checks_endless()
    page, other = visit("new"), visit("new")
    start(page, TINY.replace("tiny", "endless"))
    page.get_by_role("button", name="Cancel").wait_for()
    for path in ("new", "study/by-robot/trials"):
        lab.lag()
        other.goto(lab.address + path)
        assert other.request.post(f"{lab.address}stop").text() == "no robot"
        assert lab.lag() < LATE_S, path
    page.get_by_role("button", name="Cancel").click()
    page.get_by_text("The check was canceled.").wait_for()
    assert not (lab.root / "endless").exists()


def test_ledger_that_another_program_writes_blocks_no_page(lab, visit):
    folder = make_study(lab.root)
    with begin(folder) as ledger:
        plan(ledger)
    page, other = visit("study/by-robot/trials"), visit("gap")
    page.get_by_label("Your name").fill("anna")
    open_fold(page, "Notes")
    page.get_by_label("Note on the study").fill("it rains")
    with closing(sqlite3.connect(folder / LEDGER_NAME, isolation_level=None)) as writer:
        writer.execute("BEGIN IMMEDIATE")
        lab.lag()
        page.get_by_label("Note on the study").press("Enter")
        other.wait_for_timeout(3000)
        assert other.request.post(f"{lab.address}stop").text() == "no robot"
        assert lab.lag() < LATE_S
        writer.execute("COMMIT")
    page.get_by_text("Note saved.").wait_for()


def test_folder_of_many_studies_and_long_ledgers_blocks_no_page(lab):
    study = make_study(lab.root)
    text = (study / "study.json").read_text("utf-8")
    for number in range(200):
        folder = lab.root / f"study-{number}"
        folder.mkdir()
        (folder / "study.json").write_text(text, "utf-8")
        (lab.root / f"file-{number}.toml").write_text("")

    async def look() -> None:
        client = page_client()
        async with (
            client(lab.entry()),
            client(lab.entry("study/by-robot/trials")),
            client(lab.entry("study/study-1")),
        ):
            await asyncio.sleep(5.0)

    lab.lag()
    carried_out(look())
    assert lab.lag() < LATE_S
