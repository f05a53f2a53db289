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
    assert page.count("<figure") == 5
    assert f"{gap.study.result.rms.value:.3f}" in page
    assert "Change this next: motor" in page
    assert not re.search(r"(?:src|href)=\"(?!#)", page)
    (script,) = re.findall(r"<script>(.*?)</script>", page, re.S)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in page
    marks = json.loads(re.search(r'id="marks">(.*?)</script>', page, re.S)[1])
    assert set(marks) == {"pairs", "differences", "maps", "replay", "why"}


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


def test_a_gap_without_a_camera_has_no_replay(tmp_path):
    found = gap_between("sim", "jyro", n_controllers=5, trials=2)
    assert draw_gap_replay(found.study) is None
    assert write_gap_report(found, tmp_path / "gap.html").read_text("utf-8").count("<figure") == 3


def test_a_page_that_is_none_is_refused_before_any_trial(tmp_path):
    with pytest.raises(RecordError, match=r"\.html"):
        refuse_gap_page(tmp_path / "gap.pdf")
