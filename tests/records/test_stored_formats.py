"""Trials that realitygap 0.1.0 stored open and are extended. The files in `stored` are never written again."""

from __future__ import annotations

import contextlib
import shutil
import sqlite3
from pathlib import Path

import numpy as np

from realitygap.records import Ledger, Score, TrialLog, read_observations

STORED = Path(__file__).parent / "stored"


def test_ledger_of_format_1_opens_and_is_extended(tmp_path: Path) -> None:
    path = tmp_path / "ledger.sqlite"
    with contextlib.closing(sqlite3.connect(path)) as connection:
        connection.executescript((STORED / "ledger-1.sql").read_text("utf-8"))
    with Ledger.open(path, writable=False) as ledger:
        assert [(trial.state, trial.is_closed) for trial in ledger.trials()] == [("scored", True)] * 6
        assert ledger.record(1).commands.shape == (4, 2)
        assert [(note["who"], note["text"]) for note in ledger.notes(1)] == [("anna", "a new pen")]
    with Ledger.open(path) as ledger:
        ledger.score(1, Score([13, 14], "ben"), "second")
        ledger.note("read again", "ben", 2)
    with Ledger.open(path, writable=False) as ledger:
        assert len(ledger.notes()) == 2
        assert {row["role"] for row in ledger.scores()} == {"score", "second"}


def test_file_of_observations_1_opens_and_is_extended(tmp_path: Path) -> None:
    path = tmp_path / "trials.jsonl"
    shutil.copyfile(STORED / "observations-1.jsonl", path)
    stored = read_observations(path)
    assert [trial.end for trial in stored.trials] == ["step limit", "lost", "step limit"]
    assert [(trial.number, trial.end) for trial in stored.under_way] == [(2, "driven"), (3, "running")]
    assert np.all(stored.trials[0].last_readings == 1)
    with TrialLog.open(path) as log:
        assert [trial.state for trial in log.trials()] == ["scored", "scored", "driven", "running"]
        log.score_all({2: Score([13, 14], "ben")})
        log.void(0, "it was pushed")
        assert [note["who"] for note in log.notes()] == ["anna", "ben"]
    with TrialLog.open(path, writable=False) as log:
        assert [trial.state for trial in log.trials()] == ["void", "scored", "scored", "running"]
    assert path.read_bytes().startswith((STORED / "observations-1.jsonl").read_bytes())
