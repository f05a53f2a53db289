"""The trials of a ledger as pages see them: as new as the ledger, and read only when it has changed."""

from __future__ import annotations

import os
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from realitygap.errors import LedgerError
from realitygap.lab._counts import Counts
from realitygap.records import LEDGER_NAME, Generation, Individual, Ledger, ResultsFolder, Turn

from .robot_study import make_study

CONDITION = "coverage-robot"
GENOME = {
    "hidden": [],
    "biases": [],
    "innovation": [0],
    "source": [0],
    "target": [3],
    "weight": [0.5],
    "enabled": [True],
}


def plan(ledger: Ledger) -> None:
    """Two trials to be driven."""
    turns = [Turn(CONDITION, 0, 0, k, 1, k, f"C{k}") for k in range(2)]
    ledger.plan([Generation(CONDITION, 0, 0, [Individual(k, 0, [], 5, GENOME, 1) for k in range(2)])], turns)


def begin(folder: Path) -> Ledger:
    ledger = Ledger.create(folder / LEDGER_NAME)
    ledger.add_condition(CONDITION, "hash", {}, n_generations=2, n_cells=72)
    return ledger


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A study of which no trial is planned."""
    return make_study(tmp_path)


@pytest.fixture
def counts(folder: Path) -> Counts:
    return Counts(folder, ResultsFolder.open(folder).description)


def test_changes_by_another_program_are_seen_and_nothing_is_read_twice(folder, counts):
    assert counts.look() == []
    with begin(folder) as ledger:
        assert counts.look() == []
        plan(ledger)
        found = counts.look()
        assert [each.number for each in found] == [1, 2]
        assert counts.look() is found
        ledger.note("it squeaks", "anna", 1)
        assert counts.look() is not found
        assert counts.trial(1).notes == ("anna: it squeaks",)
    counts.note(2, "so does this", "ben")
    assert counts.trial(2).notes == ("ben: so does this",)


def test_a_change_is_seen_though_sizes_and_times_of_the_files_are_as_they_were(folder, counts):
    """As they are for who looks while a disk is still at work: files change before what is in them can be read."""
    path = folder / LEDGER_NAME
    files = [path, path.with_name(path.name + "-wal")]
    with begin(folder) as ledger:
        plan(ledger)
        ledger.note("one", "anna", 1)
        with closing(sqlite3.connect(path)) as other:
            other.execute("PRAGMA wal_checkpoint(RESTART)").fetchone()  # what comes goes where it went before
        counts.look()
        assert counts.trial(1).notes == ("anna: one",)
        before = [(each.stat().st_size, each.stat().st_mtime_ns) for each in files]
        ledger.note("two", "anna", 1)
        for each, (_, time) in zip(files, before, strict=True):
            os.utime(each, ns=(time, time))
        assert [(each.stat().st_size, each.stat().st_mtime_ns) for each in files] == before
        counts.look()
        assert counts.trial(1).notes == ("anna: one", "anna: two")


def test_a_ledger_restored_from_a_copy_is_read_anew(folder, counts):
    path = folder / LEDGER_NAME
    with begin(folder) as ledger:
        plan(ledger)
    shutil.copy(path, folder / "copy")
    counts.look()
    counts.note(1, "after the copy", "anna")
    assert counts.trial(1).notes
    (folder / "copy").replace(path)
    counts.look()
    assert counts.trial(1).notes == ()


def test_a_torn_ledger_is_told_each_time_until_it_is_whole(folder, counts):
    path = folder / LEDGER_NAME
    with begin(folder) as ledger:
        plan(ledger)
    whole = path.read_bytes()
    path.write_bytes(whole[:4096] + b"\0" * (len(whole) - 4096))
    for _ in range(2):
        with pytest.raises(LedgerError, match="is damaged"):
            counts.look()
    path.write_bytes(whole)
    assert len(counts.look()) == 2
