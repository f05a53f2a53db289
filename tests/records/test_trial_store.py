"""Trials that a command saved: they are durable, settled, scored, voided, and annotated like those of a study."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from realitygap.errors import RecordError
from realitygap.records import (
    Ledger,
    ObservationsHead,
    RecordWarning,
    Score,
    TrialRecord,
    _ledger_file,
    _ledger_reader,
    is_observations,
    ledger_stamp,
    open_ledger,
    open_saved_trials,
    read_observations,
    those_that_count,
    write_observations,
)
from tests.records.test_observations_file import HEAD, robot_trial, same, trial

CONTROLLERS: ObservationsHead = replace(HEAD, observe="cells")
KNOWN = replace(HEAD, identity="s2, Fluke 2, BoxOnWheels")
STORED = Path(__file__).parent / "stored"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Trials: one that counts, one that was lost and repeated, one that waits for a count, and one under way."""
    path = tmp_path / "tried.sqlite"
    with open_saved_trials(path, CONTROLLERS) as ledger:
        for number, ends in enumerate((["step limit"], ["lost", "step limit"], ["driven"], ["running"])):
            for end in ends:
                ledger.append(of_controller(number, end))
    return path


def of_controller(number: int, end: str) -> TrialRecord:
    cells = (3, 7) if end == "step limit" else ()
    return replace(trial(number), purpose="controller", genome="{}", end=end, cells=cells)


def states(path: Path) -> list[str]:
    with open_ledger(path, writable=False) as ledger:
        return [each.state for each in ledger.trials()]


def counting(path: Path) -> list[int]:
    return [each.number for each in those_that_count(read_observations(path).trials)]


def test_trials_come_back_as_they_were(tmp_path: Path) -> None:
    trials = [
        trial(0),
        trial(1, 0),
        replace(robot_trial(3), problem=""),
        replace(trial(4), end_pose=(0.1, 0.2, 7.0)),
    ]
    with open_saved_trials(tmp_path / "one.sqlite", HEAD) as ledger:
        for each in trials:
            ledger.append(each)
    found = read_observations(tmp_path / "one.sqlite")
    assert found.head.to_dict() == HEAD.to_dict()
    assert all(same(*pair) for pair in zip(found.trials, trials, strict=True))


def test_a_trial_is_on_the_disk_when_append_returns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert _ledger_file.SYNCHRONOUS == "FULL"
    with open_saved_trials(tmp_path / "one.sqlite", HEAD) as ledger:
        for number in range(3):
            ledger.append(trial(number))
            copy = tmp_path / f"copy-{number}.sqlite"
            for ending in ("", "-wal"):  # as after a power cut
                shutil.copyfile(f"{ledger.path}{ending}", f"{copy}{ending}")
            assert len(read_observations(copy).trials) == number + 1


def test_each_trial_has_the_state_of_its_last_record(path: Path) -> None:
    assert states(path) == ["scored", "void", "scored", "driven", "running"]
    with open_ledger(path) as ledger:
        assert [each.trial for each in ledger.trials(states=["driven", "running"])] == [4, 5]
        assert ledger.trial(1).name == "controller, controller 1"
        assert ledger.trial(3).name == "controller, controller 1 (attempt 2)"
        assert (ledger.trial(1).cells, ledger.trial(4).cells) == ((3, 7), None)
        assert ledger.trial(2).reason == "lost"
        assert [event["what"] for event in ledger.events() if event["trial"] == 1] == [
            "running",
            "driven",
            "scored",
        ]
    found = read_observations(path)
    assert counting(path) == [0, 1]
    assert [(each.number, each.end) for each in found.under_way] == [(2, "driven"), (3, "running")]


def test_a_trial_is_one_row_from_its_start_to_its_score(tmp_path: Path) -> None:
    with open_saved_trials(tmp_path / "one.sqlite", CONTROLLERS) as ledger:
        for end in ("running", "driven", "step limit"):
            ledger.append(of_controller(5, end))
        (only,) = ledger.trials()
        assert (only.state, only.cells) == ("scored", (3, 7))
        ledger.append(of_controller(6, "running"))
        ledger.append(of_controller(6, "running"))
        assert [each.state for each in ledger.trials()] == ["scored", "void", "running"], "it is settled"


def test_scores_are_withdrawn_entered_and_seconded(path: Path) -> None:
    with open_ledger(path) as ledger:
        ledger.undo(1)
        assert (1, ()) in [(each.number + 1, each.cells) for each in ledger.observations().under_way]
        ledger.score_all({1: Score([13, 14, 13], "anna"), 4: Score([5], "anna")})
        ledger.score(1, Score([13], "ben"), "second")
        assert (ledger.trial(1).cells, ledger.trial(4).state) == ((13, 14), "scored")
    found = read_observations(path)
    assert [each.number for each in found.under_way] == [3]
    assert {each.number: each.cells for each in found.trials if each.end == "step limit"} == {
        0: (13, 14), 1: (3, 7), 2: (5,)
    }  # fmt: skip


def test_void_trial_has_its_reason_and_no_longer_counts(path: Path) -> None:
    with open_ledger(path) as ledger:
        for number in (1, 5):
            ledger.void(number, "it was pushed")
        assert (ledger.trial(1).state, ledger.trial(1).reason) == ("void", "it was pushed")
        assert len(ledger.trials()) == 5, "only a study plans another one"
    found = read_observations(path)
    assert counting(path) == [1]
    assert (found.trials[0].end, found.trials[0].problem) == ("aborted", "it was pushed")
    assert found.trials[0].cells == (3, 7), "nothing is lost"
    with open_saved_trials(path, CONTROLLERS) as ledger:
        ledger.append(of_controller(0, "step limit"))
    assert counting(path) == [1, 0]


def test_notes_are_kept_with_who_and_when(path: Path) -> None:
    with open_ledger(path) as ledger:
        ledger.note("a new pen", "ben", 1)
        ledger.note("the light was on", "ben")
    notes = read_observations(path).notes
    assert [(note["trial"], note["text"], note["who"]) for note in notes] == [
        (1, "a new pen", "ben"),
        (None, "the light was on", "ben"),
    ]


@pytest.mark.parametrize(
    ("number", "cells", "role"),
    [(4, [72], "score"), (4, [], "score"), (1, [1], "score"), (5, [1], "score"), (9, [1], "score"),
     (1, [1], "correction"), (6, [1], "score")],
)  # fmt: skip
def test_refused_cells_change_nothing(path: Path, number: int, cells: list[int], role: str) -> None:
    with open_saved_trials(path, CONTROLLERS) as ledger:
        ledger.append(replace(trial(4), purpose="path", end="driven", cells=()))  # which draws no line
    with open_ledger(path) as ledger:
        before = ledger.scores()
        ledger.undo(3)
        with pytest.raises(RecordError):
            ledger.score_all({3: Score([1], "anna"), number: Score(cells, "anna")}, role)  # type: ignore[arg-type]
        assert len(ledger.scores()) == len(before)


def test_second_program_cannot_drive_for_the_same_file_but_a_person_can_note(path: Path) -> None:
    with open_saved_trials(path, CONTROLLERS) as first:
        assert not first.has_changed()
        with pytest.raises(RecordError, match="in use"):
            open_saved_trials(path, CONTROLLERS)
        with open_ledger(path) as second:
            second.void(1, "it was pushed")
        assert first.has_changed()
        assert not first.has_changed()
    open_saved_trials(path, CONTROLLERS).close()


def test_trial_that_a_person_voids_while_it_is_driven_does_not_count(tmp_path: Path) -> None:
    with open_saved_trials(tmp_path / "one.sqlite", CONTROLLERS) as ledger:
        ledger.append(of_controller(0, "running"))
        with open_ledger(ledger.path) as other:
            other.void(1, "it was pushed")
        ledger.append(of_controller(0, "step limit"))
        assert [(each.state, each.reason, each.n_steps) for each in ledger.trials()] == [
            ("void", "it was pushed", 3)
        ]
        ledger.append(of_controller(0, "step limit"))
    assert counting(tmp_path / "one.sqlite") == [0]


def test_trials_of_something_else_are_not_put_into_a_file(path: Path) -> None:
    with pytest.raises(
        RecordError, match=r"target 'twin:worn.toml' and not 'sim'; observe 'cells' and not 'track'"
    ):
        open_saved_trials(path, replace(HEAD, target="sim"))
    assert len(states(path)) == 5


def test_a_target_that_is_known_may_have_another_name_and_not_another_identity(tmp_path: Path) -> None:
    """An emulator started again, on another port, was taken for something else."""
    path = tmp_path / "one.sqlite"
    with open_saved_trials(path, KNOWN) as ledger:
        ledger.append(trial(0))
    open_saved_trials(path, replace(KNOWN, target="scribbler:socket://127.0.0.1:7002")).close()
    with pytest.raises(RecordError, match="identity 's2, Fluke 2, BoxOnWheels' and not 's1, Fluke 1'"):
        open_saved_trials(path, replace(KNOWN, identity="s1, Fluke 1"))


def test_names_distinguish_targets_if_an_identity_is_unknown(path: Path) -> None:
    open_saved_trials(path, replace(KNOWN, observe="cells")).close()
    with pytest.raises(RecordError, match=r"target 'twin:worn.toml' and not 'sim'"):
        open_saved_trials(path, replace(KNOWN, observe="cells", target="sim"))


def test_a_file_without_a_trial_is_nobodys(tmp_path: Path) -> None:
    """A command that was refused after its file was begun kept the right one from using the same name."""
    path = tmp_path / "trials.sqlite"
    open_saved_trials(path, HEAD).close()
    with open_saved_trials(path, CONTROLLERS) as ledger:
        ledger.append(trial(0))
    assert read_observations(path).head.observe == "cells"
    with pytest.raises(RecordError, match="observe 'cells' and not 'track'"):
        open_saved_trials(path, HEAD)


def test_files_that_cannot_have_trials_are_told_in_one_message(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="Could not write"):
        open_saved_trials(tmp_path / "no folder" / "one.sqlite", HEAD)
    with pytest.raises(
        RecordError, match=r"Name .*new\.sqlite\. .*trials export .*new\.sqlite -o .*new\.jsonl"
    ):
        open_saved_trials(tmp_path / "new.jsonl", HEAD)
    Ledger.create(tmp_path / "study.sqlite").close()
    with pytest.raises(RecordError, match="has the trials of a study"):
        open_saved_trials(tmp_path / "study.sqlite", HEAD)
    (tmp_path / "text.sqlite").write_text("notes")
    with pytest.raises(RecordError):
        open_saved_trials(tmp_path / "text.sqlite", HEAD)
    assert (tmp_path / "text.sqlite").read_text() == "notes"


# lines of JSON


def converted(path: Path) -> Ledger:
    with pytest.warns(RecordWarning, match="were converted"):
        return open_saved_trials(path, read_observations(path).head)


@pytest.fixture
def lines(tmp_path: Path) -> Path:
    shutil.copyfile(STORED / "observations-1.jsonl", tmp_path / "old.jsonl")
    return tmp_path / "old.jsonl"


def test_lines_are_read_with_their_numbers_and_converted_once(lines: Path) -> None:
    before, data = read_observations(lines), lines.read_bytes()
    assert states(lines) == ["scored", "void", "scored", "driven", "running"]
    assert list(lines.parent.iterdir()) == [lines], "reading converts nothing"
    with converted(lines) as ledger:
        assert [each.trial for each in ledger.trials()] == [0, 1, 4, 2, 3]
        ledger.append(replace(of_controller(7, "step limit")))
    with open_ledger(lines) as ledger:  # the new file from now on, without another word
        assert ledger.path == lines.with_suffix(".sqlite")
        assert ledger.trials()[-1].trial == 5
    assert states(lines)[-1] == "scored"
    after = read_observations(lines.with_suffix(".sqlite"))
    assert [same(*pair) for pair in zip(after.trials, before.trials, strict=False)] == [True] * 3
    assert [same(*pair) for pair in zip(after.under_way, before.under_way, strict=True)] == [True] * 2
    assert [(note["text"], note["who"], note["time"]) for note in after.notes] == [
        (note["text"], note["who"], note["time"]) for note in before.notes
    ]
    assert lines.read_bytes() == data


def test_lines_that_changed_after_they_were_converted_are_not_mixed_up(lines: Path) -> None:
    converted(lines).close()
    with lines.open("ab") as file:
        file.write(b'{"note":"more","trial":null,"who":"ben","time":"2026"}\n')
    with pytest.raises(RecordError, match="has changed since"):
        open_ledger(lines)
    with open_ledger(lines, writable=False) as ledger:
        assert len(ledger.notes()) == 2


def test_a_crash_while_lines_are_converted_leaves_them_to_be_converted(
    lines: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def die(self: Path, target: Path) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", die)
        with pytest.raises(KeyboardInterrupt):
            open_saved_trials(lines, HEAD)
    assert [path.name for path in lines.parent.iterdir() if path.suffix != ".lock"] == ["old.jsonl"]
    converted(lines).close()


def test_a_name_that_a_command_chose_takes_up_the_lines_in_its_place(tmp_path: Path) -> None:
    write_observations(tmp_path / "a.jsonl", HEAD, [trial(0)])
    open_saved_trials(tmp_path / "b.sqlite", HEAD).close()
    with pytest.warns(RecordWarning, match="were converted"):
        ledger = open_saved_trials(tmp_path / "a.sqlite", HEAD, within=tmp_path)
    assert len(ledger.observations().trials) == 1
    ledger.close()


def test_time_of_a_look_up_does_not_grow_with_the_number_of_trials(path: Path) -> None:
    """Each trial was compared with each score: 20,000 trials took longer than a query may."""
    with open_ledger(path) as ledger:
        for query in (
            f"{_ledger_reader._OBSERVED}ORDER BY place",
            "SELECT id, state FROM trials WHERE purpose = '' AND number = 1 AND controller IS 1 ORDER BY place",
            "SELECT coalesce(max(place), 0) FROM trials",
        ):
            steps = [str(row["detail"]) for row in ledger._all(f"EXPLAIN QUERY PLAN {query}")]
            assert not [step for step in steps if step.startswith("SCAN") and "INDEX" not in step], steps


def test_damaged_record_is_one_clear_error(path: Path) -> None:
    with sqlite3.connect(path) as other:
        other.execute("UPDATE trials SET record = '{}' WHERE id = 1")
    other.close()
    os.utime(path)
    with pytest.raises(RecordError, match="trial 1 is a trial without 'battery_v'"):
        read_observations(path)


_LOCKED = """
import fcntl, sys
with open(sys.argv[1], "r+b") as file:
    try:
        fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, int(sys.argv[2]))
    except OSError:
        print("locked")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="locks of POSIX")
@pytest.mark.parametrize(("ending", "byte"), [("", 0x40000002), ("-shm", 128)])
def test_a_look_at_a_ledger_keeps_the_locks_of_its_connections(tmp_path, ending, byte):
    """SQLite locks a byte of the ledger and one of its index of writes. Others truncate an unlocked index."""
    path = tmp_path / "ledger.sqlite"
    with Ledger.create(path) as ledger:
        ledger.trials()
        ledger_stamp(path)
        assert is_observations(path)
        words = [sys.executable, "-c", _LOCKED, f"{path}{ending}", str(byte)]
        done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stdout == "locked\n"


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="counts open files in /proc")
def test_looks_at_a_ledger_do_not_use_up_descriptors(tmp_path):
    path = tmp_path / "ledger.sqlite"
    Ledger.create(path).close()
    counts = []
    for _ in range(5):  # SQLite removes the index with the last connection, and makes another
        with Ledger.open(path) as ledger:
            ledger.note("again", "anna")
            assert len(ledger_stamp(path)) == 3
            counts.append(len(list(Path("/proc/self/fd").iterdir())))
    assert len(set(counts)) == 1
