"""A class: each student drives an emulated robot and covers as many cells as possible in one minute."""

from __future__ import annotations

import asyncio
import hashlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from realitygap.errors import StudyError
from realitygap.robots import Label
from realitygap.world import paper_arena

from ._class_results import Drive, clean_name, read_drives, save_drives
from ._class_robot import ClassRobot, StudentRobot
from ._job import MOST_POINTS

Phase = Literal["practice", "round", "over"]

ROUND_S = 60.0
"""Duration of a drive [s]."""
PERIOD_S = 0.1
"""Time between two steps of the robots [s]."""
GONE_S = 60.0
"""Time after which the robot of a student without a page is switched off [s]."""
MOST_STUDENTS = 60
MOST_PAGES = 3
"""Largest number of pages of a student."""
MOST_WORDS = 40
"""Largest number of messages of a student between two steps; a page sends one or two."""


class Word(BaseModel):
    """A message of a student's page; `n` counts commands of the pad, and `stops` the stops that the page knew of."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    kind: Literal["join", "drive", "release", "stop"]
    name: str = Field("", max_length=200)
    move: float = 0.0
    turn: float = 0.0
    stops: int = 0
    n: int = 0


class Student:
    """A student.

    Attributes:
        key: Digest of the key of the student's browser.
        name: Name; empty before the student has joined.
        robot: The robot; None if it is off.
        pages: For each open page of the student, the event that tells it of news.
        n_heard: Number of the last command of the pad that the robot has followed.
        n_stops: Number of presses of the stop button.
        seen: Time of the class at which a page was last open [s].
    """

    def __init__(self, key: str) -> None:
        self.key = key
        self.name = ""
        self.robot: StudentRobot | None = None
        self.pages: set[asyncio.Event] = set()
        self.n_heard = self.n_stops = self.n_words = 0
        self.seen = self.began = 0.0


class Classroom:
    """The class of a lab, in which each student has an emulated robot. All methods are called in the event loop.

    Args:
        root: Folder of the lab.
        address: Address for the students.
        clock: Returns the time of the class [s].
        round_s: Duration of a drive [s].

    Attributes:
        arena: Arena of the robots.
        students: Students by the digests of their keys.
        phase: State of the round.
        round: Number of the round; 0 before the first.
        shows_evolution: True if the result of evolution is shown.
        problem: Why the last results are not saved; empty if they are.
    """

    def __init__(
        self,
        root: Path,
        address: str = "",
        *,
        clock: Callable[[], float] = time.monotonic,
        round_s: float = ROUND_S,
    ) -> None:
        self._root, self._clock, self.round_s = root, clock, round_s
        self._drives: dict[tuple[int, str], Drive] = {}
        self._names: dict[str, str] = {}
        for drive in read_drives(root):
            drive.is_over = True  # a drive that the end of the lab interrupted keeps its cells
            self._drives[drive.round, drive.student] = drive
            self._names[drive.student] = "" if drive.is_removed else drive.name
        self.round = max((round_ for round_, _ in self._drives), default=0)
        self.phase: Phase = "over" if self.round else "practice"
        self.students: dict[str, Student] = {}
        self.address = address
        self.arena = paper_arena()
        self.shows_evolution = False
        self.problem = ""
        self._due: dict[tuple[int, str], Drive] = {}

    @property
    def label(self) -> Label:
        """Label of the robots."""
        return "EMULATED"

    @property
    def is_observed(self) -> bool:
        """True if the cells of a drive are observed; otherwise the lecturer counts them."""
        return True

    # students

    def enter(self, key: str) -> tuple[Student, asyncio.Event]:
        """Open a page of the student with this key.

        Raises:
            StudyError: There are too many students, or too many pages of this one.
        """
        digest = hashlib.sha256(key.encode()).hexdigest()[:16]
        student = self.students.get(digest)
        if student is None:
            if len(self.students) >= MOST_STUDENTS:
                here = {key: each for key, each in self.students.items() if each.pages or each.robot}
                self.students = here
            if len(self.students) >= MOST_STUDENTS:
                raise StudyError(f"The class is full: it has {MOST_STUDENTS} students.")
            student = self.students[digest] = Student(digest)
            if name := self._names.get(digest):  # after a restart of the lab
                student.name = self._free(name, student)
        if len(student.pages) >= MOST_PAGES:
            raise StudyError("This page is open too often. Close the other ones.")
        if student.name and student.robot is None:
            self._switch_on(student)
        page = asyncio.Event()
        page.set()
        student.pages.add(page)
        return student, page

    def leave(self, student: Student, page: asyncio.Event) -> None:
        """Close a page of a student: the robot stops, and is switched off a minute later."""
        student.pages.discard(page)
        student.seen = self._clock()
        if student.robot is not None:
            student.robot.release()

    def hear(self, student: Student, word: Word) -> bool:
        """Do what a page says; return False if it says too much."""
        student.n_words += 1
        robot = student.robot
        if word.kind == "join":
            self._join(student, word.name)
        elif robot is not None and word.kind != "drive":
            student.n_stops += word.kind == "stop"
            robot.release()
        elif robot is not None and self.may_drive(student):
            student.n_heard = word.n
            if word.stops == student.n_stops:
                robot.pull(word.move, word.turn)
        return student.n_words <= MOST_WORDS

    def may_drive(self, student: Student) -> bool:
        """Return True if the student's pad drives."""
        drive = self.drive_of(student)
        return drive is None or not drive.is_over

    def words_for(self, student: Student) -> str:
        """Return the words that replace those of a student's page; empty if none do."""
        return ""

    def _join(self, student: Student, name: str) -> None:
        name = clean_name(name)
        if not name or student.name:
            return
        student.name = self._free(name, student)
        self._switch_on(student)
        if self.phase == "round":
            self._begin(student)

    def _free(self, name: str, student: Student) -> str:
        """Return a name, with a number if another student has it or it is on the board."""
        taken = {other.name for other in self.students.values() if other is not student}
        taken |= {drive.name for drive in self.drives() if drive.student != student.key}
        names = (name, *(f"{name} {k}" for k in range(2, len(taken) + 2)))
        return next(each for each in names if each not in taken)

    def _switch_on(self, student: Student) -> None:
        student.robot = robot = ClassRobot(int(student.key[:6], 16), self._clock())
        self.arena = robot.arena

    def drive_of(self, student: Student) -> Drive | None:
        """Return the student's drive in this round; None if there is none."""
        return self._drives.get((self.round, student.key)) if self.phase != "practice" else None

    def n_cells(self, student: Student) -> int:
        """Return the number of cells of a student's drive, in practice those of the robot."""
        if (drive := self.drive_of(student)) is not None:
            return drive.n_cells
        return 0 if student.robot is None else len(student.robot.cells)

    def seconds_left(self, student: Student) -> float:
        """Return the rest of a student's drive [s]."""
        drive = self.drive_of(student)
        return self.round_s if drive is None else self.rest_of(drive)

    def rest_of(self, drive: Drive) -> float:
        """Return the rest of a drive [s]; 0 after its end, also if the end of the lab interrupted it."""
        return 0.0 if drive.is_over else max(0.0, self.round_s - drive.seconds)

    # rounds

    def start_round(self) -> None:
        """Put all robots at the start, and start a round.

        Raises:
            StudyError: A round is running, or no student has joined.
        """
        if self.phase == "round":
            raise StudyError("A round is running. Reset it first.")
        joined = [student for student in self.students.values() if student.robot is not None]
        if not joined:
            raise StudyError("No student has joined. Show the code, and wait for the first name.")
        self.round += 1
        self.phase, self.shows_evolution = "round", False
        for student in joined:
            self._begin(student)

    def _begin(self, student: Student) -> None:
        drive = Drive(round=self.round, student=student.key, name=student.name)
        self._drives[self.round, student.key] = drive
        if student.robot is not None:
            student.robot.put_at_start()
        student.began = self._clock()
        self._save(drive)

    def reset(self) -> None:
        """End the round and return to practice; its results stay in the file."""
        for drive in self.drives():
            self._end(drive)
        self.phase, self.shows_evolution = "practice", False

    def remove(self, key: str) -> None:
        """Remove a student's name and result; the student may choose another name."""
        for drive in self.drives():
            if drive.student == key:
                drive.is_removed = True
                self._save(drive)
        student = self.students.get(key)
        self._names.pop(key, None)
        if student is not None:
            student.name = ""
            self._switch_off(student)

    def drives(self) -> list[Drive]:
        """Return the drives of this round that are not removed, best first; of equal ones, the earlier one."""
        drives = [each for each in self._drives.values() if each.round == self.round and not each.is_removed]
        return [] if self.phase == "practice" else sorted(drives, key=lambda drive: -drive.n_cells)

    # time

    async def step(self) -> None:
        """Move all robots to the present, save what is new, and tell the pages."""
        now = self._clock()
        for student in list(self.students.values()):
            student.n_words = 0
            if student.robot is not None:
                self._advance(student, student.robot, now)
                await asyncio.sleep(0)  # other pages do not wait for all robots
            for page in student.pages:
                page.set()
        if self.phase == "round" and self._is_round_over():
            self.phase = "over"
        if self._due:
            due, self._due = self._due, {}
            copies = [drive.model_copy() for drive in due.values()]
            self.problem = await asyncio.to_thread(save_drives, self._root, copies)
            if self.problem:
                self._due = due | self._due

    def _is_round_over(self) -> bool:
        return all(drive.is_over for drive in self.drives())

    def _advance(self, student: Student, robot: StudentRobot, now: float) -> None:
        drive = self.drive_of(student)
        if drive is None or drive.is_over:
            robot.advance(now)
            if len(robot.path) > MOST_POINTS:
                robot.forget_path()
            if not student.pages and now - student.seen > GONE_S:
                self._switch_off(student)
            return
        robot.advance(min(now, student.began + self.round_s))
        self._note_drive(student, robot, now)

    def _note_drive(self, student: Student, robot: StudentRobot, now: float) -> None:
        """Note the cells of a drive, and end it after its time."""
        if (drive := self.drive_of(student)) is None:
            return
        drive.seconds = min(now - student.began, self.round_s)
        if (cells := list(robot.cells)) != drive.cells:
            drive.cells = cells
            self._save(drive)
        if drive.seconds >= self.round_s:
            self._end(drive)

    def _end(self, drive: Drive) -> None:
        if drive.is_over:
            return
        drive.is_over = True
        student = self.students.get(drive.student)
        if student is not None and student.robot is not None:
            student.robot.release()
            drive.path = [[round(part, 4) for part in pose] for pose in student.robot.path]
        self._save(drive)

    def _save(self, drive: Drive) -> None:
        self._due[drive.round, drive.student] = drive

    def _switch_off(self, student: Student) -> None:
        if student.robot is not None:
            student.robot.close()
            student.robot = None

    def close(self) -> None:
        """Save what is driven, and switch all robots off."""
        for drive in self.drives():
            self._end(drive)
        save_drives(self._root, list(self._due.values()))
        for student in self.students.values():
            self._switch_off(student)
