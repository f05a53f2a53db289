"""Ledgers whose rows do not fit together, or whose schema is foreign: one message, or success, never a traceback."""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from typer.main import get_command

from realitygap.cli._app import make_app
from realitygap.cli._commands import COMMANDS
from realitygap.errors import LedgerError, RealityGapError
from realitygap.lab._counts import Counts
from realitygap.lab._studies import Studies
from realitygap.records import LEDGER_NAME, Ledger, ResultsFolder, Score, ledger_tables
from realitygap.report import summarize
from realitygap.report._driven import describe_driven, driven_paths, read_driven
from realitygap.study import run_study
from realitygap.study._trial_bags import _driven, _trial
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
    with contextlib.closing(sqlite3.connect(study / LEDGER_NAME)) as connection:
        connection.row_factory = sqlite3.Row
        return {
            table: [dict(row) for row in connection.execute(f"SELECT * FROM {table}")]
            for table in ledger_tables()
        }


def write_ledger(path: Path, rows: Rows) -> None:
    """Write a ledger with our schema and any rows, also such as SQLite itself would refuse."""
    for ending in ("", "-wal", "-shm"):
        path.with_name(path.name + ending).unlink(missing_ok=True)
    Ledger.create(path).close()
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
        for place in sorted({0, len(these) - 1}):
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
        lambda: [_trial(study, number) for number in _driven(study)],
        lambda: [counts.card(trial.number, "carla", "second") for trial in counts.look()],
    ):
        with contextlib.suppress(RealityGapError):
            read()
    assert Studies(study.parent).state(study.name).title
