"""Changes of locked designs that visitors enter, and the forms that lock one."""

from __future__ import annotations

from pathlib import Path

import pytest

from realitygap.errors import StudyError
from realitygap.lab._design import LONGEST_TEXT, amend, shown_value, unblind
from realitygap.lab._lab import Lab
from realitygap.lab._mistakes import FormError
from realitygap.study import design_report, gap_between

from .robot_study import FAST, make_study

SETTINGS = {"n_controllers": 2, "trials": 1, "observe": "cells"}


@pytest.fixture(scope="module")
def blind(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file with all trials of a blind gap."""
    file = tmp_path_factory.mktemp("blind") / "gap.sqlite"
    with pytest.raises(StudyError, match="blind"):
        gap_between("sim", "sim:scribbler-s1", **SETTINGS, results=file, blind=True)
    return file


@pytest.mark.parametrize(
    ("entered", "field"),
    [
        ({"who": " "}, "who"),
        ({"value": "0"}, "value"),
        ({"value": "many"}, "value"),
        ({"setting": "trails"}, "value"),
        ({"reason": " "}, "reason"),
        ({"setting": "", "reason": ""}, "reason"),
    ],
)
def test_mistake_in_an_amendment_is_one_of_its_field_and_changes_nothing(blind, entered, field):
    right = {"who": "anna", "setting": "trials", "value": "2", "reason": "scores vary more than planned"}
    before = design_report(blind).design.events
    with pytest.raises(FormError) as refused:
        amend(blind, **{**right, **entered})
    assert list(refused.value.problems) == [field]
    assert design_report(blind).design.events == before


def test_changes_are_saved_with_the_name_of_the_visitor(blind):
    amend(blind, "anna", "", "", "the floor was replaced" * LONGEST_TEXT)
    amend(blind, "anna", "trials", "2", "scores vary more than planned")
    unblind(blind, "berta", "a look")
    report = design_report(blind)
    assert [each.details["who"] for each in report.design.events[-3:]] == ["anna", "anna", "berta"]
    assert report.design.design["settings"]["trials"] == 2
    assert not report.design.is_blind
    assert "trials: 1 → 2" in report.line
    assert "Unblinded early, by berta" in report.line


@pytest.mark.parametrize("value", [None, True, 3, 0.05, "shuffled", ["red", "blue"]])
def test_shown_value_is_read_as_the_same_value(tmp_path, value):
    from realitygap.study._design import _value

    assert _value(shown_value(value)) == value


def test_study_without_trials_is_locked_by_a_named_visitor_only(tmp_path):
    make_study(tmp_path)
    lab = Lab(tmp_path)
    try:
        with pytest.raises(FormError) as refused:
            lab.go_on("by-robot", port=FAST, lock=True, who=" ")
        assert list(refused.value.problems) == ["who"]
        assert lab.job("by-robot") is None
    finally:
        lab.close()


def test_forms_of_a_gap_and_a_calibration_lock_their_design():
    from realitygap.lab.pages import _calibrate, _gap

    assert {"lock", "blind"} <= set(_gap._FIELDS)
    assert "lock" in _calibrate._FIELDS
