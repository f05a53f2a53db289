"""Trials of files and of ledgers as bags of ROS, by command."""

import numpy as np
import pytest
from typer.testing import CliRunner

from realitygap.cli import app
from realitygap.errors import LedgerError, LogError, StudyError
from realitygap.logs import import_log, mapping_of
from realitygap.records import (
    LEDGER_NAME,
    Ledger,
    RecordWarning,
    open_ledger,
    read_observations,
    write_observations,
)
from realitygap.study import export_trials
from tests.logs.test_write_bag import HEAD, trial

from .physical import drive, small_study


def export(*words):
    return CliRunner().invoke(app, ["export-trials", *map(str, words)], catch_exceptions=False)


@pytest.fixture
def trials(tmp_path):
    path = tmp_path / "trials.jsonl"
    write_observations(path, HEAD, [trial(), trial(number=9), trial(0, number=11)])
    return path


def test_each_driven_trial_of_a_file_has_a_bag(trials, tmp_path):
    done = export(trials, "-o", tmp_path / "drive.mcap")
    assert done.stdout.count("Written: ") == 2
    assert sorted(path.name for path in tmp_path.glob("drive*")) == [
        "drive-7.map.toml", "drive-7.mcap", "drive-9.map.toml", "drive-9.mcap"
    ]  # fmt: skip
    assert f"mapping: {tmp_path / 'drive-9.map.toml'}" in done.stdout


def test_void_trial_of_a_file_has_no_bag(trials, tmp_path):
    with pytest.warns(RecordWarning, match="converted"):
        ledger = open_ledger(trials)
    with ledger:
        ledger.void(9, "it was pushed")
    (report,) = export_trials(trials, tmp_path / "drive.mcap")
    assert report.bag == tmp_path / "drive.mcap"


def test_one_trial_has_the_name_that_was_given(trials, tmp_path):
    export(trials, "--trial", 9, "--wheel-diameter-mm", 40, "-o", tmp_path / "bag")
    log_map, _ = mapping_of(tmp_path / "bag")
    assert log_map.wheels.wheel_diameter_mm == 40
    import_log(tmp_path / "bag", tmp_path / "again.jsonl", log_map)
    (again,) = read_observations(tmp_path / "again.jsonl").trials
    np.testing.assert_allclose(again.wheels, trial().wheels, atol=1e-7)


def test_trials_of_a_ledger_have_the_path_of_the_witness(tmp_path):
    drive(small_study(), tmp_path / "study")
    (report,) = export_trials(tmp_path / "study", tmp_path / "one.mcap", [2])
    with Ledger.open(tmp_path / "study" / LEDGER_NAME, writable=False) as ledger:
        n_steps, path = len(ledger.record(2).commands), ledger.counted_score(2).path
    assert report.n_messages["/cmd_vel"] == n_steps + 1
    log_map, _ = mapping_of(report.bag)
    assert log_map.label == "EMULATED"
    assert ("/odom" in report.n_messages) == (path is not None)
    assert len(list(export_trials(tmp_path / "study", tmp_path / "all"))) == 6


def test_missing_trials_and_files_give_one_message(trials, tmp_path):
    with pytest.raises(LedgerError, match="has no trial 8"):
        export(trials, "--trial", 8, "-o", tmp_path / "a.mcap")
    with pytest.raises(StudyError, match="with -o: a file"):
        export(trials)
    (tmp_path / "taken").mkdir()
    with pytest.raises(StudyError, match=r"taken has no trials of a robot\. For those of a simulation"):
        export(tmp_path / "taken", "-o", tmp_path / "a.mcap")
    with pytest.raises(LogError, match="taken exists already"):
        export(trials, "--trial", 7, "-o", tmp_path / "taken")
    write_observations(tmp_path / "none.jsonl", HEAD, [trial(0)])
    with pytest.raises(StudyError, match="has no trial that was driven"):
        export(tmp_path / "none.jsonl", "-o", tmp_path / "a.mcap")
