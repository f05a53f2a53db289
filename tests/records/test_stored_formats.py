"""Trials that realitygap 0.1.0 stored open and are extended. The files in `stored` are never written again."""

from __future__ import annotations

import contextlib
import shutil
import sqlite3
from pathlib import Path

import numpy as np
import pytest

from realitygap.errors import LedgerError
from realitygap.records import (
    Ledger,
    RecordWarning,
    Score,
    _ledger_file,
    open_ledger,
    read_observations,
)

STORED = Path(__file__).parent / "stored"


@pytest.fixture
def ledger_1(tmp_path: Path) -> Path:
    path = tmp_path / "ledger.sqlite"
    with contextlib.closing(sqlite3.connect(path)) as connection:
        connection.executescript((STORED / "ledger-1.sql").read_text("utf-8"))
        connection.execute("PRAGMA journal_mode = WAL")
    return path


def rows_of(path: Path) -> dict[str, list[tuple[object, ...]]]:
    """All rows of a ledger of either format, with the columns of format 1."""
    with contextlib.closing(sqlite3.connect(path)) as connection:
        tables = [
            name for (name,) in connection.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")
        ]
        rows = {name: connection.execute(f"SELECT * FROM {name}").fetchall() for name in tables}
    rows["trials"] = [row[:19] for row in rows["trials"]]
    return {name: found for name, found in rows.items() if found}


def test_ledger_of_format_1_opens_and_is_extended(ledger_1: Path) -> None:
    before, data = rows_of(ledger_1), ledger_1.read_bytes()
    with Ledger.open(ledger_1, writable=False) as ledger:
        assert [(trial.state, trial.is_closed) for trial in ledger.trials()] == [("scored", True)] * 6
        assert ledger.record(1).commands.shape == (4, 2)
        assert [(note["who"], note["text"]) for note in ledger.notes(1)] == [("anna", "a new pen")]
    assert ledger_1.read_bytes() == data, "reading converts a copy"
    Ledger.open(ledger_1).close()
    assert rows_of(ledger_1) == before
    with Ledger.open(ledger_1) as ledger:
        ledger.score(1, Score([13, 14], "ben"), "second")
        ledger.note("read again", "ben", 2)
        with pytest.raises(sqlite3.IntegrityError, match="nothing is ever deleted"):
            ledger._run("DELETE FROM trials")
    with Ledger.open(ledger_1, writable=False) as ledger:
        assert len(ledger.notes()) == 2
        assert {row["role"] for row in ledger.scores()} == {"score", "second"}


def test_ledger_of_format_1_that_cannot_be_converted_stays_as_it_is(
    ledger_1: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = rows_of(ledger_1)
    monkeypatch.setattr(_ledger_file, "FROM_1", _ledger_file.FROM_1.replace("COMMIT;", "SELECT no_such();"))
    monkeypatch.setattr(_ledger_file, "_checked", {})
    monkeypatch.setattr(_ledger_file, "_check", lambda *_: 1)
    with pytest.raises(LedgerError):
        Ledger.open(ledger_1)
    monkeypatch.undo()
    assert rows_of(ledger_1) == before
    Ledger.open(ledger_1).close()


@pytest.mark.parametrize("writable", [True, False])
def test_ledger_of_format_1_may_be_converted_by_another_program_meanwhile(
    ledger_1: Path, monkeypatch: pytest.MonkeyPatch, writable: bool
) -> None:
    before, check = rows_of(ledger_1), _ledger_file._check_once

    def check_before_the_other(connection: sqlite3.Connection, path: Path) -> int:
        version = check(connection, path)
        monkeypatch.undo()
        Ledger.open(path).close()
        return version

    monkeypatch.setattr(_ledger_file, "_check_once", check_before_the_other)
    with Ledger.open(ledger_1, writable=writable) as ledger:
        assert len(ledger.trials()) == 6
    assert rows_of(ledger_1) == before


def test_foreign_schema_in_a_ledger_of_format_1_is_refused_before_it_is_converted(ledger_1: Path) -> None:
    with contextlib.closing(sqlite3.connect(ledger_1)) as connection:
        connection.execute("CREATE TABLE more (x INTEGER)")
    with pytest.raises(LedgerError, match="a table 'more' that realitygap did not make"):
        Ledger.open(ledger_1)


def test_lines_of_observations_1_open_and_are_converted(tmp_path: Path) -> None:
    path = tmp_path / "trials.jsonl"
    shutil.copyfile(STORED / "observations-1.jsonl", path)
    stored = read_observations(path)
    assert [trial.end for trial in stored.trials] == ["step limit", "lost", "step limit"]
    assert [(trial.number, trial.end) for trial in stored.under_way] == [(2, "driven"), (3, "running")]
    assert np.all(stored.trials[0].last_readings == 1)
    with pytest.warns(RecordWarning, match="converted"):
        ledger = open_ledger(path)
    with ledger:
        assert [trial.state for trial in ledger.trials()] == ["scored", "void", "scored", "driven", "running"]
        ledger.score(2, Score([13, 14], "ben"))
        ledger.void(0, "it was pushed")
    with open_ledger(path, writable=False) as ledger:
        assert [trial.state for trial in ledger.trials()] == ["void", "void", "scored", "scored", "running"]
    assert path.read_bytes() == (STORED / "observations-1.jsonl").read_bytes()
