"""The state of a study, from its folder and its job; and its figures that were drawn before."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from realitygap._wording import duration
from realitygap.lab import _figure_cache
from realitygap.lab._figure_cache import keep_figures, read_figures, read_rows
from realitygap.lab._messages import StudyProgress
from realitygap.lab._standing import standing_of
from realitygap.lab._studies import Studies, StudyState
from realitygap.records import ResultsFolder
from realitygap.study import run_study
from tests.study.physical import drive, small_study

ROW = {"condition": "a", "label": "SIM", "n": 6, "line_median": 0.25, "line_low": None, "line_high": None}


def state(n_done: int = 0, **values: Any) -> StudyState:
    return StudyState("mine", n_runs=8, n_done=n_done, **values)


def job(*, is_over: bool = True, is_failed: bool = False, progress: StudyProgress | None = None) -> Any:
    return SimpleNamespace(
        is_over=is_over, is_failed=is_failed, outcome="disk full", ask=None, progress=progress
    )


CURVE = {
    "condition": "novelty-10",
    "label": "SIM",
    "search": "coverage",
    "noise": 0.1,
    "points": [
        {"n": 8, "median": 0.4, "low": 0.3, "high": 0.5},
        {"n": 8, "median": 0.5, "low": None, "high": None},
    ],
}
PROGRESS = StudyProgress(n_done=6, n_runs=8, n_computed=4, seconds=2.0)


@pytest.mark.parametrize(
    ("folder", "work", "word", "progress"),
    [
        (state(), None, "Not started", "0/8 runs"),
        (
            state(4, used_by="process 1 on here"),
            job(is_over=False, progress=PROGRESS),
            "Running",
            "4/8 runs · 2 runs/s · 2 s left",
        ),
        (state(4), job(is_over=False, progress=None), "Running", "4/8 runs"),
        (state(4, used_by="process 1 on here"), None, "In use", "4/8 runs"),
        (state(4), job(), "Paused", "4/8 runs"),
        (state(4), job(is_failed=True), "Failed", "4/8 runs"),
        (state(8), job(is_failed=True), "Complete", "8 runs"),
        (state(8, n_driven_runs=1), job(), "Waiting for robot", "8 runs · 0/1 robot run"),
        (StudyState("mine", problem="damaged"), None, "Failed", ""),
    ],
)
def test_study_has_one_state(folder, work, word, progress):
    standing = standing_of(folder, work)
    assert (standing.word, standing.progress) == (word, progress)
    assert bool(standing.message) == (word in ("Failed", "In use"))
    assert standing.can_resume == (word in ("Not started", "Paused", "Failed") and not folder.problem)


def test_study_has_the_label_of_the_robot_that_drove_it(tmp_path):
    """A driven study on an emulated robot had no label."""
    study = small_study()
    ResultsFolder.create(tmp_path / "small", study.description())
    assert Studies(tmp_path).state("small").labels == ()
    drive(study, tmp_path / "small")
    assert Studies(tmp_path).state("small").labels == ("EMULATED",)


def test_all_counts_of_a_study_are_one(tmp_path):
    """The list, the header, and the table of conditions counted at different moments."""
    run_study("paper", tmp_path / "paper", replicates=3)
    state = Studies(tmp_path).state("paper")
    assert [(each.n_done, each.n_runs, each.label) for each in state.conditions] == 9 * [(3, 3, "SIM")]
    assert sum(each.n_done for each in state.conditions) == state.n_all_done == state.n_all == 27


def test_durations_have_the_unit_that_fits():
    assert [duration(seconds) for seconds in (0.4, 89, 90, 5399, 5400)] == [
        "0 s",
        "89 s",
        "2 min",
        "90 min",
        "1.5 h",
    ]


def test_figures_are_read_only_for_the_runs_and_the_version_they_were_drawn_of(tmp_path, monkeypatch):
    figure = {"caption": "c", "alt": "a", "wide": "<svg/>", "narrow": "<svg/>"}
    keep_figures(tmp_path, (8, 0), [ROW], [CURVE], {"coverage": figure})
    assert read_figures(tmp_path, (8, 0)) == ([ROW], [CURVE], {"coverage": figure})
    assert read_rows(tmp_path, (8, 0)) == [ROW]
    assert read_figures(tmp_path, (9, 0)) is None
    monkeypatch.setattr(_figure_cache, "__version__", "next")
    assert read_figures(tmp_path, (8, 0)) is None


@pytest.mark.parametrize(
    "curve", [{**CURVE, "points": []}, {**CURVE, "points": [{"n": 1, "median": "high"}]}, [], "text"]
)
def test_curves_of_another_form_are_not_read(tmp_path, curve):
    keep_figures(tmp_path, (8, 0), [ROW], [curve], {})
    assert read_figures(tmp_path, (8, 0)) is None


@pytest.mark.parametrize("row", [{**ROW, "line_median": "high"}, {**ROW, "n": None}, [], "text"])
def test_summary_of_another_form_is_not_read(tmp_path, row):
    keep_figures(tmp_path, (8, 0), [row], [], {"coverage": {"caption": 1}})
    assert read_rows(tmp_path, (8, 0)) is None
    assert read_figures(tmp_path, (8, 0)) is None
