"""A class with one robot: one student drives at a time, and the motors stand still at the end of each turn."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from realitygap.emulator import connect_witness
from realitygap.errors import StudyError
from realitygap.lab import open_lab
from realitygap.lab._class import PERIOD_S, Word
from realitygap.lab._class_results import read_drives
from realitygap.lab._class_turns import Turns
from realitygap.lab._control import RobotControl, Visitor
from realitygap.lab._shared_robot import CLASS, SharedRobot
from realitygap.lab.pages._class import _Board, _Class
from realitygap.world import Pose, paper_arena

from .test_class import Class, run

START = [*paper_arena().start]


class FakeHand:
    """A robot that notes what it is told."""

    label, outcome, port, is_over, silent_s = "REAL", None, "COM3", False, 0.0

    def __init__(self, arena: Any = None) -> None:
        self.arena, self.doing = arena, None
        self.n_stops = self.n_live = 0
        self.told: list[Any] = []
        self.senses = SimpleNamespace(pose=START if arena else None, cells=[], moves=False, stalled=False)

    def drive(self, move: float, turn: float, stops: int) -> None:
        if stops == self.n_stops:
            self.told.append((move, turn))

    def release(self) -> None:
        self.told.append("release")

    def stop_robot(self) -> None:
        self.n_stops += 1
        self.told.append("stop")

    def want(self, what: str) -> None:
        self.told.append(what)
        self.doing = what


class Shared(SharedRobot):
    def __init__(self, hand: FakeHand) -> None:
        super().__init__(SimpleNamespace(may_operate=lambda _: True), "COM3", "")  # type: ignore[arg-type]
        self._hand = hand  # type: ignore[assignment]


class TurnsClass(Class):
    """A class with one robot, whose time the test moves."""

    def __init__(self, root: Path, hand: FakeHand) -> None:
        self.now, self.hand = 0.0, hand
        self.room: Turns = Turns(root, "", Shared(hand), clock=lambda: self.now, round_s=2.0)


@pytest.fixture
def course(tmp_path: Path) -> TurnsClass:
    """A class with a robot that nobody observes."""
    return TurnsClass(tmp_path, FakeHand())


def enter(course: TurnsClass, name: str) -> Any:
    """Open a page of a student, and join."""
    student, page = course.room.enter(name)
    course.room.hear(student, Word(kind="join", name=name))
    return SimpleNamespace(student=student, page=page)


def names(course: TurnsClass) -> list[str]:
    return [student.name for student in course.room.queue]


def test_only_the_student_whose_turn_it_is_drives_and_stops_the_robot(course):
    ada, ben = course.join("Ada"), course.join("Ben")
    course.drive(0.3, ada=(ada, 1.0, 0.0))
    course.room.start_round()
    course.drive(0.3, ada=(ada, 1.0, 0.0))
    assert course.hand.told == [], "no turn has started"
    course.room.start_turn()
    course.hand.told.clear()
    course.drive(0.2, ada=(ada, 1.0, 0.5), ben=(ben, -1.0, 0.0))
    course.room.hear(ben, Word(kind="stop"))
    course.room.hear(ben, Word(kind="release"))
    assert course.hand.told == [(1.0, 0.5)] * 2
    course.room.hear(ada, Word(kind="stop"))
    assert course.hand.told[2:] == ["stop", "release"]


def test_stop_of_the_lecturer_holds_until_the_driver_presses_again(course):
    ada = course.join("Ada")
    course.room.start_round()
    course.room.start_turn()
    course.hand.stop_robot()
    course.hand.told.clear()
    course.room.hear(ada, Word(kind="drive", move=1.0, stops=ada.n_stops))
    assert course.hand.told == []
    course.room.hear(ada, Word(kind="drive", move=1.0, stops=course.hand.n_stops))
    assert course.hand.told == [(1.0, 0.0)]


def test_turn_ends_after_its_time_with_motors_off_and_the_next_one_waits_for_the_lecturer(course):
    ada, ben = course.join("Ada"), course.join("Ben")
    course.room.start_round()
    course.room.start_turn()
    with pytest.raises(StudyError, match="Ada is driving"):
        course.room.start_turn()
    course.pass_time(2.2)
    assert course.hand.told[-2:] == ["stop", "release"]
    assert (course.room.driver, names(course), course.room.phase) == (None, ["Ben"], "round")
    course.drive(0.5, ben=(ben, 1.0, 0.0), ada=(ada, 1.0, 0.0))
    assert course.hand.told[-1] == "release"
    course.room.start_turn()
    course.pass_time(2.2)
    assert course.room.phase == "over"
    with pytest.raises(StudyError, match="Start a round"):
        course.room.start_turn()


def test_turn_ends_when_the_drivers_last_page_leaves(course):
    ada = enter(course, "Ada")
    _, other = course.room.enter("Ada")
    course.room.start_round()
    course.room.start_turn()
    course.room.leave(ada.student, other)
    assert course.room.driver is ada.student
    assert course.hand.told[-1] == "release"
    course.room.leave(ada.student, ada.page)
    assert course.room.driver is None
    assert "stop" in course.hand.told


def test_lecturer_skips_the_next_student_and_ends_a_turn(course):
    ada, _ben = course.join("Ada"), course.join("Ben")
    course.room.start_round()
    course.room.skip()
    assert names(course) == ["Ben"]
    late = course.join("Late")
    course.room.start_turn()
    course.room.skip()
    assert "stop" in course.hand.told
    assert (course.room.driver, names(course)) == (None, ["Late"])
    assert [course.room.words_for(each) for each in (ada, late)] == ["Your turn is over.", "You are next."]
    course.room.remove(late.key)
    course.pass_time(0.1)
    assert course.room.phase == "over"


def test_others_see_who_drives_their_place_and_the_drivers_clock(course):
    ada, ben, eve = (course.join(name) for name in ("Ada", "Ben", "Eve"))
    course.room.start_round()
    course.room.start_turn()
    course.pass_time(1.0)
    page = _Class(None, course.room)
    states = [page._state(student) for student in (ada, ben, eve)]
    assert [state["watches"] for state in states] == [False, True, True]
    assert [state["may_drive"] for state in states] == [True, False, False]
    assert [state["words"] for state in states] == [
        "",
        "Ada is driving. You are next.",
        "Ada is driving. 1 student before you.",
    ]
    assert course.room.seconds_left(eve) == course.room.seconds_left(ada) == pytest.approx(1.0)
    assert _Board(page)._heading() == "Round 1: Ada is driving, 1 s left"


def test_lecturer_counts_the_cells_of_a_robot_that_nobody_observes(course, tmp_path):
    course.join("Ada")
    course.room.start_round()
    course.room.start_turn()
    assert course.room.uncounted is None
    course.pass_time(2.2)
    drive = course.room.uncounted
    for wrong in (None, -1, 2.5, 73):
        with pytest.raises(StudyError, match="from 0 to 72"):
            course.room.count(drive, wrong)
    course.room.count(drive, 31.0)
    course.pass_time(0.1)
    assert course.room.uncounted is None
    (saved,) = read_drives(tmp_path)
    assert (saved.n_cells, saved.label, saved.path, saved.is_over) == (31, "REAL", [], True)
    assert "lab-label-real" in _Board(_Class(None, course.room))._list()


def test_field_for_the_count_is_not_drawn_again_when_a_student_joins(course):
    """The lecturer may be typing."""
    course.join("Ada")
    course.room.start_round()
    course.room.start_turn()
    course.pass_time(2.2)
    board = _Board(_Class(None, course.room))
    drive, others = board._uncounted(), board._state()
    assert drive is not None
    course.join("Ben")
    assert board._uncounted() == drive
    assert board._state() != others
    course.room.count(drive, 31)
    assert board._uncounted() is None


def test_clock_of_an_observed_robot_starts_when_it_is_at_its_start(tmp_path):
    course = TurnsClass(tmp_path, FakeHand(paper_arena()))
    ada = course.join("Ada")
    course.hand.senses.pose, course.hand.senses.cells = [0.9, 0.5, 0.0], [1, 2, 3]
    course.room.start_round()
    course.room.start_turn()
    course.drive(1.0, ada=(ada, 1.0, 0.0))
    assert course.hand.told == ["place"]
    assert course.room.seconds_left(ada) == 2.0
    course.hand.doing = None  # it is there; the last reading is from before
    course.pass_time(0.1)
    assert course.room.drive_of(ada).cells == []
    course.hand.senses = SimpleNamespace(pose=START, cells=[0], moves=False, stalled=False)
    course.hand.n_live += 2
    course.drive(1.0, ada=(ada, 1.0, 0.0))
    assert course.room.drive_of(ada).cells == [0]
    assert course.room.seconds_left(ada) == pytest.approx(1.0, abs=2 * PERIOD_S)
    assert {tuple(pose) for pose in course.room.shared.path} == {tuple(START)}


def test_robot_that_is_lost_or_taken_over_ends_the_turn_and_is_no_longer_driven(course):
    ada = course.join("Ada")
    course.room.start_round()
    course.room.start_turn()
    course.room.shared._control.may_operate = lambda _: False
    course.room.shared._control.operator_name = "Eve"
    told = len(course.hand.told)
    course.drive(0.3, ada=(ada, 1.0, 0.0))
    assert course.hand.told[told:] == []
    assert course.room.driver is None
    with pytest.raises(StudyError, match="Eve has taken control"):
        course.room.start_round() if course.room.phase != "round" else course.room.start_turn()


def test_robot_needs_a_class_and_a_port_that_the_lab_opens(tmp_path):
    for options, message in (
        ({"robot": "COM3"}, "robot needs class"),
        ({"classroom": True, "witness": "localhost:1"}, "witness needs robot"),
        ({"classroom": True, "robot": "/etc/passwd"}, "no port that the lab opens"),
    ):
        with pytest.raises(StudyError, match=re.escape(message)):
            open_lab(tmp_path, show=False, **options)


class Moving:
    """A class that moves in a thread, with a robot in another program."""

    def __init__(self, root: Path, emulated: tuple[str, str]) -> None:
        self.control = RobotControl(root, threading.RLock(), lambda: None)
        self.room = Turns(root, "", SharedRobot(self.control, *emulated), round_s=600.0)
        self.room.shared.connect()

    def wait(self, is_so: Callable[[], bool], act: Callable[[], Any] = lambda: None) -> None:
        """Let the class go on until something is so."""
        for _ in range(6000):
            act()
            run(self.room.step())
            if is_so():
                return
            time.sleep(0.02)
        raise AssertionError(self.room.shared.problem)


@pytest.fixture
def moving(tmp_path: Path, emulated: tuple[str, str], forked_children: None) -> Iterator[Moving]:
    course = Moving(tmp_path, emulated)
    yield course
    for job in course.control.jobs():
        job.end()


@pytest.mark.slow
def test_motors_stand_still_after_a_turn_and_after_the_drivers_phone_is_gone(moving, emulated):
    room = moving.room
    student, page = room.enter("Ada")
    room.hear(student, Word(kind="join", name="Ada"))
    with connect_witness(emulated[1]) as witness:
        moving.wait(lambda: room.shared.problem == "")
        assert moving.control.operator == CLASS
        assert not moving.control.may_operate(Visitor("somebody"))
        for end in (room.skip, lambda: room.leave(student, page)):
            room.start_round()
            room.start_turn()

            def pull() -> None:
                room.hear(student, Word(kind="drive", move=1.0, stops=student.n_stops))

            moving.wait(lambda: witness.motors() != (0.0, 0.0) and len(room.shared.path) > 3, pull)
            end()
            moving.wait(lambda: witness.motors() == (0.0, 0.0))
            moving.wait(lambda: room.phase == "over")
            pull()
            assert witness.motors() == (0.0, 0.0)
    (first, second) = read_drives(room._root)
    assert (first.label, first.round, second.round) == ("EMULATED", 1, 2)
    assert first.cells
    assert Pose(*first.path[0]).x == pytest.approx(START[0], abs=0.01)
