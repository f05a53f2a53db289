"""The page of a table of scores: one or several tasks, with nothing from elsewhere in it."""

import base64
import hashlib
import json
import re
from pathlib import Path

import pytest

from realitygap.errors import RecordError
from realitygap.orders import read_order
from realitygap.report import write_compared_scores
from realitygap.study import compare_scores

SIMPLER = Path(__file__).parent.parent / "data" / "simpler" / "scores.csv"
HOSTILE = "<img src=x onerror=alert(1)>&{{ 7*7 }}"


@pytest.fixture
def page_of(tmp_path):
    def write(*tables, **settings):
        compared = compare_scores(list(tables), **settings)
        return compared, compared.report(tmp_path / "gap.html").read_text("utf-8")

    return write


@pytest.fixture
def trials(tmp_path):
    lines = ["controller,platform,trial,score"]
    for k in range(6):
        for trial in range(3 + k % 2):
            score = 0.1 + 0.1 * k + 0.02 * trial
            lines += [f"{HOSTILE}{k},sim,{trial},{score:.2f}", f"{HOSTILE}{k},real,{trial},{0.9 * score:.3f}"]
    path = tmp_path / "scores.csv"
    path.write_text("\n".join(lines))
    return path


def test_page_of_trials_has_verdict_measures_figures_and_no_address(page_of, trials):
    compared, page = page_of(trials, margin=0.1)
    (gap,) = compared.gaps
    assert gap.result.verdict.split(",")[0] in page
    assert page.count("<figure") == 2
    assert "3 to 4 trials each" in page
    assert f"{gap.result.rms.value:.3f}" in page
    assert not re.search(r"(?:src|href)=\"(?!#)", page)
    (script,) = re.findall(r"<script>(.*?)</script>", page, re.S)
    assert f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'" in page


def test_names_of_the_table_are_text_on_the_page(page_of, trials):
    _, page = page_of(trials)
    assert "<img src" not in page
    assert "&lt;img src=x" in page
    assert "{{ 7*7 }}" in page


def test_page_of_tasks_has_an_overview_and_ids_once(page_of):
    _, page = page_of(SIMPLER)
    assert page.count("<figure") == 18
    assert page.count("<h2>") == 9
    assert (
        page.count("are means, without trials, so noise and gap cannot be separated") == 1 + 9
    )  # and once a table
    ids = re.findall(r' id="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    marks = json.loads(re.search(r'id="marks">(.*?)</script>', page, re.S)[1])
    assert {"pairs-1", "differences-9"} <= set(marks)


def test_again_reads_the_order_from_the_page(page_of, trials, tmp_path):
    compared, _ = page_of(trials, margin=0.1)
    order = read_order(tmp_path / "gap.html")
    assert order == compared.order
    assert order.words() == ["compare", str(trials), "--margin", "0.1"]


def test_a_page_that_is_none_is_refused(trials, tmp_path):
    with pytest.raises(RecordError, match=r"\.html"):
        write_compared_scores(compare_scores(trials), tmp_path / "gap.pdf")
