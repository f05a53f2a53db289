"""A study from an empty folder to its figures; mistakes in the form; addresses without a page. In a real browser."""

from __future__ import annotations

import json
import re

import pytest

import realitygap

from .conftest import OUTAGE, PHONE, expect
from .test_hand import wait_for

pytestmark = pytest.mark.slow

RECORD = """() => {
  const seen = JSON.parse(sessionStorage.seen || "[]");
  setInterval(() => {
    const words = [...document.querySelectorAll(".lab-state")].map((it) => it.textContent);
    const now = JSON.stringify([words, document.body.innerText.match(/[\\d,]+\\/[\\d,]+ runs/)?.[0] || "",
      /No runs yet|Drawing figures/.exec(document.body.innerText)?.[0] || ""]);
    if (seen.at(-1) !== now) sessionStorage.seen = JSON.stringify([...seen, now]), seen.push(now);
  }, 50);
}"""
"""Keep each combination of states, progress, and the text of a study without runs, looked for every 50 ms."""

LAST = "novelty-80"
PENS = "lines => lines.map((line) => line.getAttribute('stroke') + line.getAttribute('stroke-dasharray'))"


def test_papers_study_runs_with_one_click_and_its_figures_grow(lab, visit):
    page = visit(forgive=OUTAGE)
    page.add_init_script(f"addEventListener('DOMContentLoaded', {RECORD})")
    page.get_by_text("No studies yet.").wait_for()
    page.get_by_role("button", name="Run the paper's study").click()
    page.wait_for_url("**/study/paper")
    page.locator(".lab-state", has_text="Complete").wait_for()
    page.locator(".lab-figure img").first.wait_for()
    finding = page.locator(".lab-finding", has_text="best coverage: 0.4")  # of all runs
    expect(finding).to_contain_text(
        re.compile("As recorded, novelty-.0 and novelty-.0 have the highest .* [(]SIM, 100 runs each[)]")
    )
    lines = page.locator(".lab-curves polyline")
    expect(lines).to_have_count(9)
    assert len(set(lines.evaluate_all(PENS))) == 9
    seen = [json.loads(each) for each in json.loads(page.evaluate("sessionStorage.seen"))]
    for words, progress, waiting in seen:
        assert len(words) <= 1, seen
        assert words != ["Complete"] or (progress == "" and waiting != "No runs yet"), seen
    assert [words for words, _, _ in seen if words == ["In use"]] == []
    page.get_by_text(LAST).first.wait_for(state="attached")
    page.locator(".lab-figure img").nth(4).wait_for()
    wait_for(lambda: (lab.root / "paper" / "lab" / "figures.json").is_file())
    lab.stop()
    lab.start()
    again = visit("study/paper", size=PHONE)  # from the folder: no process draws
    again.locator(".lab-figure img").nth(4).wait_for()
    assert str(lab.root) not in again.locator("body").inner_text()


def test_complete_study_never_seems_empty_while_its_figures_are_drawn(lab, visit):
    realitygap.run_study("paper", lab.root / "paper", replicates=20)
    page = visit(size=PHONE, forgive=OUTAGE)
    page.add_init_script(f"addEventListener('DOMContentLoaded', {RECORD})")
    page.goto(lab.address + "study/paper")
    page.locator(".lab-curves polyline").first.wait_for()
    page.locator(".lab-figure img").nth(4).wait_for()
    check_generations(page)
    check_picker(page)
    check_touch(page)
    seen = [json.loads(each) for each in json.loads(page.evaluate("sessionStorage.seen"))]
    assert {waiting for _, _, waiting in seen} <= {"", "Drawing figures"}
    assert all(words in ([], ["Complete"]) for words, _, _ in seen), seen


def check_generations(page) -> None:
    """Check that the last generation is shown, and that the slider shows another one."""
    paths = page.locator(".lab-generations polyline")
    paths.nth(1).wait_for(state="attached")  # a robot that stands draws nothing
    assert paths.last.get_attribute("class") == "lab-generations-best"
    words, slider = (
        page.locator(".lab-generations .lab-value"),
        page.get_by_label("Generation of the paths"),
    )
    expect(words).to_have_text(re.compile(r"generation 4: coverage 0\.\d{3}"))
    last = paths.last.get_attribute("points")
    slider.fill("0")
    expect(words).to_have_text(re.compile(r"generation 0: coverage 0\.\d{3}"))
    assert paths.last.get_attribute("points") != last


def check_picker(page) -> None:
    """Check that all figures that show one condition show the best one, then the one that is chosen."""
    best = page.locator(".lab-table tbody tr").first.locator(".lab-choose-row").inner_text()
    assert best.startswith("novelty"), "the best one is first"
    captions = page.locator(".lab-figure + .lab-hint")
    for condition in (best, "coverage-10"):
        if condition != best:
            page.get_by_role("combobox", name="Condition").first.click()
            page.get_by_role("option", name=condition, exact=True).click()
        for part in (
            "Best trial of the typical run of",
            "Path of highest coverage",
            "best one of the first run of",
        ):
            page.get_by_text(re.compile(f"{part}.*{condition}")).wait_for()
        page.get_by_text(re.compile(f"Share of each species .* {condition}, run")).wait_for()
        others = {"novelty-10", "novelty-50", "novelty-80", "coverage-10"} - {condition}
        for text in captions.all_inner_texts():
            assert not text.startswith(("Path", "Share", "The archive")) or not any(
                f"{other}, run" in text for other in others
            ), text


def check_touch(page) -> None:
    """Check that a network without its sensors drives otherwise, and that its unchanged copy drives as recorded."""
    page.get_by_role("tab", name="Replay").click()
    tab = page.locator(".lab-replay")
    tab.locator(".rg-player").first.wait_for()
    tab.get_by_text("Change the network").click()
    names = tab.locator(".rg-player").nth(1).locator(".rg-name")
    expect(names).to_have_count(2)
    expect(names.nth(1)).to_contain_text("changed")
    assert tab.locator(".lab-gauges .q-slider").count() > 2
    trails = tab.locator(".rg-player").nth(1).locator(".rg-trail")
    end = tab.locator(".rg-player").nth(1).get_by_role("slider", name="Step")
    end.press("End")
    same = trails.evaluate_all("all => all.map((it) => it.getAttribute('points'))")
    assert same[0] == same[1]
    for sensor in tab.get_by_role("checkbox", name=re.compile("obstacle|time|stall")).all():
        sensor.click()
    tab.get_by_role("button", name="Run again").click()
    expect(trails.nth(1)).not_to_have_attribute("points", same[1])
    end.press("End")
    cut = trails.evaluate_all("all => all.map((it) => it.getAttribute('points'))")
    assert cut[0] == same[0]
    assert cut[1] != cut[0]


RUNNING = """
[study]
name = "running"
replicates = 1000000
[platform.sim]
steps = 2000
[[condition]]
name = "coverage"
platform = "sim"
"""
MARK = "button => { button.marked = true; }"
PROGRESS = """before => {
  const found = /[\\d,]+\\/1,000,000 runs/.exec(document.body.innerText);
  return found && found[0] !== before && !found[0].startsWith("0/") && found[0];
}"""


def test_progress_of_a_running_study_changes_in_place(lab, visit):
    page = visit("new")
    page.get_by_role("tab", name="File").click()
    page.get_by_label("Study file").fill(RUNNING)
    page.get_by_role("button", name="Start study").click()
    page.wait_for_url("**/study/running")
    home = visit()
    for each in (home, page):
        first = each.wait_for_function(PROGRESS, arg="").json_value()
        pause = each.get_by_role("button", name="Pause", exact=True)
        pause.evaluate(MARK)
        each.wait_for_function(PROGRESS, arg=first)
        assert pause.evaluate("button => button.marked")
    pause.click()
    for each in (home, page):
        each.locator(".lab-state", has_text="Paused").wait_for()


def test_form_shows_the_size_of_the_study_and_estimates_its_time(lab, visit):
    page = visit("new")
    size = page.locator(".lab-actions")
    runs = page.get_by_label("Runs per condition")
    runs.fill("50")
    size.get_by_text("2 conditions × 50 runs = 100 runs · less than 5 s on this machine").wait_for()
    runs.fill("900000000")
    size.get_by_text("= 1,800,000,000 runs · about").wait_for()
    runs.fill("many")
    page.wait_for_function("() => !document.body.innerText.includes('on this machine')")
    page.get_by_label("Template").last.click()
    page.get_by_role("option", name="paper-robot", exact=True).click()
    size.get_by_text("2 conditions × 3 runs = 6 runs · 240 trials on the robot").wait_for()
    page.get_by_role("tab", name="File").click()
    page.get_by_label("Study file").fill("[study]")
    page.wait_for_function("() => !document.body.innerText.includes('6 runs')")
    page.get_by_label("Study file").fill(RUNNING.replace("sim", "jyro"))
    size.get_by_text("1 condition × 1,000,000 runs = 1,000,000 runs").wait_for()
    assert list(lab.root.iterdir()) == []


def test_mistakes_in_the_form_are_shown_at_their_fields(lab, visit):
    page = visit("new")
    assert page.evaluate("document.documentElement.scrollHeight") <= 1600
    name = page.get_by_label("Name", exact=True).first
    name.fill("ui test!")
    page.get_by_label("Runs per condition").fill("many")
    page.get_by_role("button", name="Start study").click()
    summary = page.get_by_role("alert").filter(has_text="Runs per condition: Enter a whole number.")
    summary.wait_for()
    page.get_by_label("Runs per condition").fill("4")
    page.get_by_role("button", name="Start study").click()
    summary = page.get_by_role("alert").filter(has_text="You entered 'ui test!'.")
    summary.wait_for()
    page.wait_for_function("() => document.activeElement.ariaInvalid === 'true'")
    assert name.get_attribute("aria-invalid") == "true"
    assert page.get_by_label("Runs per condition").get_attribute("aria-invalid") is None
    about = page.locator(f"[id='{name.get_attribute('aria-describedby').split()[-1]}']")
    assert "You entered 'ui test!'." in about.inner_text()
    box = summary.bounding_box()
    assert 0 <= box["y"] <= 900 - box["height"]
    summary.get_by_role("link").click()
    page.wait_for_function("id => document.activeElement.id === id", arg=name.get_attribute("id"))
    assert str(lab.root) not in page.locator("body").inner_text()
    assert list(lab.root.iterdir()) == []


def test_mistakes_do_not_take_the_focus_from_a_visitor_who_types(lab, visit):
    page = visit("new")
    name = page.get_by_label("Name", exact=True).first
    name.fill("ui test!")
    name.blur()
    runs = page.get_by_label("Runs per condition")
    runs.evaluate("""it => {
        window.moves = [];
        addEventListener("focusin", ({target}) => moves.push(target));
        [...document.querySelectorAll("button")].find((each) => each.textContent.includes("Start study")).click();
        it.focus();
    }""")
    page.get_by_role("alert").filter(has_text="You entered 'ui test!'.").wait_for()
    page.evaluate("new Promise((done) => setTimeout(done, 60))")  # longer than the page waits
    assert runs.evaluate("it => document.activeElement === it && moves.every((each) => each === it)")


def test_texts_that_are_no_values_stay_in_their_fields(lab, visit):
    page = visit("new")
    runs = page.get_by_label("Runs per condition")
    noise = page.get_by_label("Noise", exact=True).and_(page.locator("input[type=text]"))
    runs.fill("many")
    noise.nth(1).fill("loud")
    page.get_by_role("button", name="Add condition").click()
    noise.nth(2).wait_for()
    assert (runs.input_value(), noise.nth(1).input_value()) == ("many", "loud")
    page.get_by_role("button", name="Remove condition 1").click()
    noise.nth(2).wait_for(state="detached")
    assert [noise.nth(k).input_value() for k in range(2)] == ["loud", ""]
    page.get_by_role("tab", name="File").click()
    page.get_by_label("Study file").wait_for()
    page.get_by_role("tab", name="Form").click()
    runs.wait_for()
    assert (runs.input_value(), noise.nth(0).input_value()) == ("many", "loud")
    page.get_by_label("Name", exact=True).first.fill("")
    page.get_by_role("button", name="Start study").click()
    for text in ("Runs per condition: Enter a whole number.", "Noise: Enter a number. You entered 'loud'."):
        page.get_by_role("alert").filter(has_text=text).wait_for()
    runs.fill("4")
    noise.nth(0).fill("0.1")
    page.get_by_role("button", name="Start study").click()
    page.get_by_role("alert").filter(has_text="Name: This field is empty. Enter a value.").wait_for()
    assert list(lab.root.iterdir()) == []


WATCH_NAMES = """() => {
  window.names = new Set();
  const look = () => {
    const name = [...document.querySelectorAll("label")].find((it) => it.textContent === "Name");
    const field = name && document.getElementById(name.getAttribute("for"));
    if (field && field.checkVisibility()) window.names.add(field.value);
    requestAnimationFrame(look);
  };
  look();
}"""


def test_form_cannot_be_edited_before_a_changed_file_is_read(lab, visit):
    page = visit("new")
    name = page.get_by_label("Name", exact=True).first
    name.wait_for()
    page.get_by_role("tab", name="File").click()
    file = page.get_by_label("Study file")
    file.fill(file.input_value().replace("my-study", "from-file"))
    name.wait_for(state="detached")
    page.evaluate(WATCH_NAMES)
    page.get_by_role("tab", name="Form").click()
    name.wait_for()
    assert page.evaluate("() => [...window.names]") == ["from-file"]
    name.fill("from-form")
    page.get_by_role("tab", name="File").click()
    file.wait_for()
    assert 'name = "from-form"' in file.input_value()
    page.get_by_role("tab", name="Form").click()
    name.wait_for()
    expect(name).to_have_value("from-form")


def test_file_with_a_mistake_keeps_its_text_until_it_is_corrected_or_discarded(lab, visit):
    page = visit("new")
    name = page.get_by_label("Name", exact=True).first
    page.get_by_role("tab", name="File").click()
    file = page.get_by_label("Study file")
    before = file.input_value()
    file.fill(f"{before}\n[neat")
    page.get_by_role("tab", name="Form").click()
    page.get_by_role("alert").filter(has_text="Expected a study file").wait_for()
    page.locator("[role=tab][aria-selected=true]", has_text="File").wait_for()
    assert file.input_value().endswith("[neat")
    assert not name.is_visible()
    page.get_by_role("button", name="Discard the changes of the file").click()
    page.get_by_role("alert").filter(has_text="Expected a study file").wait_for(state="hidden")
    expect(file).to_have_value(before)
    page.get_by_role("tab", name="Form").click()
    name.wait_for()
    page.get_by_role("button", name="Start study").click()
    page.wait_for_url("**/study/my-study")


def test_addresses_without_a_page_lead_to_the_studies(lab, visit):
    folder = lab.root / "paper"
    folder.mkdir()
    (folder / "study.json").write_text("{}")
    page = visit("gap", forgive=["404", "500"])
    for path, text in (
        ("nonsense", "There is no page here."),
        ("study/papre", "There is no study named 'papre' in this folder."),
        ("study/papre/trials", "There is no study named 'papre' in this folder."),
    ):
        assert page.goto(lab.address + path).status == 404
        page.get_by_text(text).wait_for()
        page.get_by_role("link", name="Robot").wait_for()
        assert page.get_by_role("link", name="paper", exact=True).count() == path.count("papre")
        assert str(lab.root) not in page.locator("body").inner_text()
    assert page.goto(lab.address + "broken").status == 500
    page.get_by_role("alert").get_by_text("This page cannot be shown: ").wait_for()
    page.get_by_role("button", name="Retry").wait_for()
    page.get_by_role("link", name="Robot").wait_for()
