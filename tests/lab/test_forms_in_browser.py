"""Every form of the lab shows all mistakes together, each at its field; in a real browser."""

from __future__ import annotations

import pytest

from realitygap.study import parse_study, run_study

from .conftest import enter, expect, open_advanced, open_fold
from .robot_study import make_study
from .sheets import drive_paths
from .test_live_in_browser import TEXT

pytestmark = pytest.mark.slow

OUTSIDE = "would be a file outside the lab's folder"
FORMS = {
    "gap": (
        "Measure the gap",
        {
            "Simulator": ("jyrro", "Did you mean"),
            "Target": ("twin:/etc/passwd", OUTSIDE),
            "Controllers": ("1", "from 2 to 1024"),
            "Name": ("a b", "You entered 'a b'."),
            "Controllers from": ("../other", OUTSIDE),
        },
    ),
    "calibrate": (
        "Next",
        {"Robot": ("simm", "Did you mean"), "Name": ("a/b", "You entered 'a/b'.")},
    ),
    "new": (
        "Check",
        {
            "Name": ("seen", "There is a folder 'seen' already."),
            "Runs per condition": ("many", "Enter a whole number."),
            "Platform": ("sim:../fit.toml", OUTSIDE),
            "Noise": ("-1", "You entered -1"),
        },
    ),
    "study/seen": (
        "Drive live",
        {
            "Run": ("44", "from 0 to 2."),
            "Generation": ("-4", "from 0 to 4."),
            "Platform": ("twin:/etc/passwd", OUTSIDE),
        },
    ),
    "study/by-robot/trials": (
        "Connect robot",
        {"Port": ("/etc/passwd", "is no port that the lab opens"), "Camera": ("0?lens=/etc/passwd", OUTSIDE)},
    ),
}
"""Path of each page with a form of several fields: the button, and for each field what is entered and what is said."""


def test_all_mistakes_are_shown_at_once_and_each_at_its_field(lab, visit):
    run_study(parse_study(TEXT, "study.toml"), lab.root / "seen")
    make_study(lab.root)
    for path, (button, fields) in FORMS.items():
        page = visit(path)
        if path == "study/seen":
            page.get_by_role("tab", name="Replay").click()
        open_advanced(page, page.get_by_label(list(fields)[-1], exact=True).first)
        for label, (text, _) in fields.items():
            enter(page, label, text)
        page.get_by_role("button", name=button, exact=True).click()
        for label, (_, message) in fields.items():
            field = page.locator(".lab-field", has=page.get_by_label(label, exact=True)).first
            expect(field.locator(".lab-problem"), f"{path}: {label}").to_contain_text(message)
        expect(page.locator(".lab-summary:visible a"), path).to_have_count(len(fields))
        focused = page.locator("[aria-invalid=true]:focus")
        expect(focused, path).to_have_count(1)
        assert focused.evaluate("it => it === document.querySelector('[aria-invalid=true]')"), path
        page.close()


def test_no_message_moves_a_button_while_it_is_pressed(visit):
    page = visit("gap")
    enter(page, "Simulator", "jyrro")
    button = page.get_by_role("button", name="Measure the gap", exact=True)
    button.scroll_into_view_if_needed()
    box = button.bounding_box()
    page.evaluate(
        """() => {
          window.sent = [];
          const emit = socket.emit;
          socket.emit = (...message) => (sent.push(message), emit.apply(socket, message));
        }"""
    )
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    assert page.evaluate("() => document.activeElement.tagName") != "INPUT", "the field has lost the focus"
    assert page.evaluate("() => sent.filter(([kind]) => kind === 'event').length") == 0, "the check waits"
    page.mouse.up()
    expect(page.locator(".lab-summary:visible a")).to_have_count(1)


def test_a_video_and_its_tags_are_refused_together(lab, visit):
    drive_paths(lab.root, steps=12)
    page = visit("study/by-robot/trials")
    open_fold(page, "Score from photo or video")
    page.get_by_text("Score from a video").click()
    enter(page, "Video", "none.mp4")
    page.get_by_label("Tags", exact=True).fill("lens=/etc/passwd")
    mistakes = page.locator(".lab-summary:visible a")
    page.get_by_role("button", name="Track video").click()
    expect(mistakes).to_have_count(2)
    for label, message in {"Video": "There is no video 'none.mp4'", "Tags": OUTSIDE}.items():
        field = page.locator(".lab-field", has=page.get_by_label(label, exact=True))
        expect(field.locator(".lab-problem")).to_contain_text(message)
