"""A class with one robot, which its students drive in turns."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from pathlib import Path

from realitygap._wording import counted
from realitygap.errors import StudyError
from realitygap.robots import Label

from ._class import GONE_S, MOST_WORDS, ROUND_S, Classroom, Student, Word
from ._class_results import Drive
from ._class_robot import StudentRobot
from ._shared_robot import SharedRobot


class Turns(Classroom):
    """A class in which students drive one robot in turns. All methods are called in the event loop.

    A round gives each student one turn, in the order in which they joined. The lecturer starts each turn, because
    a robot must be put back at its start.

    Args:
        root: Folder of the lab.
        address: Address for the students.
        shared: The robot.
        clock: Returns the time of the class [s].
        round_s: Duration of a turn [s].

    Attributes:
        driver: The student who is driving.
        queue: Students who will drive in this round.
    """

    def __init__(
        self,
        root: Path,
        address: str,
        shared: SharedRobot,
        *,
        clock: Callable[[], float] = time.monotonic,
        round_s: float = ROUND_S,
    ) -> None:
        super().__init__(root, address, clock=clock, round_s=round_s)
        self.shared = shared
        self.driver: Student | None = None
        self.queue: list[Student] = []

    @property
    def label(self) -> Label:
        """Label of the robot."""
        return self.shared.label

    @property
    def is_observed(self) -> bool:
        """True if the cells of a drive are observed; otherwise the lecturer counts them."""
        return self.shared.is_observed

    # turns

    def start_round(self) -> None:
        """Have all students who have joined queue up for a turn.

        Raises:
            StudyError: A round is running, no student has joined, or the robot cannot be driven.
        """
        self._check_robot()
        super().start_round()

    def start_turn(self) -> None:
        """Give the robot to the first student of the queue.

        Raises:
            StudyError: A student is driving, nobody waits, or the robot cannot be driven.
        """
        self._check_robot()
        if self.driver is not None:
            raise StudyError(f"{self.driver.name} is driving. Wait, or end the turn first.")
        if not self.queue:
            raise StudyError("No student waits for a turn. Start a round.")
        self.driver = student = self.queue.pop(0)
        super()._begin(student)
        self._drives[self.round, student.key].label = self.label

    def skip(self) -> None:
        """End the turn of the student who is driving; if nobody is, skip the first one of the queue."""
        if self.driver is not None:
            self._end_turn()
        elif self.queue:
            self.queue.pop(0)

    def count(self, drive: Drive, n_cells: float | None) -> None:
        """Note the cells that the lecturer counted after a turn.

        Raises:
            StudyError: The arena cannot have this number of cells.
        """
        most = self.arena.grid.n_cells
        if n_cells is None or n_cells != round(n_cells) or not 0 <= n_cells <= most:
            raise StudyError(f"Enter the number of cells that the line crosses, from 0 to {most}.")
        drive.counted = int(n_cells)
        self._save(drive)

    @property
    def uncounted(self) -> Drive | None:
        """The first drive of the round whose cells the lecturer has to count; None if there is none."""
        if self.is_observed:
            return None
        return next((drive for drive in self.drives() if drive.is_over and drive.counted is None), None)

    def _check_robot(self) -> None:
        if problem := self.shared.problem:
            raise StudyError(problem)

    def _begin(self, student: Student) -> None:
        self.queue.append(student)

    def _end_turn(self) -> None:
        if self.driver is not None and (drive := self._drives.get((self.round, self.driver.key))) is not None:
            self._end(drive)

    def _end(self, drive: Drive) -> None:
        if drive.is_over:
            return
        if self.driver is not None and self.driver.key == drive.student:
            self.driver = None
            self.shared.stop()
        super()._end(drive)
        if not self.is_observed:
            drive.path = []  # nobody has seen it

    def reset(self) -> None:
        """End the round; its results stay in the file."""
        self.queue.clear()
        super().reset()

    def _is_round_over(self) -> bool:
        return self.driver is None and not self.queue

    # students

    def may_drive(self, student: Student) -> bool:
        """Return True if it is this student's turn."""
        return student is self.driver

    def leave(self, student: Student, page: asyncio.Event) -> None:
        """Close a page of a student; the turn ends with the student's last page."""
        student.pages.discard(page)
        student.seen = self._clock()
        if student is self.driver:
            self.shared.release()
            if not student.pages:
                self._end_turn()

    def _note_stops(self, student: Student) -> None:
        if (hand := self.shared.hand) is not None:
            student.n_stops = hand.n_stops

    def hear(self, student: Student, word: Word) -> bool:
        """Do what a page says; only the driver's page moves and stops the robot."""
        if student is self.driver:
            self._note_stops(student)  # a stop by the lecturer counts from the next command on
            if word.kind == "stop":
                self.shared.stop()
        if word.kind == "join" or student is self.driver:
            return super().hear(student, word)
        student.n_words += 1
        return student.n_words <= MOST_WORDS

    def _switch_on(self, student: Student) -> None:
        student.robot = self.shared

    def _switch_off(self, student: Student) -> None:
        if student is self.driver:
            self._end_turn()
        if student in self.queue:
            self.queue.remove(student)
        super()._switch_off(student)

    def n_cells(self, student: Student) -> int:
        """Return the number of cells of the drive that a student sees: the driver's, or else the student's own."""
        return super().n_cells(self.driver or student)

    def seconds_left(self, student: Student) -> float:
        """Return the rest of that drive [s]."""
        return super().seconds_left(self.driver or student)

    def words_for(self, student: Student) -> str:
        """Return what a student's page says about the turns; empty while the student drives."""
        if self.phase != "round":
            return (
                "All turns are over."
                if self.phase == "over"
                else "You drive in turns. Wait for the first one."
            )
        if student is self.driver:
            return "" if self.shared.is_ready else "The robot is put at its start."
        now = f"{self.driver.name} is driving. " if self.driver is not None else ""
        if student in self.queue:
            before = self.queue.index(student)
            return now + ("You are next." if not before else f"{counted(before, 'student')} before you.")
        return f"{now}Your turn is over."

    # time

    async def step(self) -> None:
        """Note where the robot is, save what is new, and tell the pages."""
        if self.driver is not None:
            self.shared.advance(self._clock())
            self._note_stops(self.driver)
            if self.shared.hand is None:
                self._end_turn()
        await super().step()

    def _advance(self, student: Student, robot: StudentRobot, now: float) -> None:
        if student is self.driver:
            if self.shared.is_ready:
                self._note_drive(student, robot, now)
            else:
                student.began = now
        elif not student.pages and now - student.seen > GONE_S:
            self._switch_off(student)
