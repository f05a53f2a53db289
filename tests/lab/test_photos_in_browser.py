"""A photograph of a sheet proposes cells, which are looked at, corrected and entered; in a real browser."""

from __future__ import annotations

import hashlib
from http.client import HTTPConnection
from urllib.parse import urlsplit

import pytest

from realitygap.records import LEDGER_NAME, Ledger

from .conftest import OUTAGE, PHONE, open_fold
from .robot_study import ledger_of, tap
from .sheets import drive_sheet, photo_of, true_cells

pytestmark = pytest.mark.slow

PAGE = "study/by-robot/trials"


def send(page, data: bytes, name: str = "sheet.jpg") -> None:
    file = {"name": name, "mimeType": "image/jpeg", "buffer": data}
    page.get_by_label("Choose a photo").set_input_files(file)


def name_oneself(page, who: str) -> None:
    page.get_by_label("Your name").fill(who)
    page.get_by_text("To score: ").wait_for()
    page.wait_for_function("() => document.cookie.includes('realitygap_who')")


def photo_events(root) -> list[dict]:
    with Ledger.open(root / "by-robot" / LEDGER_NAME) as ledger:
        return [event["details"] for event in ledger.events() if event["what"] == "scored"]


def agreement(one, other) -> float:
    return len(set(one) & set(other)) / len(set(one) | set(other))


def test_a_photo_proposes_cells_that_are_corrected_by_tapping_and_entered(lab, visit):
    lines = drive_sheet(lab.root)
    photo = photo_of(lines)
    page = visit(PAGE, size=PHONE, has_touch=True)
    name_oneself(page, "anna")
    send(page, photo)
    page.get_by_text("You can leave this page.").wait_for()
    page.reload()  # in the middle
    page.locator('[data-photo="read"]').wait_for()
    card = page.locator('[data-counting="1"]')
    card.get_by_text("The photo sheet.jpg").wait_for()
    assert card.locator("image").get_attribute("href").startswith("/photos/by-robot/")
    n_proposed = card.locator(".lab-marked").count()
    assert agreement(true_cells(lines[0]), marked(card)) > 0.9
    wrong = next(cell for cell in range(60, 72) if cell not in marked(card))
    tap(page, wrong)
    card.get_by_text(f"{n_proposed + 1} of 72 cells").wait_for()
    card.get_by_role("button", name="Save score").click()
    page.locator('[data-counting="2"]').get_by_role("button", name="Save score").click()
    page.get_by_text("All trials of this sheet are scored.").wait_for()
    with ledger_of(lab.root) as ledger:
        first, second = list(ledger.trials())[:2]
    assert wrong in first.cells
    assert agreement(second.cells, true_cells(lines[1])) > 0.9
    one, other = photo_events(lab.root)
    assert one["who"] == other["who"] == "anna"
    assert one["photo"]["sha256"] == other["photo"]["sha256"] == hashlib.sha256(photo).hexdigest()
    assert one["photo"]["file"] == "sheet.jpg"
    assert set(first.cells) - set(one["photo"]["proposed"]) == {wrong}
    assert tuple(other["photo"]["proposed"]) == second.cells
    assert one["photo"]["is_confirmed"] is True


def marked(card) -> list[int]:
    return [int(each.get_attribute("data-cell")) for each in card.locator(".lab-marked").all()]


def test_a_photo_is_read_on_when_the_lab_was_killed_and_all_are_entered_at_once(lab, visit):
    lines = drive_sheet(lab.root)
    page = visit(PAGE, forgive=OUTAGE)
    name_oneself(page, "anna")
    send(page, photo_of(lines))
    page.get_by_text("You can leave this page.").wait_for()
    lab.kill()
    lab.start()
    page = visit(PAGE)
    name_oneself(page, "ben")
    page.get_by_role("button", name="Save 2 trials").click()
    page.get_by_text("2 trials saved.").wait_for()
    with ledger_of(lab.root) as ledger:
        found = list(ledger.trials())
    for trial, line in zip(found, lines, strict=True):
        assert agreement(trial.cells, true_cells(line)) > 0.9
    assert [event["who"] for event in photo_events(lab.root)] == ["ben", "ben"]


def test_a_file_that_is_no_photo_of_the_sheet_gets_one_message_and_changes_nothing(lab, visit):
    drive_sheet(lab.root)
    page = visit(PAGE)
    send(page, b"no picture at all", "notes.jpg")
    page.get_by_text("The file is no picture that can be read: expected JPEG, PNG, TIFF or WebP.").wait_for()
    page.get_by_role("button", name="Remove photo").click()
    page.locator("[data-photo]").wait_for(state="detached")
    assert list((lab.root / "by-robot" / "lab" / "photos").iterdir()) == []
    large = HTTPConnection(urlsplit(lab.address).netloc)
    large.putrequest("POST", "/photos/by-robot?sheet=1")
    large.putheader("Cookie", f"{lab.cookie['name']}={lab.token}")
    large.putheader("Content-Length", str(33 << 20))  # refused before any of it is sent
    large.endheaders()
    answer = large.getresponse()
    assert (answer.status, answer.read()) == (413, b"Too large: expected at most 32 MB.")
    large.close()
    answer = page.request.post(lab.address + "photos/by-robot?sheet=one", data=b"x")
    assert (answer.status, answer.text()) == (400, "Which sheet does the photo show? Expected its number.")
    with ledger_of(lab.root) as ledger:
        assert {trial.state for trial in ledger.trials()} == {"driven"}


def test_a_second_count_does_not_begin_with_the_photo_by_itself(lab, visit):
    lines = drive_sheet(lab.root)
    page = visit(PAGE)
    name_oneself(page, "anna")
    send(page, photo_of(lines))
    page.get_by_role("button", name="Save 2 trials").click()
    page.get_by_text("2 trials saved.").wait_for()
    other = visit(PAGE)
    other.get_by_label("Your name").fill("ben")
    open_fold(other, "Score")
    other.get_by_role("button", name="Trial 1", exact=True).last.click()
    other.get_by_text("You do not see the first one.").wait_for()
    assert other.locator("[data-counting] .lab-marked").count() == 0
    other.get_by_role("button", name="Use its cells (photo)").click()
    other.locator("[data-counting] .lab-marked").first.wait_for()
