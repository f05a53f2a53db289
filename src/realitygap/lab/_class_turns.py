"""A class with one robot: the students drive it one after the other."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from pathlib import Path

from realitygap._wording import counted
from realitygap.errors import StudyError
from realitygap.robots import Label
from realitygap.world import Pose, paper_arena

from ._class import GONE_S, MOST_WORDS, ROUND_S, Classroom, Student, Word
from ._class_results import Drive
from ._class_robot import StudentRobot
from ._control import RobotControl, Visitor
from ._hand import Hand

CLASS = Visitor("class", "The class")
"""Operator of the robot while students drive it; no browser has this key."""


class SharedRobot:
    """The lab's robot, which one student at a time drives.

    Its process has the guardian of a robot that is driven by hand: the motors stop if commands, page, or lab end.

    Args:
        control: Control of the lab's robot.
        port: Its port.
        witness: HOST:PORT of the witness of an emulator in another program; empty if there is none.

    Attributes:
        path: Its poses since it was put at the start; only the start if nobody observes it.
        n_starts: Number of times that its path began.
    """

    def __init__(self, control: RobotControl, port: str, witness: str) -> None:
        self._control, self._port, self._witness = control, port, witness
        self._hand: Hand | None = None
        self._ready_at: int | None = 0
        self.path: list[Pose] = [Pose(*paper_arena().start)]
        self.n_starts = 1

    def connect(self) -> None:
        """Connect it, unless it is connected.

        Raises:
            StudyError: Something else uses the lab's robot.
        """
        if not self.has_process:
            self._control.connect(self._port, self._witness, CLASS)
            self._hand = self._control.hand

    @property
    def has_process(self) -> bool:
        """True if it is connected, or being connected."""
        return self._hand is not None and not self._hand.is_over

    @property
    def hand(self) -> Hand | None:
        """The connected robot; None if it is not connected, or a visitor of the lab has taken it over."""
        hand = self._hand
        is_ours = hand is not None and not hand.is_over and self._control.may_operate(CLASS)
        return hand if is_ours and hand is not None and hand.label else None

    @property
    def problem(self) -> str:
        """Why it cannot be driven; empty if it can."""
        hand = self._hand
        if hand is None or hand.is_over:
            return (hand.outcome if hand is not None else "") or "The robot is not connected."
        if not self._control.may_operate(CLASS):
            return f"{self._control.operator_name} has taken control of the robot, on the page Robot."
        if not hand.label:
            return f"Connecting to {hand.port}…"
        return "The robot does not answer. If it moves, switch it off." if hand.silent_s else ""

    @property
    def label(self) -> Label:
        """Label of the robot."""
        return "EMULATED" if self._hand is None or self._hand.label == "EMULATED" else "REAL"

    @property
    def is_observed(self) -> bool:
        """True if a witness observes its path and its cells, as for an emulated robot."""
        return self._hand is None or not self._hand.label or self._hand.arena is not None

    @property
    def cells(self) -> tuple[int, ...]:
        """Cells that its line has crossed, in the order of first visits."""
        hand = self.hand
        return () if hand is None or hand.senses is None else tuple(hand.senses.cells)

    @property
    def is_blocked(self) -> bool:
        """True if its motors run, and it does not move."""
        hand = self.hand
        return hand is not None and hand.senses is not None and hand.senses.moves and hand.senses.stalled

    @property
    def is_ready(self) -> bool:
        """True if it is at the start, and a reading has confirmed it."""
        hand = self.hand
        if hand is None or hand.doing is not None:
            return False
        if self._ready_at is None:
            self._ready_at = hand.n_live + 2  # the reading on its way is from before
            self.forget_path()
        return hand.n_live >= self._ready_at

    def put_at_start(self) -> None:
        """Put an observed robot at the start. The lecturer puts any other robot there."""
        if (hand := self.hand) is not None and hand.arena is not None:
            self._ready_at = None
            hand.want("place")
        else:
            self.forget_path()

    def forget_path(self) -> None:
        """Begin its path at the start."""
        self.path = [Pose(*paper_arena().start)]
        self.n_starts += 1

    def advance(self, now: float) -> None:
        """Add its present pose to its path."""
        hand = self.hand
        if hand is not None and hand.senses is not None and hand.senses.pose is not None and self.is_ready:
            self.path.append(Pose(*hand.senses.pose))

    def pull(self, move: float, turn: float) -> None:
        """Drive like this for a moment, if no other command arrives."""
        if (hand := self.hand) is not None and self.is_ready:
            hand.drive(move, turn, hand.n_stops)

    def release(self) -> None:
        """Stop the motors, because the pad was let go."""
        if (hand := self.hand) is not None:
            hand.release()

    def stop(self) -> None:
        """Stop the motors; a pad that is held must be let go before it drives again."""
        if (hand := self.hand) is not None:
            hand.stop_robot()

    def close(self) -> None:
        """Leave it connected for the others; the lab disconnects it at its end."""


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
