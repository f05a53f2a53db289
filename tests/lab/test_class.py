"""A class: each student has a robot, a minute, and a result that stays."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from realitygap.errors import StudyError
from realitygap.lab import _class
from realitygap.lab._class import GONE_S, MOST_PAGES, MOST_STUDENTS, MOST_WORDS, Classroom, Student, Word
from realitygap.lab._class_results import FILE, LONGEST_NAME, clean_name
from realitygap.lab._hand import DEAD_MAN_S
from realitygap.lab.pages._class import _Board, _Class
from realitygap.playback import MovingTrial


class Class:
    """A class whose time the test moves."""

    def __init__(self, root: Path, round_s: float = 2.0) -> None:
        self.now = 0.0
        self.room = Classroom(root, clock=lambda: self.now, round_s=round_s)

    def join(self, name: str, key: str = "") -> Student:
        student, _ = self.room.enter(key or name)
        self.room.hear(student, Word(kind="join", name=name))
        return student

    def pass_time(self, seconds: float) -> None:
        """Let time pass in steps of the class."""
        for _ in range(round(seconds / _class.PERIOD_S)):
            self.now += _class.PERIOD_S
            run(self.room.step())

    def drive(self, seconds: float, **pulls: tuple[Student, float, float]) -> None:
        """Have students hold their pads for a while."""
        for _ in range(round(seconds / _class.PERIOD_S)):
            for student, move, turn in pulls.values():
                word = Word(kind="drive", move=move, turn=turn, stops=student.n_stops, n=student.n_heard + 1)
                self.room.hear(student, word)
            self.pass_time(_class.PERIOD_S)


def run(work: Any) -> Any:
    """Run a coroutine in a thread: in this one, a browser of other tests may have a loop."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, work).result()


@pytest.fixture
def course(tmp_path: Path) -> Class:
    return Class(tmp_path)


@pytest.fixture
def again(course: Class, tmp_path: Path) -> Callable[[], Class]:
    """Opens the class as the next start of the lab does."""
    return lambda: Class(tmp_path)


def test_commands_of_each_student_reach_only_their_own_robot(course):
    ada, eve, idle = course.join("Ada"), course.join("Eve"), course.join("Idle")
    course.drive(1.0, ada=(ada, 1.0, 0.0), eve=(eve, 0.0, 1.0))
    start = course.room.arena.start
    assert ada.robot.pose.x > start.x + 0.05
    assert ada.robot.pose.heading == pytest.approx(start.heading)
    assert eve.robot.pose.heading > start.heading + 0.5
    assert tuple(idle.robot.pose) == tuple(start)


def test_robot_stops_when_its_page_is_silent(course):
    ada = course.join("Ada")
    course.drive(0.5, ada=(ada, 1.0, 0.0))
    course.pass_time(DEAD_MAN_S + 0.1)
    pose = ada.robot.pose
    course.pass_time(1.0)
    assert ada.robot.pose == pose


def test_late_step_of_the_lab_does_not_move_a_robot_on(course):
    ada, eve = course.join("Ada"), course.join("Eve")
    course.room.hear(ada, Word(kind="drive", move=1.0))
    course.room.hear(eve, Word(kind="drive", move=1.0))
    ada.robot.advance(course.now + DEAD_MAN_S + 0.1)
    eve.robot.advance(course.now + 30.0)
    assert eve.robot.pose.x == pytest.approx(ada.robot.pose.x, abs=0.02)


def test_stop_holds_until_the_pad_is_pressed_again(course):
    ada = course.join("Ada")
    course.drive(0.5, ada=(ada, 1.0, 0.0))
    course.room.hear(ada, Word(kind="stop"))
    course.pass_time(0.2)
    pose = ada.robot.pose
    course.room.hear(ada, Word(kind="drive", move=1.0, stops=0))  # from the press before the stop
    course.pass_time(0.3)
    assert ada.robot.pose == pose


def test_round_ends_after_its_time_and_lists_best_first(course, tmp_path):
    ada, eve = course.join("Ada"), course.join("Eve")
    with pytest.raises(StudyError, match="No student"):
        Class(tmp_path / "other").room.start_round()
    course.room.start_round()
    with pytest.raises(StudyError, match="running"):
        course.room.start_round()
    course.drive(2.5, eve=(eve, 1.0, 0.1), ada=(ada, 0.0, 1.0))
    assert course.room.phase == "over"
    board = course.room.drives()
    assert [drive.name for drive in board] == ["Eve", "Ada"]
    assert board[0].seconds == 2.0
    assert len(board[0].path) >= 20
    pose = eve.robot.pose
    course.drive(0.5, eve=(eve, 1.0, 0.0))
    assert eve.robot.pose == pose  # until the next round


def test_student_who_joins_late_has_a_full_round(course):
    course.join("Ada")
    course.room.start_round()
    course.pass_time(1.0)
    eve = course.join("Eve")
    assert course.room.seconds_left(eve) == 2.0
    course.pass_time(1.5)
    assert course.room.phase == "round"
    course.pass_time(1.0)
    assert {drive.name: drive.seconds for drive in course.room.drives()} == {"Ada": 2.0, "Eve": 2.0}


def test_results_survive_a_restart_even_in_a_round(course, again):
    ada = course.join("Ada")
    course.room.start_round()
    course.drive(1.0, ada=(ada, 1.0, 0.0))
    cells = list(ada.robot.cells)
    after_crash = again()  # the first one was not closed
    (drive,) = after_crash.room.drives()
    assert (drive.name, drive.cells, drive.is_over) == ("Ada", cells, True)
    student, _ = after_crash.room.enter("Ada")
    assert (student.name, after_crash.room.n_cells(student)) == ("Ada", len(cells))
    after_crash.room.start_round()
    assert after_crash.room.round == 2


def test_end_of_the_lab_saves_paths_of_drives(course, again):
    ada = course.join("Ada")
    course.room.start_round()
    course.drive(1.0, ada=(ada, 1.0, 0.0))
    course.room.close()
    assert len(again().room.drives()[0].path) > 5


def test_damaged_lines_of_the_file_are_left_out(course, again, tmp_path):
    course.join("Ada")
    course.room.start_round()
    course.pass_time(0.1)
    lines = [b"{", b"\xff\xfe", b"[]", b'{"round": 0, "student": "a", "name": "Zoe"}', b'{"round": 1e999}']
    with (tmp_path / FILE).open("ab") as file:
        file.write(b"\n".join(lines))
    assert [drive.name for drive in again().room.drives()] == ["Ada"]


def test_results_after_a_line_that_a_crash_cut_off_are_read(course, again, tmp_path):
    (tmp_path / FILE).write_bytes(b'{"round": 1, "stu')
    course.join("Ada")
    course.room.start_round()
    course.pass_time(0.1)
    assert [drive.name for drive in again().room.drives()] == ["Ada"]


def test_full_disk_is_shown_and_later_results_are_saved(course, monkeypatch, again):
    course.join("Ada")
    course.room.start_round()

    def fail(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr(Path, "open", fail)
        course.pass_time(0.1)
    assert "No space left" in course.room.problem
    course.pass_time(2.5)
    assert course.room.problem == ""
    assert [drive.name for drive in again().room.drives()] == ["Ada"]


@pytest.mark.parametrize(
    ("given", "shown"),
    [("  Ada \n Lovelace ", "Ada Lovelace"), ("x" * 200, "x" * LONGEST_NAME), ("<b>B</b>", "<b>B</b>")],
)
def test_names_are_short_and_in_one_line(course, given, shown):
    assert course.join(given, "key").name == shown


def test_names_have_no_characters_that_control_a_page():
    assert not any(letter in clean_name("a\u202eb\x1bc\x00") for letter in "\u202e\x1b\x00")


def test_equal_names_get_a_number_and_an_empty_one_is_none(course):
    assert [course.join("Ada", key).name for key in "abc"] == ["Ada", "Ada 2", "Ada 3"]
    assert course.join("  ", "d").robot is None


def test_equal_names_stay_different_after_a_restart(course, again):
    long = "x" * LONGEST_NAME
    for key in "abc":
        course.join(long, key)
    course.room.start_round()
    course.pass_time(0.1)
    later = again()
    names = [long, f"{long} 2", f"{long} 3"]
    assert [drive.name for drive in later.room.drives()] == names
    assert later.join(long, "d").name == f"{long} 4"  # the others have not come back yet
    assert [later.room.enter(key)[0].name for key in "abc"] == names
    later.room.reset()
    newest = again()
    newest.room.reset()
    assert newest.join(long, "e").name == long
    assert newest.room.enter("a")[0].name == f"{long} 2"


def test_page_of_an_interrupted_drive_states_it_and_compares_no_lost_path(course, again):
    ada = course.join("Ada")
    course.room.start_round()
    course.drive(0.5, ada=(ada, 1.0, 0.0))
    later = again().room  # as after a crash: the path is saved at the end only
    student, _ = later.enter("Ada")
    page = _Class(None, later)
    assert page._state(student)["phase"] == "cut"
    assert later.seconds_left(student) == 0.0
    assert later.n_cells(student) == course.room.n_cells(ada)
    page.evolved = evolved = SimpleNamespace(cells=np.array([1]), trial=None)
    later.shows_evolution = True
    evolved.trial = MovingTrial.of_rows(
        "Evolution",
        "SIM",
        later.arena,
        page._shape,
        0.1,
        np.zeros((1, 3)),
        np.zeros((1, 3)),
        np.zeros(1, np.bool_),
    )
    assert [trial["title"] for trial in page._stage(student, compares=True)["trials"]] == ["Evolution"]
    assert page._state(student)["evolution"] == "1 cell"


def test_board_ranks_equal_results_alike_and_keeps_its_clock_when_a_student_is_late(course):
    ada, eve = course.join("Ada"), course.join("Eve")
    board = _Board(_Class(None, course.room))
    course.room.start_round()
    course.drive(1.0, ada=(ada, 1.0, 0.0))
    late = course.join("Late")
    assert board._heading() == "Round 1: 1 s left"
    course.pass_time(0.1)
    assert re.findall(r"<span>(\d+)\.</span><span>(\w+)<", board._list()) == [
        ("1", "Ada"),
        ("2", "Eve"),
        ("2", "Late"),
    ]
    assert [board._page._state(student)["place"] for student in (ada, eve, late)] == [1, 2, 2]
    course.pass_time(1.0)
    assert board._heading() == "Round 1: 1 student still driving, 1 s left"
    assert board._page._state(ada)["phase"] == "over"


def test_removed_name_leaves_the_board_and_may_be_replaced(course, again):
    ada = course.join("Rude")
    course.room.start_round()
    course.pass_time(0.2)
    course.room.remove(ada.key)
    assert (ada.name, ada.robot, course.room.drives()) == ("", None, [])
    course.room.hear(ada, Word(kind="join", name="Ada"))
    course.room.start_round() if course.room.phase != "round" else None
    course.pass_time(0.1)
    assert [drive.name for drive in course.room.drives()] == ["Ada"]
    assert [drive.name for drive in again().room.drives()] == ["Ada"]


def test_reset_returns_to_practice_and_keeps_the_results(course, tmp_path):
    ada = course.join("Ada")
    course.room.start_round()
    course.drive(1.0, ada=(ada, 1.0, 0.0))
    course.room.reset()
    course.pass_time(0.1)
    assert (course.room.phase, course.room.drives()) == ("practice", [])
    saved = [json.loads(line) for line in (tmp_path / FILE).read_text().splitlines()]
    assert saved[-1]["is_over"]
    pose = ada.robot.pose
    course.drive(0.5, ada=(ada, 1.0, 0.0))
    assert ada.robot.pose != pose


def test_robot_of_a_student_who_is_gone_is_switched_off_and_comes_back(course):
    student, page = course.room.enter("Ada")
    course.room.hear(student, Word(kind="join", name="Ada"))
    course.room.leave(student, page)
    course.pass_time(1.0)
    assert student.robot is not None
    course.now += GONE_S
    course.pass_time(0.1)
    assert student.robot is None
    assert course.room.enter("Ada")[0].robot is not None


def test_students_pages_and_messages_are_bounded(course):
    for k in range(MOST_STUDENTS):
        course.room.enter(f"visitor {k}")
    with pytest.raises(StudyError, match="full"):
        course.room.enter("one more")
    ada, _ = course.room.enter("visitor 0")
    for _ in range(MOST_PAGES - 2):
        course.room.enter("visitor 0")
    with pytest.raises(StudyError, match="too often"):
        course.room.enter("visitor 0")
    assert all(course.room.hear(ada, Word(kind="release")) for _ in range(MOST_WORDS))
    assert not course.room.hear(ada, Word(kind="release"))
    for each in list(ada.pages):
        course.room.leave(ada, each)
    course.room.enter("one more")  # in the place of a student who has gone


@pytest.mark.parametrize(
    "text",
    [
        '{"kind": "start"}',
        '{"kind": "drive", "move": NaN}',
        '{"kind": "drive", "move": "1"}',
        '{"kind": "join", "name": 3}',
        '{"kind": "join", "more": 1}',
        "[]",
    ],
)
def test_messages_of_other_forms_are_refused(text):
    with pytest.raises(ValidationError):
        Word.model_validate_json(text)
