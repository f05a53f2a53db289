"""The scenes of which the documents show pictures; written where REALITYGAP_SCREENSHOTS names a folder.

What the scenes do is tested daily by the other tests of their pages, so that taking the pictures is not.
"""

from __future__ import annotations

import io
import os
import re
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from realitygap.study import parse_study, run_study

from .conftest import PHONE
from .robot_study import await_trial, begin_sitting, make_study, start_trial
from .sheets import drive_sheet, photo_of

ROOT = Path(__file__).parents[2]
PAGES = [
    "docs/how-to/lab.md",
    "docs/tutorials/double-lesson.md",
    "docs/tutorials/lesson.md",
    "docs/tutorials/robot-lab.md",
]
MOST_BYTES = 200_000
WIDE, TALL = (1000, 760), (1000, 1000)
FINE = {"device_scale_factor": 2}

STUDY = """
[study]
name = "first-look"
title = "Coverage and novelty, a first look"
replicates = 40

[[condition]]
name = "coverage-10"

[[condition]]
name = "novelty-10"
selection = "novelty"
"""


def keep(page: Any, name: str, **options: Any) -> None:
    """Take the picture; write it where somebody asked for it."""
    page.mouse.move(2, 200)  # away from buttons, which are paler below it
    page.wait_for_timeout(700)  # until nothing fades in any more
    picture = Image.open(io.BytesIO(page.screenshot(**options))).convert("RGB")
    file = io.BytesIO()
    picture.save(file, "WEBP", quality=80, method=6)
    assert len(file.getvalue()) < MOST_BYTES, f"{name}: {len(file.getvalue())} bytes"
    assert len(picture.getcolors(1 << 24) or ()) > 50, "an empty page"
    folder = os.environ.get("REALITYGAP_SCREENSHOTS")
    if folder:
        (Path(folder) / f"{name}.webp").write_bytes(file.getvalue())


@pytest.mark.long
def test_studies_and_one_that_is_watched(lab, visit):
    run_study(parse_study(STUDY, "study.toml"), lab.root / "first-look")
    make_study(lab.root)
    page = visit("study/first-look", size=WIDE)
    page.locator(".lab-figure img").nth(4).wait_for()
    page.wait_for_function(
        "() => [...document.querySelectorAll('.lab-figure img')].every((it) => it.naturalWidth)"
    )
    keep(page, "watch")
    page.get_by_role("tab", name="Replay").click()
    replay = page.locator(".lab-replay")
    player = replay.locator(".rg-player")
    player.wait_for()
    for number in (2, 3):
        replay.get_by_label("Run", exact=True).fill(str(number))
        replay.get_by_role("button", name="Compare").click()
        player.locator(".rg-names > *").nth(number - 1).wait_for()
    player.get_by_role("slider", name="Step").fill("40")
    rays = player.locator(".rg-ray:visible")
    assert rays.count() >= 3
    player.scroll_into_view_if_needed()
    keep(page, "replay", clip=_around(player))
    page = visit("", size=WIDE)
    page.locator('[data-study="by-robot"]').wait_for()
    picture = page.locator('[data-study="first-look"] .lab-thumbnail img')
    page.wait_for_function("image => image.naturalWidth", arg=picture.element_handle())
    keep(page, "studies")


@pytest.mark.long
def test_screenshots_show_a_robot_driven_by_hand(lab, visit):
    page = visit("robot", size=PHONE, has_touch=True, **FINE)
    page.get_by_role("button", name="Use an emulated robot", exact=True).click()
    page.get_by_text("Battery").wait_for()
    page.locator(".lab-pad").press("ArrowUp", delay=3000)
    page.locator(".lab-pad").blur()
    keep(page, "robot")


@pytest.mark.long
def test_screenshots_show_a_sitting_on_a_phone(lab, visit):
    make_study(lab.root, steps=60)
    page = visit("study/by-robot/trials", size=PHONE, has_touch=True, **FINE)
    begin_sitting(page, "emulator://s2?fluke=2&speed=1")
    await_trial(page, 1)
    page.get_by_role("button", name="Start trial").scroll_into_view_if_needed()
    page.locator(".lab-question").evaluate("it => it.scrollIntoView({block: 'center'})")
    keep(page, "place")
    start_trial(page, 1)
    page.get_by_text(re.compile(r"Step 1\d of 60")).wait_for()
    page.locator(".lab-question").evaluate("it => it.scrollIntoView({block: 'center'})")
    keep(page, "trial")


@pytest.mark.long
def test_screenshots_show_a_sheet_counted_from_its_photo(lab, visit):
    lines = drive_sheet(lab.root)
    page = visit("study/by-robot/trials", size=TALL)
    page.get_by_label("Your name").fill("anna")
    photo = {"name": "sheet.jpg", "mimeType": "image/jpeg", "buffer": photo_of(lines)}
    page.get_by_label("Choose a photo").set_input_files(photo)
    page.locator("[data-counting] image").wait_for()
    card = page.locator("[data-counting]")
    card.evaluate("it => it.scrollIntoView({block: 'start'})")
    page.evaluate("() => window.scrollBy(0, -100)")
    keep(page, "photo")


@pytest.mark.parametrize("path", PAGES)
def test_pictures_that_pages_show_are_there_and_small(path):
    shown = re.findall(r"[(\s](\.\./images/lab/\S+?\.webp)", (ROOT / path).read_text("utf-8"))
    for each in shown:
        file = (ROOT / path).parent / each
        assert file.is_file(), each
        assert file.stat().st_size < MOST_BYTES
    assert shown or "lab.md" not in path


def _around(element: Any) -> dict[str, float]:
    box = element.bounding_box()
    return {"x": box["x"] - 8, "y": box["y"] - 8, "width": box["width"] + 16, "height": box["height"] + 16}
