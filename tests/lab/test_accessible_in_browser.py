"""Every page of the lab, on a desktop and a phone: axe-core finds no fault, and nothing is cut off."""

from __future__ import annotations

import pytest
from axe_playwright_python.sync_playwright import Axe

from realitygap.study import parse_study, run_study

from .conftest import DESKTOP, PHONE, open_advanced, open_fold
from .robot_study import begin_sitting, make_study
from .sheets import drive_sheet, photo_of

pytestmark = pytest.mark.slow

CUT = """() => [...document.querySelectorAll("body *")].filter((it) => it.checkVisibility() && it.textContent.trim()
  && it.scrollWidth > it.clientWidth + 1 && getComputedStyle(it).textOverflow === "ellipsis")
  .map((it) => it.textContent)"""
"""Texts that end in an ellipsis because their place is too narrow."""

SIZES = {"desktop": DESKTOP, "tablet": (768, 1024), "twice as large": (720, 450), "phone": PHONE}
AXE = ("desktop", "phone")
"""Sizes at which axe-core runs, which takes seconds."""

CONTROLS = """() => [...document.querySelectorAll(
  "a[href], button, input, textarea, select, [tabindex='0']")].filter((it) => it.checkVisibility() && !it.disabled
  && it.tabIndex >= 0 && it.getAttribute("aria-disabled") !== "true" && it.type !== "file").length"""
FOCUSED = """() => {
  const it = document.activeElement, style = getComputedStyle(it);
  if (it === document.body || it.dataset.reached) return "all";
  it.dataset.reached = "yes";
  const border = it.closest(".q-field") && getComputedStyle(it.closest(".q-field__control"), "::after").borderTopWidth;
  return style.outlineStyle !== "none" || border === "2px" ? "seen" : it.outerHTML.slice(0, 200);
}"""
"""Whether the control with the focus shows it; all once every one has had it."""

TEXT = """
[study]
name = "seen"
replicates = 3

[[condition]]
name = "novelty-10"
selection = "novelty"
"""


@pytest.fixture
def look(visit):
    """Opens a page: look("robot")."""
    return lambda path: visit(path, bypass_csp=True)


def faults(page) -> list[str]:
    """Return what axe-core finds, texts that are cut, and where the page is wider than the screen.

    The page has the size of a phone from then on.
    """
    found = []
    for size, (width, height) in SIZES.items():
        page.set_viewport_size({"width": width, "height": height})
        page.wait_for_timeout(300)  # until nothing fades in any more
        violations = Axe().run(page).response["violations"] if size in AXE else []
        found += [
            f"{size}: {fault['impact']}: {fault['id']}: {[node['target'] for node in fault['nodes']][:3]}"
            for fault in violations
        ]
        over = page.evaluate("() => document.documentElement.scrollWidth - window.innerWidth")
        found += [f"{size}: {over} px wider than the screen"] if over > 0 else []
        found += [f"{size}: cut: {text}" for text in page.evaluate(CUT)]
    return found


def check_keyboard(page) -> None:
    """Tab reaches each control, and the focus is visible there."""
    page.set_viewport_size({"width": DESKTOP[0], "height": DESKTOP[1]})
    page.evaluate("document.activeElement.blur()")
    n, reached = page.evaluate(CONTROLS), 0
    for _ in range(n + 5):
        page.keyboard.press("Tab")
        page.wait_for_timeout(60)  # until the border has its width
        found = page.evaluate(FOCUSED)
        if found == "all":
            break
        assert found == "seen"
        reached += 1
    assert reached >= n


def test_pages_without_a_study(lab, look):
    for path, text in (
        ("", "No studies yet."),
        ("new", "Start study"),
        ("calibrate", "No calibrations yet."),
        ("gap", "Measure"),
        ("robot", "No robot connected."),
    ):
        page = look(path)
        page.get_by_text(text).first.wait_for()
        assert faults(page) == [], path
        check_keyboard(page)


def test_a_study_that_is_watched_and_played(lab, look):
    run_study(parse_study(TEXT, "study.toml"), lab.root / "seen")
    page = look("study/seen")
    page.locator(".lab-figure img").nth(4).wait_for()
    page.get_by_role("tab", name="Replay").click()
    page.locator(".lab-replay").locator(".rg-player").wait_for()
    assert faults(page) == []
    home = look("")
    home.locator('[data-study="seen"]').wait_for()
    assert faults(home) == []


def test_trials_that_are_counted_from_a_photo(lab, look):
    lines = drive_sheet(lab.root)
    page = look("study/by-robot/trials")
    page.get_by_label("Your name").fill("anna")
    photo = {"name": "sheet.jpg", "mimeType": "image/jpeg", "buffer": photo_of(lines)}
    page.get_by_label("Choose a photo").set_input_files(photo)
    page.get_by_text("You can leave this page.").wait_for()
    assert faults(page) == []
    page.locator("[data-counting] image").wait_for()
    page.get_by_text("Score from a video").click()
    page.get_by_label("Tags").wait_for()
    assert faults(page) == []


def test_a_robot_in_a_sitting_and_in_the_hand(lab, look):
    make_study(lab.root)
    page = look("study/by-robot/trials")
    begin_sitting(page)
    page.get_by_role("button", name="Start trial").wait_for()
    assert faults(page) == []
    open_fold(page, "Robot")
    page.get_by_role("button", name="Disconnect").click()
    page.get_by_role("button", name="Connect robot").wait_for()
    robot = look("robot")
    robot.get_by_role("button", name="Use an emulated robot").click()
    robot.get_by_text("Battery").wait_for()
    assert faults(robot) == []


def test_a_calibration_whose_plot_grows(lab, look):
    page = look("calibrate")
    page.get_by_role("button", name="Next").click()
    open_advanced(page, page.get_by_label("Number of trials"))
    page.get_by_label("Number of trials").fill("4")
    page.get_by_role("button", name="Calibrate", exact=True).click()
    page.locator(".lab-plot").wait_for()
    assert faults(page) == []
