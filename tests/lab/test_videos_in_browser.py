"""A video of a sitting is tracked at the page; in a real browser."""

from __future__ import annotations

import pytest

from .conftest import open_advanced, open_fold
from .robot_study import await_trial, begin_sitting, ledger_of, make_study, tap
from .sheets import drive_paths, film_of, true_cells

pytestmark = pytest.mark.slow

PAGE = "study/by-robot/trials"


def test_a_trial_is_found_in_a_video_and_its_cells_are_corrected_and_entered(lab, visit):
    paths = drive_paths(lab.root, steps=12)
    number = max(paths, key=lambda each: len(true_cells(paths[each][:, :2])))
    film_of(lab.root, number, paths[number], lab.root / "film.mp4")
    page = visit(PAGE)
    page.get_by_label("Your name").fill("anna")
    open_fold(page, "Score from photo or video")
    page.get_by_text("Score from a video").click()
    page.get_by_role("button", name="Track video").click()
    page.get_by_text(f"Found in the video: trials {number}.").wait_for()
    page.get_by_role("button", name=f"Check trial {number}").click()
    card = page.locator(f'[data-counting="{number}"]')
    card.get_by_text("The track of film.mp4").wait_for()
    n_seen = card.locator(".lab-marked").count()
    tap(page, 71)
    card.get_by_text(f"{n_seen + 1} of 72 cells").wait_for()
    card.get_by_role("button", name="Save score").click()
    card.wait_for(state="detached")
    with ledger_of(lab.root) as ledger:
        (row,), (note,) = list(ledger.scores()), list(ledger.notes(number))
    assert row["who"] == "anna"
    assert set(row["cells"]) ^ true_cells(paths[number][:, :2]) == {71}
    assert len(row["path"]) == len(paths[number])
    assert note["text"].startswith("Cells and path by camera: video film.mp4, sha256 ")


@pytest.mark.parametrize(
    ("camera", "said"),
    [
        ("63", "There is no camera 63, or another program has it."),
        ("0?lens=/etc/passwd", "would be a file outside"),
    ],
)
def test_a_camera_that_cannot_be_is_told_and_a_sitting_begins_without(lab, visit, camera, said):
    make_study(lab.root)
    page = visit(PAGE)
    field = page.get_by_label("Camera", exact=True)
    open_advanced(page, field)
    field.fill(camera)
    begin_sitting(page)
    page.locator(".lab-problem", has_text=said).wait_for()
    if field.is_visible():
        field.fill("")
    begin_sitting(page)
    await_trial(page, 1)
