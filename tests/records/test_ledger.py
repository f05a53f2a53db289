"""The ledger of physical trials: nothing is lost, nothing is deleted, and what is closed stays."""

from __future__ import annotations

import _thread
import random
import shutil
import sqlite3
import threading
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from realitygap.errors import LedgerError, RecordVersionError
from realitygap.records import (
    SCHEMA,
    Generation,
    Individual,
    Ledger,
    Score,
    TrialRecord,
    Turn,
    _ledger_file,
    complete_runs,
    ledger_frame,
    ledger_tables,
)

GENOME = {
    "hidden": [], "biases": [], "innovation": [0, 1], "source": [0, 1], "target": [3, 4], "weight": [0.5, -1.25],
    "enabled": [True, False],
}  # fmt: skip
RECORD = TrialRecord(
    start=(0.0, 0.0, 0.0),
    step_s=0.5,
    commands=np.array([[0.25, -1.0], [0.5, 0.125]]),
    readings=np.array([[0.0, 1.0, 0.007], [0.25, 0.0, 1.0]]),
    stalled=np.array([True, False]),
    last_readings=np.array([0.5, 0.75, 0.0]),
    last_stalled=True,
    times=np.array([0.25, 0.75, 1.5]),
    raw=np.array([[0.0, 1700.0, 12.0], [400.0, 0.0, 6400.0], [800.0, 1200.0, 0.0]]),
)
CUT = replace(
    RECORD,
    commands=RECORD.commands[:1],
    readings=RECORD.readings[:1],
    stalled=RECORD.stalled[:1],
    last_readings=np.empty(0),
    last_stalled=False,
    times=RECORD.times[:1],
    raw=RECORD.raw[:1],
    end="aborted",
    problem="no answer",
)


def new_ledger(path, n=2, n_generations=1):
    ledger = Ledger.create(path / "ledger.sqlite")
    ledger.add_condition("a", "hash", {"noise": 0.0}, n_generations=n_generations, n_cells=72)
    plan(ledger, 0, n)
    return ledger


def plan(ledger, generation, n=2):
    individuals = [Individual(k, 0, [], 5, GENOME, 2**64 - 1) for k in range(n)]
    turns = [Turn("a", 0, generation, k, generation + 1, k, f"C{generation}{k}") for k in range(n)]
    ledger.plan([Generation("a", 0, generation, individuals)], turns)


def sit(ledger, label="EMULATED"):
    return ledger.begin_sitting(label, "port", {"name": "Fake"}, {}, ["a"])


def drive(ledger, number, cells=(13, 14)):
    ledger.start(number, sit(ledger))
    ledger.finish(number, RECORD, Score(cells, "witness", n_ends=1))


@pytest.fixture
def ledger(tmp_path):
    with new_ledger(tmp_path) as ledger:
        yield ledger


def assert_driven(record, expected):
    """What a robot did and saw is as it was given to the ledger."""
    for name in ("commands", "readings", "stalled", "last_readings", "last_stalled", "times", "raw"):
        np.testing.assert_array_equal(getattr(record, name), getattr(expected, name), err_msg=name)
    assert (record.end, record.problem) == (expected.end, expected.problem)


def states(ledger):
    return [(trial.individual, trial.attempt, trial.state) for trial in ledger.trials()]


@pytest.mark.parametrize("verdict", ["void", "driven"])
def test_an_interrupted_trial_keeps_its_steps_and_is_settled(ledger, verdict):
    ledger.start(1, sit(ledger))
    ledger.interrupt(1, CUT)
    trial = ledger.trial(1)
    assert (trial.state, trial.end, trial.n_steps) == ("running", "aborted", 1)
    assert_driven(ledger.record(1), CUT)
    assert ledger.events()[-1]["what"] == "interrupted"
    assert ledger.events()[-1]["details"] == {"end": "aborted", "problem": "no answer"}
    ledger.settle(1, verdict, "it stood at the wall")
    assert ledger.trial(1).state == verdict
    assert ((0, 1, "planned") in states(ledger)) == (verdict == "void")
    assert "it stood at the wall" in str(ledger.events())


def test_undoing_a_score_is_an_event(ledger):
    drive(ledger, 1)
    ledger.undo(1)
    assert (ledger.trial(1).state, ledger.events()[-1]["what"]) == ("driven", "undone")


def test_a_trial_goes_from_planned_to_scored(ledger):
    number = ledger.trials()[0].trial
    ledger.start(number, sit(ledger))
    assert ledger.trial(number).state == "running"
    ledger.finish(number, RECORD)
    assert (ledger.trial(number).state, ledger.trial(number).n_steps) == ("driven", 2)
    assert ledger.trial(number).stalls == 1
    assert_driven(ledger.record(number), RECORD)
    ledger.score(number, Score([14, 13, 14], "anna"))
    assert (ledger.trial(number).state, ledger.trial(number).cells) == ("scored", (14, 13))
    assert [event["what"] for event in ledger.events()] == [
        "planned",
        "planned",
        "running",
        "driven",
        "scored",
    ]


def test_a_void_trial_stays_and_another_is_planned(ledger):
    drive(ledger, 1)
    ledger.void(1, "the pen fell out")
    assert states(ledger) == [(0, 0, "void"), (0, 1, "planned"), (1, 0, "planned")]
    again = ledger.trials()[1]
    assert (again.code, again.place, again.sheet) == ("C00-2", 1, 1)
    assert ledger.trial(1).reason == "the pen fell out"
    drive(ledger, 2)
    with pytest.raises(LedgerError, match="Give a reason"):
        ledger.void(2, " ")


def test_a_score_can_be_taken_back_and_is_kept_all_the_same(ledger):
    drive(ledger, 1)
    ledger.undo(1)
    assert ledger.trial(1).cells is None
    ledger.score(1, Score([20], "anna"))
    assert ledger.trial(1).cells == (20,)
    assert [(row["cells"], row["undone"] is None) for row in ledger.scores()] == [
        ([13, 14], False),
        ([20], True),
    ]


def test_closing_freezes_the_scores(ledger):
    for number in (1, 2):
        drive(ledger, number)
    ledger.close_generation("a", 0, 0, [0.5, 0.25], [None, None])
    for forbidden in (
        lambda: ledger.undo(1),
        lambda: ledger.void(1, "why not"),
        lambda: ledger.close_generation("a", 0, 0, [0.5, 0.25], [None, None]),
    ):
        with pytest.raises(LedgerError, match="is closed"):
            forbidden()
    ledger.score(1, Score([1, 2, 3], "ben"), "correction")
    rows = ledger.individuals("a", 0, 0)
    assert [row["cells"] for row in rows] == [[13, 14], [13, 14]], "resuming ignores corrections"
    frame = ledger_frame(ledger, "a")
    assert frame.schema == SCHEMA
    assert frame["cells"].to_list() == [[1, 2, 3], [13, 14]], "reports use them"
    assert frame["fitness"].to_list() == [0.5, 0.25]
    assert frame["key"].to_list() == [2**64 - 1] * 2
    assert frame["connections"].to_list() == [1, 1]
    assert frame["coverage_line"].to_list() == [3 / 72, 2 / 72]
    assert frame["coverage_ends"].to_list() == [1 / 72, 1 / 72], "a correction is of cells on the line"


def test_rows_have_no_coverage_of_ends_that_nobody_saw(ledger):
    for number in (1, 2):
        ledger.start(number, sit(ledger))
        ledger.finish(number, RECORD, Score((13, 14), "anna"))
    ledger.close_generation("a", 0, 0, [0.5, 0.25], [None, None])
    assert ledger_frame(ledger, "a")["coverage_ends"].to_list() == [None, None]


def changed_schema(ledger, name, old, new):
    """Change the SQL of a table or trigger, as only somebody who means harm does."""
    with sqlite3.connect(ledger.path) as other:
        (sql,) = other.execute("SELECT sql FROM sqlite_schema WHERE name = ?", (name,)).fetchone()
        assert old in sql
        other.execute("PRAGMA writable_schema = ON")
        other.execute("UPDATE sqlite_schema SET sql = ? WHERE name = ?", (sql.replace(old, new, 1), name))
    other.close()


SLOW = "(instr(hex(zeroblob(60000000)), '1') = 0)"


def test_foreign_schema_is_refused_before_any_row_is_read(tmp_path):
    """Each would run with the first query, or let through what ours refuses."""
    changes = {
        "a generated column": ("conditions", "label TEXT", f"more INT AS ({SLOW}), label TEXT"),
        "a CHECK constraint": ("conditions", "hash TEXT NOT NULL", f"hash TEXT NOT NULL CHECK {SLOW}"),
        "a default": ("conditions", "label TEXT", "label TEXT DEFAULT 'REAL'"),
        "a collation": ("conditions", "name TEXT", "name TEXT COLLATE NOCASE"),
        "no constraint": (
            "trials",
            " CHECK (state IN ('planned', 'running', 'driven', 'scored', 'void'))",
            "",
        ),
        "a comment of another form": ("notes", "text TEXT", f"text TEXT /* -- */ CHECK {SLOW} /*\n*/"),
        "a comment in a text": ("trials", "'planned'", "'plan--' OR 1 OR '\nned'"),
        "a space of another kind": ("notes", "text TEXT", "text\xa0TEXT"),
        "another trigger": ("closed_generations_stay", "OLD.closed IS NOT NULL", "0"),
    }
    more = {
        "a table": "CREATE TABLE more (id)",
        "a view": "CREATE VIEW more AS SELECT 1",
        "an index": f"CREATE INDEX more ON conditions ({SLOW})",
        "a trigger": "CREATE TRIGGER more AFTER INSERT ON notes BEGIN SELECT 1; END",
        "a missing trigger": "DROP TRIGGER notes_stay",
    }
    for name in (*changes, *more):
        folder = tmp_path / name
        folder.mkdir()
        with new_ledger(folder) as ledger:
            if name in changes:
                changed_schema(ledger, *changes[name])
            else:
                with sqlite3.connect(ledger.path) as other:
                    other.execute(more[name])
                other.close()
        for writable in (True, False):
            with pytest.raises(LedgerError, match=r"realitygap did not make|is missing"):
                Ledger.open(ledger.path, writable=writable)


def test_ledger_opens_whose_comments_and_spaces_are_those_of_an_earlier_version(ledger):
    changed_schema(ledger, "conditions", "from its first trial on", "from its first sitting on, 'or later'")
    changed_schema(ledger, "scores", "at quarters of steps", "at the ends of steps")
    changed_schema(ledger, "notes", "    id INTEGER", "\n\tid   INTEGER")
    with Ledger.open(ledger.path) as again:
        assert len(again.trials()) == 2


ENDLESS = "WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n) SELECT count(*) FROM n"


def test_query_ends_at_the_deadline_and_with_ctrl_c(ledger, monkeypatch):
    timer = threading.Timer(0.2, _thread.interrupt_main)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        ledger._all(ENDLESS)
    timer.join()
    monkeypatch.setattr(_ledger_file, "MOST_READING_S", 0.1)
    with pytest.raises(LedgerError, match="cannot be read within"):
        ledger._all(ENDLESS)
    monkeypatch.undo()
    assert len(ledger.trials()) == 2, "the next query has time again"
    ledger.note("and may write", "anna")


def test_checks_end_at_the_deadline(ledger, monkeypatch):
    with sqlite3.connect(ledger.path) as other:
        other.executemany(
            "INSERT INTO notes (text, who, time) VALUES (?, 'anna', '')", [("x" * 100,)] * 20_000
        )
    other.close()
    monkeypatch.setattr(_ledger_file, "MOST_READING_S", -1.0)
    monkeypatch.setattr(_ledger_file, "_N_OPERATIONS", 1000)
    with pytest.raises(LedgerError, match="cannot be read within"):
        Ledger.open(ledger.path, writable=False)


def test_ledger_is_checked_once_until_it_changes(ledger, monkeypatch):
    n_checks = []
    monkeypatch.setattr(_ledger_file, "check_ledger", lambda *_: n_checks.append(1))
    monkeypatch.setattr(_ledger_file, "_SETTLED_S", -10.0)
    for _ in range(3):
        Ledger.open(ledger.path).close()
    assert len(n_checks) == 1
    ledger.note("the floor was wet", "anna")
    Ledger.open(ledger.path).close()
    assert len(n_checks) == 2


def test_tables_are_listed_by_name_with_what_makes_them(ledger):
    tables = ledger_tables()
    base = sqlite3.connect(ledger.path)
    assert set(tables) == {
        name for (name,) in base.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")
    }
    base.close()
    empty = sqlite3.connect(":memory:")
    for sql in tables.values():
        empty.execute(sql)
    assert len(empty.execute("SELECT name FROM sqlite_schema WHERE type = 'table'").fetchall()) == len(tables)
    empty.close()


def test_a_ledger_that_cannot_be_made_leaves_no_file(tmp_path, monkeypatch):
    monkeypatch.setattr(_ledger_file, "SCHEMA", "no SQL")
    with pytest.raises(LedgerError, match="syntax error"):
        Ledger.create(tmp_path / "ledger.sqlite")
    assert list(tmp_path.iterdir()) == []


def test_closing_refuses_fitness_of_other_cells(ledger):
    for number in (1, 2):
        drive(ledger, number)
    with pytest.raises(LedgerError, match=r"Other cells of trials \[2\]"):
        ledger.close_generation("a", 0, 0, [0.5, 0.25], [None, None], cells=[[13, 14], [13]])
    assert ledger.generations("a", 0) == [(0, False)]
    ledger.close_generation("a", 0, 0, [0.5, 0.25], [None, None], cells=[[13, 14], [13, 14]])


def test_scores_of_a_sheet_are_entered_together_or_not_at_all(ledger):
    for number in (1, 2):
        ledger.start(number, sit(ledger))
        ledger.finish(number, RECORD)
    with pytest.raises(LedgerError, match="Cell 72 is outside"):
        ledger.score_all({1: Score([1], "anna"), 2: Score([72], "anna")})
    assert [trial.state for trial in ledger.trials()] == ["driven", "driven"]
    ledger.score_all({1: Score([1], "anna"), 2: Score([71], "anna")})
    assert [trial.cells for trial in ledger.trials()] == [(1,), (71,)]


def test_nobody_is_their_own_second_counter(ledger):
    drive(ledger, 1)
    with pytest.raises(LedgerError, match="'witness' already counted the cells of trial 1"):
        ledger.score(1, Score([1], "witness"), "second")
    ledger.score(1, Score([1], "ben"), "second")
    ledger.undo(1)
    ledger.score(1, Score([1, 2], "anna"))
    ledger.score(1, Score([1], "witness"), "second")


def test_the_robots_are_those_that_drove(ledger):
    ledger.start(1, sit(ledger))
    ledger.begin_sitting("EMULATED", "port", {"name": "Idle"}, {}, ["a"])
    ledger.start(2, ledger.begin_sitting("EMULATED", "port", {"name": "Other"}, {}, ["a"]))
    assert ledger.robots() == [{"name": "Fake"}, {"name": "Other"}]


def test_a_generation_with_an_unscored_trial_is_not_closed(ledger):
    drive(ledger, 1)
    with pytest.raises(LedgerError, match=r"individuals \[1\] are not scored"):
        ledger.close_generation("a", 0, 0, [0.5, 0.25], [None, None])
    assert ledger.generations("a", 0) == [(0, False)]


def test_a_correction_before_closing_is_refused(ledger):
    drive(ledger, 1)
    with pytest.raises(LedgerError, match="withdraw its score"):
        ledger.score(1, Score([1], "ben"), "correction")


def test_only_complete_runs_are_rows(tmp_path):
    with new_ledger(tmp_path, n_generations=2) as ledger:
        for number in (1, 2):
            drive(ledger, number)
        ledger.close_generation("a", 0, 0, [0.5, 0.25], [None, None])
        assert complete_runs(ledger, "a") == []
        assert ledger_frame(ledger, "a").is_empty()
        plan(ledger, 1)
        for number in (3, 4):
            drive(ledger, number)
        ledger.close_generation("a", 0, 1, [0.5, 0.25], [None, None])
        assert complete_runs(ledger, "a") == [0]
        assert ledger_frame(ledger, "a").height == 4


@pytest.mark.parametrize("table", ["trials", "scores", "notes", "events", "steps", "individuals", "sittings"])
def test_the_file_itself_lets_nothing_be_deleted(ledger, table):
    drive(ledger, 1)
    ledger.note("a note", "anna", 1)
    with sqlite3.connect(ledger.path) as other, pytest.raises(sqlite3.IntegrityError, match="ever deleted"):
        other.execute(f"DELETE FROM {table}")


@pytest.mark.parametrize(
    ("do", "said"),
    [
        (
            lambda ledger: ledger.score(1, Score([1], "anna")),
            "is planned; that can be done only while it is driven",
        ),
        (lambda ledger: ledger.start(9, 1), "has no trial 9: its trials are 1 to 2"),
        (lambda ledger: ledger.undo(1), "only while it is scored"),
        (lambda ledger: ledger.settle(1, "void", "x"), "only while it is running"),
        (lambda ledger: ledger.note("x", "anna", 9), "has no trial 9"),
        (lambda ledger: plan(ledger, 0), "does not allow that"),
        (
            lambda ledger: ledger.add_condition("a", "other", {}, n_generations=1, n_cells=72),
            "other settings",
        ),
    ],
)
def test_refused_actions_change_nothing(ledger, do, said):
    before = (ledger.trials(), ledger.events())
    with pytest.raises(LedgerError, match=said):
        do(ledger)
    assert (ledger.trials(), ledger.events()) == before


def test_the_label_is_that_of_the_first_trial(ledger):
    emulated, real = sit(ledger), sit(ledger, "REAL")
    assert ledger.conditions()["a"]["label"] is None, "nothing was driven yet"
    ledger.start(1, real)
    assert ledger.conditions()["a"]["label"] == "REAL"
    for mixing in (lambda: sit(ledger), lambda: ledger.start(2, emulated)):
        with pytest.raises(
            LedgerError, match=r"are REAL, but this robot's would be EMULATED\. They cannot be combined"
        ):
            mixing()
    assert ledger.trial(2).state == "planned"


# files


def test_a_ledger_is_never_replaced(ledger):
    with pytest.raises(LedgerError, match="exists already"):
        Ledger.create(ledger.path)


def test_no_ledger_is_one_clear_error(tmp_path):
    with pytest.raises(LedgerError, match="There is no ledger at"):
        Ledger.open(tmp_path / "ledger.sqlite")


@pytest.mark.parametrize("data", [b"", b"SQLite format 3\0" + bytes(500), b"hello", bytes(5000)])
def test_a_foreign_or_torn_file_is_refused_and_left_alone(tmp_path, data):
    path = tmp_path / "ledger.sqlite"
    path.write_bytes(data)
    with pytest.raises(LedgerError, match=r"was not changed\. Restore"):
        Ledger.open(path)
    assert path.read_bytes() == data


def test_somebody_elses_database_is_refused(tmp_path):
    path = tmp_path / "ledger.sqlite"
    with sqlite3.connect(path) as other:
        other.execute("CREATE TABLE trials (id)")
    with pytest.raises(LedgerError, match="not a ledger of realitygap"):
        Ledger.open(path)


def test_every_torn_page_is_found_or_harmless(tmp_path):
    """A page of zeros anywhere: opening says so, or everything reads as it was."""
    with new_ledger(tmp_path) as ledger:
        drive(ledger, 1)
        wanted = (ledger.trials(), ledger.scores())
    whole = (tmp_path / "ledger.sqlite").read_bytes()
    n_refused = 0
    for start in range(0, len(whole), 4096):
        path = tmp_path / f"torn-{start}" / "ledger.sqlite"
        path.parent.mkdir()
        path.write_bytes(whole[:start] + bytes(4096) + whole[start + 4096 :])
        said = ""
        try:
            with Ledger.open(path) as ledger:
                assert (ledger.trials(), ledger.scores()) == wanted
        except LedgerError as error:
            said = str(error)
        assert not said or "Restore" in said
        n_refused += bool(said)
    assert n_refused >= 5


def test_a_ledger_cut_off_is_refused(tmp_path):
    with new_ledger(tmp_path):
        pass
    path = tmp_path / "ledger.sqlite"
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(LedgerError, match="is damaged"):
        Ledger.open(path)


def test_random_bytes_are_refused_in_one_message_or_harmless(tmp_path):
    """Bytes changed anywhere, within texts too: opening and reading end in our error or in values."""
    with new_ledger(tmp_path) as ledger:
        drive(ledger, 1)
    whole = (tmp_path / "ledger.sqlite").read_bytes()
    n_refused = 0
    for seed in range(60):
        rng = random.Random(seed)
        data = bytearray(whole)
        for _ in range(rng.choice([1, 20])):
            at = rng.randrange(len(data))
            data[at : at + 4] = rng.randbytes(4)
        path = tmp_path / "changed.sqlite"
        path.write_bytes(data)
        said = "Restore"
        try:
            with Ledger.open(path, writable=False) as ledger:
                read = (ledger.trials(), ledger.scores(), ledger.sittings(), ledger.record(1))
                read += (ledger.individuals("a", 0, 0), ledger.notes())
        except LedgerError as error:
            n_refused += 1
            said = str(error)
        assert "Restore" in said, seed
        assert path.read_bytes() == data
    assert n_refused >= 20


@pytest.mark.parametrize("changed", ["[13,", b"[13,\xff]"])
def test_text_that_is_no_json_is_a_torn_ledger(ledger, changed):
    drive(ledger, 1)
    with sqlite3.connect(ledger.path) as other:
        other.execute("UPDATE scores SET cells = CAST(? AS TEXT)", (changed,))
    with pytest.raises(LedgerError, match=r"is damaged .*, and was not changed\. Restore"):
        Ledger.open(ledger.path)


def test_another_format_is_refused(ledger):
    with sqlite3.connect(ledger.path) as other:
        other.execute("PRAGMA user_version = 3")
    with pytest.raises(RecordVersionError, match="format 3; this realitygap reads formats 1 and 2"):
        Ledger.open(ledger.path)


def test_a_locked_ledger_is_one_clear_error(ledger, monkeypatch):
    ledger._connection.execute("PRAGMA busy_timeout = 50")
    other = sqlite3.connect(ledger.path, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    with pytest.raises(LedgerError, match="another program has been writing to it"):
        ledger.note("a note", "anna")
    other.execute("ROLLBACK")
    other.close()
    ledger.note("a note", "anna")


def test_readers_read_while_somebody_writes(ledger):
    drive(ledger, 1)
    with Ledger.open(ledger.path, writable=False) as reader:
        drive(ledger, 2)
        assert [trial.state for trial in reader.trials()] == ["scored", "scored"]
        with pytest.raises(LedgerError, match="Could not write"):
            reader.note("a note", "anna")


def test_two_writers_take_turns(ledger):
    def write(name):
        with Ledger.open(ledger.path) as own:
            for k in range(20):
                own.note(f"{name} {k}", name)

    threads = [threading.Thread(target=write, args=(name,)) for name in ("anna", "ben")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(ledger.notes()) == 40


def test_committed_rows_survive_a_copy_of_the_files_at_any_moment(tmp_path):
    """As after a loss of power: the database and its log of writes as they lie on the disk, without a proper end."""
    ledger = new_ledger(tmp_path)
    drive(ledger, 1)
    copy = tmp_path / "copy"
    copy.mkdir()
    for path in tmp_path.glob("ledger.sqlite*"):
        if not path.name.endswith("-shm"):
            shutil.copy(path, copy / path.name)
    with Ledger.open(copy / "ledger.sqlite") as found:
        assert found.trials() == ledger.trials()
    ledger.close()


# anything, in any order


class AnyOrder(RuleBasedStateMachine):
    """What is done in any order leaves a ledger that a plain model agrees with."""

    @initialize(folder=st.uuids())
    def begin(self, folder):
        import tempfile
        from pathlib import Path

        self.folder = Path(tempfile.mkdtemp())
        self.ledger = new_ledger(self.folder)
        self.sitting = sit(self.ledger)
        self.model = {1: ["planned", None], 2: ["planned", None]}
        self.n_scores = 0
        self.is_closed = False

    def teardown(self):
        if hasattr(self, "ledger"):
            self.ledger.close()
            shutil.rmtree(self.folder)

    def _try(self, allowed, do):
        if allowed:
            do()
            return True
        before = (self.ledger.trials(), self.ledger.events())
        with pytest.raises(LedgerError):
            do()
        assert (self.ledger.trials(), self.ledger.events()) == before
        return False

    trials = st.integers(1, 4)

    @rule(number=trials)
    def start(self, number):
        state = self.model.get(number, [None])[0]
        if self._try(state == "planned", lambda: self.ledger.start(number, self.sitting)):
            self.model[number][0] = "running"

    @rule(number=trials)
    def finish(self, number):
        state = self.model.get(number, [None])[0]
        if self._try(state == "running", lambda: self.ledger.finish(number, RECORD)):
            self.model[number][0] = "driven"

    @rule(number=trials, cells=st.lists(st.integers(0, 71), min_size=1, max_size=4, unique=True))
    def score(self, number, cells):
        state = self.model.get(number, [None])[0]
        if self._try(state == "driven", lambda: self.ledger.score(number, Score(cells, "anna"))):
            self.model[number] = ["scored", tuple(cells)]
            self.n_scores += 1

    @rule(number=trials)
    def undo(self, number):
        state = self.model.get(number, [None])[0]
        if self._try(state == "scored" and not self.is_closed, lambda: self.ledger.undo(number)):
            self.model[number] = ["driven", None]

    @rule(number=trials)
    def void(self, number):
        state = self.model.get(number, [None])[0]
        allowed = state in ("running", "driven", "scored") and not self.is_closed
        if self._try(allowed, lambda: self.ledger.void(number, "why not")):
            self.model[number][0] = "void"
            self.model[max(self.model) + 1] = ["planned", None]

    @rule()
    def reopen(self):
        self.ledger.close()
        self.ledger = Ledger.open(self.folder / "ledger.sqlite")

    @precondition(lambda self: hasattr(self, "model"))
    @rule()
    def close(self):
        counted = [state for state, _ in self.model.values() if state != "void"]
        allowed = not self.is_closed and counted == ["scored", "scored"]
        if self._try(allowed, lambda: self.ledger.close_generation("a", 0, 0, [0.5, 0.25], [None, None])):
            self.is_closed = True

    @invariant()
    def agrees_with_the_model(self):
        if not hasattr(self, "model"):
            return
        found = {trial.trial: [trial.state, trial.cells] for trial in self.ledger.trials()}
        for number, (state, cells) in self.model.items():
            assert found[number][0] == state
            if state == "scored":
                assert found[number][1] == cells
        assert len(found) == len(self.model)
        assert len(self.ledger.scores()) == self.n_scores, "nothing is ever deleted"


TestAnyOrder = AnyOrder.TestCase
TestAnyOrder.settings = settings(
    max_examples=25, stateful_step_count=25, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
