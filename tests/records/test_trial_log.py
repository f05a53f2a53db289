"""Trials in a file, which a person voids, scores, and annotates."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from realitygap.errors import RecordError
from realitygap.records import (
    ObservationsFile,
    ObservationsHead,
    Score,
    TrialLog,
    read_observations,
)
from tests.records.test_observations_file import HEAD, trial

CONTROLLERS: ObservationsHead = replace(HEAD, observe="cells")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A file of a trial that counts, one that was lost and repeated, one that waits for a count, and one under way."""
    path = tmp_path / "tried.jsonl"
    with ObservationsFile(path, CONTROLLERS) as file:
        for number, ends in enumerate((["step limit"], ["lost", "step limit"], ["driven"], ["running"])):
            for end in ends:
                cells = (3, 7) if end == "step limit" else ()
                file.append(replace(trial(number), purpose="controller", genome="{}", end=end, cells=cells))
    return path


def states(path: Path) -> dict[int, str]:
    with TrialLog.open(path, writable=False) as log:
        return {each.trial: each.state for each in log.trials()}


def test_each_trial_has_the_state_of_its_last_line(path: Path) -> None:
    assert states(path) == {0: "scored", 1: "scored", 2: "driven", 3: "running"}
    with TrialLog.open(path) as log:
        assert [each.trial for each in log.trials(states=["driven", "running"])] == [2, 3]
        assert log.trial(0).name == "controller, controller 1"
        assert log.trial(0).cells == (3, 7)
        assert log.trial(2).cells is None


def test_entered_cells_replace_those_of_before_and_score_a_driven_trial(path: Path) -> None:
    before = path.read_bytes()
    with TrialLog.open(path) as log:
        log.score_all({0: Score([13, 14, 13], "anna"), 2: Score([5], "anna")})
        assert (log.trial(0).cells, log.trial(2).state) == ((13, 14), "scored")
        assert [note["who"] for note in log.notes(0)] == ["anna"]
    assert path.read_bytes().startswith(before), "nothing is overwritten"
    found = read_observations(path)
    assert [each.number for each in found.under_way] == [3]
    assert found.trials[-1].cells == (5,)


def test_void_trial_has_its_reason_and_no_longer_counts(path: Path) -> None:
    with TrialLog.open(path) as log:
        for number in (0, 3):
            log.void(number, "it was pushed")
        assert (log.trial(0).state, log.trial(0).reason) == ("void", "it was pushed")
    assert states(path)[3] == "void"


def test_notes_are_kept_with_who_and_when(path: Path) -> None:
    with TrialLog.open(path) as log:
        log.note("a new pen", "ben", 1)
        log.note("the light was on", "ben")
    with TrialLog.open(path, writable=False) as log:
        assert [(note["trial"], note["text"], note["who"]) for note in log.notes()] == [
            (1, "a new pen", "ben"),
            (None, "the light was on", "ben"),
        ]
        assert len(log.notes(1)) == 1


@pytest.mark.parametrize(
    ("number", "cells", "role"),
    [(0, [72], "score"), (0, [], "score"), (3, [1], "score"), (9, [1], "score"), (0, [1], "second")],
)
def test_refused_cells_change_nothing(path: Path, number: int, cells: list[int], role: str) -> None:
    before = path.read_bytes()
    with TrialLog.open(path) as log, pytest.raises(RecordError):
        log.score_all({1: Score([1], "anna"), number: Score(cells, "anna")}, role)  # type: ignore[arg-type]
    assert path.read_bytes() == before


def test_other_mistakes_are_refused(path: Path) -> None:
    with ObservationsFile(path, CONTROLLERS) as file:
        file.append(replace(trial(4), purpose="path", cells=()))
        file.append(replace(trial(0), purpose="motion"))
    with TrialLog.open(path) as log:
        for work in (
            lambda: log.score_all({4: Score([1], "anna")}),  # which draws no line
            lambda: log.void(0, "of two trials with this number"),
            lambda: log.void(1, " "),
            lambda: log.note(" ", "anna"),
        ):
            with pytest.raises(RecordError):
                work()
        log.void(1, "pushed")
        with pytest.raises(RecordError):
            log.void(1, "pushed")
    with TrialLog.open(path, writable=False) as log, pytest.raises(RecordError):
        log.note("text", "anna")


def test_damaged_note_is_refused_and_a_torn_one_is_left_out(path: Path) -> None:
    with TrialLog.open(path) as log:
        log.note("a new pen", "ben", 1)
    whole = path.read_bytes()
    path.write_bytes(whole[:-9])
    assert read_observations(path).notes == ()
    for wrong in ({"note": 1}, {"note": "a", "who": "b", "time": "c", "trial": "d"}):
        path.write_bytes(whole + json.dumps(wrong).encode() + b"\n" + b"{}")
        with pytest.raises(RecordError, match="a note that cannot be read"):
            read_observations(path)


def test_second_program_cannot_write_to_a_file_of_trials(path: Path) -> None:
    with ObservationsFile(path, CONTROLLERS), pytest.raises(RecordError, match="in use"):
        TrialLog.open(path)
    TrialLog.open(path).close()
