"""Scored trials as a table for fieldtrial, whose import 0.3.0 was tried on such a table."""

import csv

import pytest

from realitygap.errors import RecordError, StudyError
from realitygap.logs import read_scores
from realitygap.records import write_observations
from realitygap.study import write_fieldtrial
from tests.cli.invoked import printed, refused
from tests.logs.test_write_bag import HEAD, trial

from .physical import drive, small_study


@pytest.fixture
def trials(tmp_path):
    path = tmp_path / "trials.jsonl"
    cells = {1: (1, 2), 2: tuple(range(40)), 3: tuple(range(30))}
    write_observations(path, HEAD, [trial(number=number, cells=crossed) for number, crossed in cells.items()])
    return path


@pytest.mark.filterwarnings("ignore:.*converted")
def test_each_scored_trial_is_a_success_or_a_failure(trials, tmp_path):
    out = tmp_path / "out.csv"
    assert write_fieldtrial(trials, out, 30 / 72) == 3
    rows = list(csv.DictReader(out.open(encoding="utf-8")))
    assert [row["success"] for row in rows] == ["false", "true", "true"]
    assert [row["condition"] for row in rows] == ["trial=1", "trial=2", "trial=3"]
    assert len({row["arm"] for row in rows}) == 1
    assert rows[0]["duration_s"] == "2.4"
    assert rows[0]["notes"] == "trial 1, score 0.0278"
    assert [row.score for row in read_scores(out, platform="twin")] == [0.0, 1.0, 1.0]
    with pytest.raises(RecordError, match="exists already"):
        write_fieldtrial(trials, out, 0.5)


@pytest.mark.slow
def test_arms_of_a_study_are_its_conditions(tmp_path):
    drive(small_study(), tmp_path / "results")
    out = tmp_path / "out.csv"
    n = write_fieldtrial(tmp_path / "results", out, 0.0)
    rows = list(csv.DictReader(out.open(encoding="utf-8")))
    assert len(rows) == n == 6
    assert {row["arm"] for row in rows} == {"robot"}
    assert rows[-1]["condition"] == "trial=6"


@pytest.mark.filterwarnings("ignore:.*converted")
def test_command_states_what_fieldtrial_needs(trials, tmp_path):
    export = ("trials", "export", trials)
    assert "--success-from 0.3" in refused(*export, "--format", "fieldtrial", "-o", "out.csv")
    assert "Did you mean 'fieldtrial'" in refused(*export, "--format", "fieldtrials", "-o", "out.csv")
    assert "go with --format fieldtrial" in refused(*export, "--success-from", "0.3", "-o", "out.csv")
    with_format = (*export, "--format", "fieldtrial", "--success-from", "0.3")
    assert "ends in .csv" in refused(*with_format, "-o", "out.parquet")
    assert "only for export, not for list" in refused("trials", "list", trials, "--format", "fieldtrial")
    assert "(3 trials)" in printed(*with_format, "-o", tmp_path / "out.csv")


@pytest.mark.filterwarnings("ignore:.*converted")
def test_a_file_without_scored_trials_is_refused(tmp_path):
    path = tmp_path / "trials.jsonl"
    write_observations(path, HEAD, [trial(0, number=1)])
    with pytest.raises(StudyError, match="no scored trial"):
        write_fieldtrial(path, tmp_path / "out.csv", 0.5)
    with pytest.raises(ValueError, match="finite"):
        write_fieldtrial(path, tmp_path / "out.csv", float("nan"))
