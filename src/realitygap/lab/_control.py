"""Control of the robot: what uses it, who operates it, and how it is stopped."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from realitygap.errors import StudyError
from realitygap.platforms import names_a_port
from realitygap.robots import is_in_this_program

from ._files import refuse_port
from ._hand import Hand, IdentifyJob
from ._job import Job
from ._messages import HandWork
from ._mistakes import Mistakes
from ._study import StudyJob

HANDOVER_S = 20.0
"""Time that an operator has to answer a visitor who requests control of the robot [s]."""
STOPPED_S = 5.0
"""Time for which pages show that the robot was stopped [s]."""


@dataclass(frozen=True)
class Visitor:
    """A visitor at a page.

    Attributes:
        key: Of their browser.
        who: The name that they gave; empty before.
    """

    key: str
    who: str = ""


@dataclass(frozen=True)
class RobotRequest:
    """A visitor's request to control the robot that another visitor operates.

    Attributes:
        visitor: The visitor who requests control.
        operator: The visitor who operates the robot.
        state: `asked`; `kept` after the operator refused; `unanswered` after `HANDOVER_S` without an answer.
    """

    visitor: Visitor
    operator: Visitor
    state: Literal["asked", "kept", "unanswered"] = "asked"


class RobotControl:
    """The robot of a lab: one use of it, and one operator, at a time.

    Attributes:
        hand: The robot that is driven by hand, or was last; None before.
        operator: Who has the robot: one visitor at a time, while others watch; None while nobody has.
        request: Last request to control the robot; None if there was none, or the robot was handed over since.

    Args:
        root: Folder of the lab.
        lock: Held while anything begins to use the robot.
        changed: Called after each change.
    """

    def __init__(self, root: Path, lock: threading.RLock, changed: Callable[[], None]) -> None:
        self._root, self._lock, self._changed = root, lock, changed
        self.hand: Hand | None = None
        self.operator: Visitor | None = None
        self.request: RobotRequest | None = None
        self._user: Job | None = None
        self._asked: dict[str, Hand | IdentifyJob] = {}
        self._stopped_s = -STOPPED_S
        self._lost_before = ""

    # what uses it

    @property
    def job(self) -> Job | None:
        """Job that uses the robot now; None if none does."""
        user = self._user
        return user if user is not None and user.has_robot else None

    @property
    def study_job(self) -> StudyJob | None:
        """The study that uses the robot now; None if none does."""
        job = self.job
        return job if isinstance(job, StudyJob) else None

    @property
    def port(self) -> str:
        """Port of the robot in use; empty if none is."""
        job = self.job
        return "" if job is None else job.port

    @property
    def lost_port(self) -> str:
        """Port of the last robot if the link to it failed, and no robot has answered since; empty otherwise."""
        last = self._user
        if last is None or not last.has_met:
            return self._lost_before
        return last.port if last.is_lost else ""

    @property
    def is_silent(self) -> bool:
        """True if the robot in use has not answered for a while."""
        job = self.job
        return job is not None and job.silent_s > 0

    @property
    def action(self) -> str:
        """Sentence that states what the robot is doing now; empty if it stands still, as far as is known."""
        job = self.job
        return "" if job is None else job.robot_action

    def note(self, job: Job, platform: str = "") -> None:
        """Remember what uses the robot, and whether the link to the robot before it is lost.

        Args:
            job: The job.
            platform: Its platform; one with an emulator in the job's process does not use the lab's robot.
        """
        if job.port and not is_in_this_program(platform):
            self._lost_before, self._user = self.lost_port, job

    def jobs(self) -> list[Job]:
        """Return the jobs that only use a robot: driven by hand, or asked for its name."""
        return [*self._asked.values()]

    def refuse_second(self) -> None:
        """Refuse to use the robot while something uses it.

        Raises:
            StudyError: Something does.
        """
        if (study := self.study_job) is not None:
            raise StudyError(f"The study {study.name!r} uses the robot. Disconnect it there first.")
        if self.job is not None:
            raise StudyError(
                "A robot is connected for driving by hand, a gap, or a calibration. Disconnect it there first."
            )

    def take_for(self, platform: str, visitor: Visitor) -> None:
        """Make a visitor the operator of the robot that a platform needs; do nothing if it needs none.

        Raises:
            StudyError: Something uses the robot.
        """
        if names_a_port(platform) and not is_in_this_program(platform):
            self.refuse_second()
            self.operator, self.request = visitor, None

    def connect(self, port: str, witness: str, visitor: Visitor) -> None:
        """Connect a robot, to be driven by hand by this visitor.

        Raises:
            StudyError: No port is named, or a robot is in use.
        """
        mistakes = Mistakes()
        with mistakes.in_field("port"):
            if not port:
                raise StudyError("This field is empty. Enter a port such as /dev/rfcomm0 or COM3.")
            refuse_port(self._root, port)
        mistakes.refuse()
        with self._lock:
            self.refuse_second()
            if self._is_identifying(port):
                raise StudyError(f"A robot is being looked for on {port}. Wait until the answer is shown.")
            self.hand = self._asked[port] = Hand(HandWork(port, witness), self._root, self._changed)
            self.note(self.hand)
            self.operator, self.request = visitor, None
        self._changed()

    def reply_on(self, port: str) -> str:
        """Return what answered on a port when it was last asked; empty if it was not."""
        asked = self._asked.get(port)
        return "" if asked is None else asked.reply

    def identify(self, port: str) -> None:
        """Ask the robot on a port for its name. This sends bytes to the device, whatever it is.

        Raises:
            StudyError: The port cannot be used, or something uses it.
        """
        refuse_port(self._root, port)
        with self._lock:
            if self._is_identifying(port):
                return
            if self.port == port:
                raise StudyError(f"The robot on {port} is in use. Disconnect it first.")
            self._asked[port] = IdentifyJob(port, self._root, self._changed)
        self._changed()

    def _is_identifying(self, port: str) -> bool:
        asked = self._asked.get(port)
        return isinstance(asked, IdentifyJob) and not asked.is_over

    # who operates it

    def may_operate(self, visitor: Visitor) -> bool:
        """Return True if this visitor has the robot, or nobody has."""
        return self.job is None or self.operator is None or self.operator.key == visitor.key

    @property
    def operator_name(self) -> str:
        """Name of the visitor who operates the robot."""
        return (self.operator.who if self.operator else "") or "Another visitor"

    def take(self, visitor: Visitor) -> None:
        """Make the visitor who began to use a robot its operator."""
        with self._lock:
            self.operator, self.request = visitor, None
        self._changed()

    def rename(self, visitor: Visitor) -> None:
        """Remember the new name of a visitor, if they operate the robot."""
        if self.operator is not None and self.operator.key == visitor.key:
            self.operator = visitor

    def ask(self, visitor: Visitor) -> None:
        """Request control of the robot; a robot that nobody operates is handed over immediately.

        Raises:
            StudyError: Another visitor's request is waiting for an answer.
        """
        with self._lock:
            operator, asked = self.operator, self.request
            if self.may_operate(visitor) or operator is None:
                self.take(visitor)
                return
            if asked is not None and asked.state == "asked":
                if asked.visitor.key == visitor.key:
                    return
                raise StudyError(
                    f"{asked.visitor.who or 'Another visitor'} has requested control. Wait for the answer."
                )
            self.request = request = RobotRequest(visitor, operator)
        waiting = threading.Timer(HANDOVER_S, self._end_request, (request, "unanswered"))
        waiting.daemon = True
        waiting.start()
        self._changed()

    def answer_request(self, operator: Visitor, *, yes: bool) -> None:
        """Hand the robot over to the visitor who requests control, or keep it.

        Raises:
            StudyError: No visitor requests control from this operator.
        """
        request = self.request
        if request is None or request.operator.key != operator.key or request.state == "kept":
            raise StudyError("The request for control has ended.")
        if yes:
            self._hand_over(request)
        else:
            self._end_request(request, "kept")

    def take_over(self, visitor: Visitor) -> None:
        """Take control of the robot from an operator who did not answer.

        Raises:
            StudyError: The operator has not had the time to answer, or the robot is moving.
        """
        with self._lock:
            request = self.request
            if request is None or request.visitor.key != visitor.key or request.state != "unanswered":
                raise StudyError(f"Request control first, and wait {HANDOVER_S:.0f} s for the answer.")
            if self.action:
                raise StudyError("The robot is moving. Wait until it stands still, or stop it.")
            self._hand_over(request)

    def _hand_over(self, request: RobotRequest) -> None:
        with self._lock:
            if self.request is not request:
                raise StudyError("The request for control has ended.")
            self.operator, self.request = request.visitor, None
            if self.hand is not None and not self.hand.is_over:
                self.hand.stop_robot()  # a drive pad that is still held drives no more
        self._changed()

    def _end_request(self, request: RobotRequest, state: Literal["kept", "unanswered"]) -> None:
        with self._lock:
            if self.request is request:
                is_current = self.operator is not None and self.operator.key == request.operator.key
                self.request = replace(request, state=state) if is_current else None
        self._changed()

    # how it is stopped

    @property
    def is_just_stopped(self) -> bool:
        """True if a visitor stopped the robot in the last seconds, and it has not been driven since."""
        return time.monotonic() - self._stopped_s < STOPPED_S and not self.action

    def stop(self) -> bool:
        """Stop the motors of the robot in use; return False if there is none."""
        job = self.job
        if job is None:
            return False
        job.stop_robot()
        self._stopped_s = time.monotonic()
        return True
