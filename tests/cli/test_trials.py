"""`realitygap trials` with the file of trials that another command saved."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from realitygap.evolution import NeatSettings, Population
from realitygap.records import RecordWarning, read_observations
from tests.study.physical import drive, small_study

from .invoked import answered as run


@pytest.fixture
def tried(tmp_path: Path) -> tuple[str, ...]:
    """A command that saved three trials of a controller; the file is its last word."""
    genome = Population(3, 2, NeatSettings.named("rosenzweig-remy", population=2), seed=5).ask()[0]
    genome.save(tmp_path / "champion.json")
    file = tmp_path / "tried.sqlite"
    command = ("try", tmp_path / "champion.json", "--on", "sim", "--steps", 5, "--trials", 3, "-o", file)
    assert "3 trials" in run(*command)
    return tuple(map(str, command))


def test_file_is_listed_scored_and_annotated(tried):
    file = tried[-1]
    assert "3 trials: 3 scored." in run("trials", "list", file)
    assert "is scored; that can be done only while it is driven" in run(
        "trials", "score", file, 1, "--cells", "13,14", "--who", "anna"
    )
    assert "Enter a new one" in run("trials", "undo", file, 2)
    assert "Trial 2: 2 cells." in run("trials", "score", file, 2, "--cells", "13,14", "--who", "anna")
    run("trials", "note", file, 2, "--text", "a new pen")
    rows = json.loads(run("trials", "list", file, "--json"))
    assert [row["trial"] for row in rows] == [1, 2, 3]
    assert (rows[1]["cells"], rows[1]["notes"]) == ([13, 14], ["a new pen"])
    assert re.search(r"0\.028", run(*tried)), "the command uses the entered cells"
    sheet = Path(file).with_suffix(".txt")
    sheet.write_text("1: 13\n3: 13 14 15\n")
    assert "Trial 3: 3 cells." in run("trials", "score", file, "--file", sheet, "--second", "--who", "ben")
    assert "2 trials counted by two people" in run("trials", "agreement", file)


def test_void_trial_of_a_file_is_driven_again_alone(tried):
    file = tried[-1]
    assert "void" in run("trials", "void", file, 3, "--text", "it was pushed")
    assert "2 scored, 1 void" in run("trials", "list", file)
    assert "3 trials" in run(*tried)
    after = read_observations(file).trials
    assert [trial.number for trial in after] == [0, 1, 2, 2], "the record that is void, and the new one"
    assert "4 trials: 3 scored, 1 void." in run("trials", "list", file)


@pytest.fixture
def lines(tried, tmp_path) -> Path:
    """Trials as lines of JSON, in which commands of 0.1 saved them."""
    run("trials", "export", tried[-1], "-o", tmp_path / "old.jsonl")
    return tmp_path / "old.jsonl"


def test_old_lines_are_listed_converted_when_they_are_scored_and_taken_up(tried, lines, recwarn):
    assert "3 trials: 3 scored." in run("trials", "list", lines)
    assert [path.name for path in lines.parent.glob("old*")] == ["old.jsonl"]
    run("trials", "void", lines, 2, "--text", "it was pushed")
    assert "were converted" in str(recwarn.pop(RecordWarning).message)
    assert "2 scored, 1 void" in run("trials", "list", lines)
    assert "3 trials" in run(*tried[:-1], lines)
    assert "4 trials: 3 scored, 1 void." in run("trials", "list", lines.with_suffix(".sqlite"))
    assert not [each for each in recwarn if each.category is RecordWarning]


def test_folder_with_several_files_of_trials_names_one(tried, tmp_path):
    (tmp_path / "r" / "trials").mkdir(parents=True)
    (tmp_path / "r" / "trials" / "select-8-0.sqlite").write_bytes(Path(tried[-1]).read_bytes())
    assert "select-8-0.sqlite" in run("trials", "list", tmp_path / "r")
    assert "There is no ledger" in run("trials", "list", tmp_path / "none")


@pytest.fixture
def driven(tmp_path: Path) -> Path:
    """Results of a small study on an emulated robot."""
    drive(small_study(), tmp_path / "study")
    return tmp_path / "study"


@pytest.mark.parametrize("kind", ["tried", "driven"])
def test_trial_of_any_store_is_shown_with_its_record_and_notes(kind, request):
    source = request.getfixturevalue(kind)
    source = source if kind == "driven" else source[-1]
    run("trials", "note", source, 1, "--text", "a new pen", "--who", "anna")
    words = run("trials", "show", source, 1)
    assert "state: scored" in words
    assert "a new pen" in words
    shown = json.loads(run("trials", "show", source, 1, "--json"))
    assert shown["trial"] == 1
    assert len(shown["record"]["commands"]) > 0
    assert shown["notes"][0]["who"] == "anna"
    assert "The number of a trial is missing" in run("trials", "show", source)


@pytest.mark.parametrize("kind", ["tried", "driven"])
def test_trials_of_any_store_are_exported_as_lines_and_rows(kind, request, tmp_path):
    source = request.getfixturevalue(kind)
    source = source if kind == "driven" else source[-1]
    n = len(json.loads(run("trials", "list", source, "--json")))
    assert f"{n} trials" in run("trials", "export", source, "-o", tmp_path / "all.jsonl")
    copies = read_observations(tmp_path / "all.jsonl")
    assert len(copies.trials) == n
    run("trials", "export", source, 2, "-o", tmp_path / "one.parquet")
    trial = copies.trials[1]
    rows = pl.read_parquet(tmp_path / "one.parquet").head(len(trial.commands))
    assert rows["trial"].unique().to_list() == [2]
    np.testing.assert_array_equal(rows.select("move", "turn").to_numpy(), trial.commands)
    np.testing.assert_array_equal(np.array(rows["readings"].to_list()), trial.readings)
    if len(trial.poses):
        np.testing.assert_array_equal(rows.select("x", "y", "heading").to_numpy(), trial.poses[:-1])


def test_export_never_replaces_a_file(tried, lines):
    before = lines.read_bytes()
    assert "exists already" in run("trials", "export", tried[-1], "-o", lines)
    assert lines.read_bytes() == before
    assert "-o" in run("trials", "export", tried[-1])
