"""The page of a gap needs nothing else, and says on which platforms its numbers are from."""

import base64
import hashlib
import json
import re

import pytest

from realitygap.errors import RecordError
from realitygap.gap import Why
from realitygap.report import (
    refuse_gap_page,
    write_gap_report,
)
from realitygap.report._gap_figures import draw_gap_maps, draw_gap_pairs, draw_gap_replay, draw_gap_why
from realitygap.stats import Estimate
from realitygap.study import GapBetween, gap_between
from tests.browsers import open_browser

pytestmark = pytest.mark.slow

WHY = Why(
    ("body", "motor"), (Estimate(0.0, 0.0, 0.0, 8), Estimate(0.1, 0.05, 0.2, 8)), (0, 2),
    Estimate(0.2, 0.1, 0.3, 8), Estimate(0.1, 0.0, 0.2, 8), Estimate(-0.1, -0.2, -0.05, 8),
)  # fmt: skip


@pytest.fixture(scope="module")
def gap():
    found = gap_between("sim", "jyro", n_controllers=8, trials=3, margin=0.1, observe="track")
    return GapBetween(found.study, WHY)


def test_the_page_has_verdict_measures_figures_and_no_address(gap, tmp_path):
    path = write_gap_report(gap, tmp_path / "gap.html")
    page = path.read_text("utf-8")
    assert gap.study.result.verdict.split(",")[0] in page
    assert page.count("<figure") == 7
    assert f"{gap.study.result.rms.value:.3f}" in page
    assert "Change this next: motor" in page
    assert not re.search(r"(?:src|href)=\"(?!#)", page)
    scripts = re.findall(r"<script>(.*?)</script>", page, re.S)
    assert len(scripts) == 2
    for script in scripts:
        assert f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'" in page
    marks = json.loads(re.search(r'id="marks">(.*?)</script>', page, re.S)[1])
    assert set(marks) == {"distance", "pairs", "differences", "maps", "replay", "why"}


def test_ids_are_used_once_so_that_no_figure_shows_parts_of_another(gap, tmp_path):
    page = write_gap_report(gap, tmp_path / "gap.html").read_text("utf-8")
    ids = re.findall(r' id="([^"]+)"', page)
    assert len(ids) == len(set(ids))


def test_figures_say_platforms_trials_and_intervals(gap):
    for drawing in (draw_gap_pairs(gap.study), draw_gap_maps(gap.study), draw_gap_replay(gap.study)):
        assert "sim (SIM)" in drawing.caption
        assert "jyro (SIM)" in drawing.caption
    assert "8 controllers, 3 trials each" in draw_gap_pairs(gap.study).caption
    assert "jyro (SIM)" in draw_gap_why(WHY, gap.study).caption


def test_one_controller_moves_on_both_platforms_from_one_start(gap, tmp_path):
    page = write_gap_report(gap, tmp_path / "gap.html").read_text("utf-8")
    (data,) = re.findall(r'<script type="application/json">(.*?)</script>', page, re.S)
    one, other = json.loads(data)["trials"]
    assert one["poses"][0] == other["poses"][0]
    assert one["poses"][-1] != other["poses"][-1]
    shown = gap.study.shown
    assert gap.study.source.means[shown.controller] == gap.study.source.means.max()
    assert len(shown.source) == len(shown.target) == 3


def test_controller_moves_until_it_is_paused_and_stands_with_reduced_motion(gap, tmp_path):
    address = write_gap_report(gap, tmp_path / "gap.html").as_uri()
    moved = "() => !document.querySelector('.motion .rg-clock').textContent.startsWith('step 0 ')"
    with open_browser() as browser:
        for motion in ("no-preference", "reduce"):
            complaints = []
            page = browser.new_page(reduced_motion=motion)
            page.on("console", lambda message, said=complaints: said.append(message.text))
            page.goto(address)
            if motion == "reduce":
                assert page.get_by_role("button", name="Play trials").is_visible()
                assert page.evaluate(moved) is False
            else:
                page.wait_for_function(moved)
                page.get_by_role("button", name="Pause trials").click()
            assert not page.get_by_text("need JavaScript").count()
            assert not page.get_by_text("Measures of the transfer gap.").is_visible()  # folded
            assert complaints == []


def test_players_of_a_page_play_stand_and_jump_together(gap, tmp_path):
    path = write_gap_report(gap, tmp_path / "gap.html")
    (motion,) = re.findall(r'<div class="motion">.*?</script>.*?</div>', path.read_text("utf-8"), re.S)
    path.write_text(path.read_text("utf-8").replace(motion, motion * 2), "utf-8")
    with open_browser() as browser:
        page = browser.new_page()
        page.goto(path.as_uri())
        page.get_by_role("button", name="Pause trials").nth(1).click()
        assert page.get_by_role("button", name="Play trials").count() == 2
        slider = page.get_by_role("slider")
        slider.nth(0).fill("7")
        assert slider.nth(1).input_value() == "7"
        page.get_by_role("combobox").nth(1).select_option("1")
        assert page.get_by_role("combobox").nth(0).input_value() == "1"
        page.get_by_role("button", name="Play trials").nth(0).click()
        assert page.get_by_role("button", name="Pause trials").count() == 2


def test_what_moves_has_the_cells_of_the_measured_trials():
    study = gap_between("sim", "jyro", n_controllers=5, trials=2, observe="cells").study
    k = study.shown.controller
    for moving, record in zip(study.shown.target, study.target_trials[2 * k : 2 * k + 2], strict=True):
        assert sorted(moving.cells) == list(record.cells)


def test_a_gap_without_a_camera_has_no_replay(tmp_path):
    found = gap_between("sim", "jyro", n_controllers=5, trials=2)
    assert draw_gap_replay(found.study) is None
    assert write_gap_report(found, tmp_path / "gap.html").read_text("utf-8").count("<figure") == 5


def test_a_page_that_is_none_is_refused_before_any_trial(tmp_path):
    with pytest.raises(RecordError, match=r"\.html"):
        refuse_gap_page(tmp_path / "gap.pdf")
