"""Ledgers whose rows do not fit together, or whose schema is foreign: one message, or success, never a traceback."""

from __future__ import annotations

import contextlib
import random
import shutil
import sqlite3
import threading
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from typer.main import get_command

from realitygap.cli._app import make_app
from realitygap.cli._commands import COMMANDS
from realitygap.errors import LedgerError, RealityGapError
from realitygap.lab import _studies
from realitygap.lab._counts import Counts
from realitygap.lab._studies import Studies
from realitygap.records import (
    LEDGER_NAME,
    Ledger,
    ResultsFolder,
    Score,
    _ledger_file,
    ledger_tables,
    open_saved_trials,
    read_observations,
)
from realitygap.report import summarize
from realitygap.report._driven import describe_driven, driven_paths, read_driven
from realitygap.study import run_study
from realitygap.study._trial_export import _driven_trials
from tests.commands import run_command
from tests.records.test_observations_file import HEAD
from tests.records.test_observations_file import trial as saved_trial
from tests.study.physical import drive, small_study

TRIALS = get_command(make_app([command for command in COMMANDS if command.name == "trials"]))
Rows = dict[str, list[dict[str, Any]]]

VALUES = (
    None, "", "x", b"\xff", -1, 0, 7, 2**31, 2**62, 0.5, float("inf"), "{}", "[]", "null", "[[0,0]]", "[[0,0,0]]",
    "[1e999]", "[-1]", "[99]", '["a"]', '{"a": [1]}', "2026-01-01", "REAL",
)  # fmt: skip


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> Path:
    """A study with a run that a robot drove, whose ledger has rows in all tables, and one in simulation."""
    path = tmp_path_factory.mktemp("driven") / "small"
    about = small_study(more='[[condition]]\nname = "simulated"\n')
    run_study(about, path)
    drive(about, path)
    with Ledger.open(path / LEDGER_NAME) as ledger:
        ledger.note("the floor was wet", "anna", 1)
        ledger.note("cells [/2] unclear", "anna")
        ledger.score(2, Score([13, 14], "ben"), "second")
        ledger.score(3, Score([13], "ben"), "correction")
    return path


@pytest.fixture(scope="module")
def rows(study) -> Rows:
    return rows_of(study / LEDGER_NAME)


def rows_of(path: Path) -> Rows:
    with contextlib.closing(sqlite3.connect(path)) as connection:
        connection.row_factory = sqlite3.Row
        return {
            table: [dict(row) for row in connection.execute(f"SELECT * FROM {table}")]
            for table in ledger_tables()
        }


def write_ledger(path: Path, rows: Rows) -> None:
    """Write a ledger with our schema and any rows, also such as SQLite itself would refuse."""
    for ending in ("", "-wal", "-shm"):
        path.with_name(path.name + ending).unlink(missing_ok=True)
    synchronous, _ledger_file.SYNCHRONOUS = _ledger_file.SYNCHRONOUS, "OFF"  # the disk takes most of the time
    try:
        Ledger.create(path).close()
    finally:
        _ledger_file.SYNCHRONOUS = synchronous
    with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("PRAGMA synchronous = OFF")
        connection.execute("PRAGMA foreign_keys = OFF")
        connection.execute("PRAGMA ignore_check_constraints = ON")
        triggers = connection.execute("SELECT name, sql FROM sqlite_schema WHERE type = 'trigger'").fetchall()
        for name, _ in triggers:
            connection.execute(f"DROP TRIGGER {name}")
        connection.execute("PRAGMA writable_schema = ON")
        whole = connection.execute("SELECT sql, name FROM sqlite_schema WHERE type = 'table'").fetchall()
        for sql, name in whole:
            connection.execute(
                "UPDATE sqlite_schema SET sql = ? WHERE name = ?", (sql.replace(" NOT NULL", ""), name)
            )
        connection.execute("PRAGMA writable_schema = RESET")
        connection.execute("BEGIN")
        for table, these in rows.items():
            for row in these:
                marks = ", ".join("?" * len(row))
                connection.execute(f"INSERT INTO {table} VALUES ({marks})", tuple(row.values()))
        connection.execute("COMMIT")
        connection.execute("PRAGMA writable_schema = ON")
        connection.executemany("UPDATE sqlite_schema SET sql = ? WHERE name = ?", whole)
        connection.execute("PRAGMA writable_schema = RESET")
        for _, sql in triggers:
            connection.execute(sql)
        connection.execute("PRAGMA journal_mode = DELETE")


def mutants(rows: Rows) -> Iterator[tuple[str, Rows]]:
    """Yield the ledger with one value changed, one row missing, or one row twice."""
    for table, these in rows.items():
        for place in sorted({0, len(these) - 1}) if these else ():
            yield f"{table}[{place}] missing", rows | {table: these[:place] + these[place + 1 :]}
            for column, before in these[place].items():
                for value in VALUES:
                    if type(value) is type(before) and value == before:
                        continue
                    changed = [*these[:place], these[place] | {column: value}, *these[place + 1 :]]
                    yield f"{table}[{place}].{column} = {value!r}", rows | {table: changed}


def read_everywhere(study: Path) -> None:
    """Read the ledger as commands and pages do. Each ends in success, or in one of our errors."""
    for what, *options in (("list",), ("list", "--json"), ("agreement",)):
        done = CliRunner().invoke(TRIALS, ["trials", what, str(study), *options])
        if done.exception is not None and not isinstance(done.exception, RealityGapError):
            raise done.exception
    folder = ResultsFolder.open(study)
    counts = Counts(study, folder.description)

    def read_report() -> None:
        for name, driven in read_driven(folder).items():
            describe_driven(name, driven)

    for read in (
        read_report,
        lambda: driven_paths(folder, "robot", 0),
        lambda: summarize(folder),
        lambda: _driven_trials(study, ()),
        lambda: [counts.card(trial.number, "carla", "second") for trial in counts.look()],
    ):
        with contextlib.suppress(RealityGapError):
            read()
    assert Studies(study.parent).state(study.name).title


def read_mutants(study: Path, chosen: Iterable[tuple[str, Rows]]) -> tuple[int, int]:
    """Read each ledger; return how many were refused when they were opened, and how many were read."""
    n_refused = n_read = 0
    for name, these in chosen:
        try:
            write_ledger(study / LEDGER_NAME, these)
        except sqlite3.Error:  # SQLite itself refuses such a key
            continue
        try:
            Ledger.open(study / LEDGER_NAME, writable=False).close()
        except LedgerError as error:
            n_refused += "Restore" in str(error)
            continue
        n_read += 1
        try:
            read_everywhere(study)
        except Exception as error:
            raise AssertionError(f"{name}: {type(error).__name__}: {error}") from error
    return n_refused, n_read


@pytest.mark.slow
def test_changed_ledgers_end_in_one_message_or_are_read(study, rows):
    """Some of the changes, by chance."""
    chosen = random.Random(1).sample(list(mutants(rows)), 40)
    n_refused, n_read = read_mutants(study, chosen)
    assert n_refused > 15
    assert n_read > 2


def test_changed_trials_of_a_command_end_in_one_message_or_are_read(tmp_path):
    path = tmp_path / "saved.sqlite"
    with open_saved_trials(path, HEAD) as ledger:
        for number, end in enumerate(("step limit", "lost", "driven", "running")):
            ledger.append(replace(saved_trial(number), purpose="controller", genome="{}", end=end))
        ledger.note("a new pen", "anna", 1)
    n_refused = n_read = 0
    for name, these in random.Random(1).sample(list(mutants(rows_of(path))), 60):
        try:
            write_ledger(path, these)
        except sqlite3.Error:
            continue
        try:
            observations = read_observations(path)
            _driven_trials(path, ())
            n_read += bool(observations.trials)
        except RealityGapError:
            n_refused += 1
        except Exception as error:
            raise AssertionError(f"{name}: {type(error).__name__}: {error}") from error
        for words in (("list",), ("list", "--json"), ("show", "1"), ("agreement",)):
            done = CliRunner().invoke(TRIALS, ["trials", words[0], str(path), *words[1:]])
            if done.exception is not None and not isinstance(done.exception, RealityGapError):
                raise AssertionError(f"{name}: {words}") from done.exception
    assert n_refused > 10
    assert n_read > 2


@pytest.mark.long
def test_each_change_of_a_ledger_ends_in_one_message_or_is_read(study, rows):
    n_refused, n_read = read_mutants(study, mutants(rows))
    assert n_refused > 1000
    assert n_read > 100


@pytest.mark.slow
def test_message_names_the_row_that_does_not_fit(study, rows, tmp_path):
    """In each case, a report or an export had ended in a traceback."""

    def changed(table: str, place: int, **values: Any) -> Rows:
        these = rows[table]
        return rows | {table: [*these[:place], these[place] | values, *these[place + 1 :]]}

    def without(table: str, place: int) -> Rows:
        return rows | {table: rows[table][:place] + rows[table][place + 1 :]}

    for these, expected in (
        (
            changed("scores", 0, path="[[0,0]]"),
            r"table scores, id 1: path is '\[\[0,0\]\]', expected a list of \[x, y",
        ),
        (changed("individuals", 1, trial=None), r"table individuals, .*individual 1: score is"),
        (changed("individuals", 1, score=99), r"table individuals, .*individual 1: score is 99"),
        (changed("scores", 0, undone="2026"), r"table trials, id 1: state is 'scored'"),
        (changed("steps", 1, raw="[1]"), r"table steps, trial 1, step 1: raw is"),
        (changed("steps", 1, step=9), r"table (trials|steps)"),
        (
            changed("trials", 0, condition="other"),
            r"table trials: row 1 refers to a row that is not in table",
        ),
        (without("individuals", 0), r"table trials: row 1 refers"),
        (without("scores", 0), r"table trials, id 1: state is 'scored'"),
        (without("trials", 5), r"refers to a row that is not in table trials"),
        (without("generations", 0), r"refers to a row that is not in table generations"),
    ):
        write_ledger(study / LEDGER_NAME, these)
        with pytest.raises(LedgerError, match=expected):
            Ledger.open(study / LEDGER_NAME)
    for words in (["report"], ["trials", "list"], ["export-trials", "-o", str(tmp_path / "bags")]):
        done = run_command(*words, str(study))
        assert done.returncode == 1
        assert done.stderr.count("\n") == 1
        assert "table generations" in done.stderr


@pytest.mark.slow
def test_hostile_ledger_affects_the_card_of_its_own_study_only(study, rows, monkeypatch):
    """One takes too long to read, another one cannot be read at all."""
    root = study.parent
    write_ledger(study / LEDGER_NAME, rows)
    for name in ("slow", "torn"):
        shutil.rmtree(root / name, ignore_errors=True)
        shutil.copytree(study, root / name)
    (root / "torn" / LEDGER_NAME).write_bytes(b"SQLite format 3")
    ends = threading.Event()
    usual = _ledger_file.check_ledger

    def check(connection: sqlite3.Connection, path: Path) -> None:
        if path.parent.name == "slow":
            ends.wait(60)
        usual(connection, path)

    monkeypatch.setattr(_ledger_file, "check_ledger", check)
    monkeypatch.setattr(_studies, "PATIENCE_S", 1.0)
    studies = Studies(root)
    try:
        states = {state.name: state for state in studies.states()}
        assert "still being read" in states["slow"].problem
        assert "ledger" in states["torn"].problem
        assert "still being read" not in states["torn"].problem
    finally:
        ends.set()
