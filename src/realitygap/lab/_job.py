"""Work in its own process, as the pages see it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

from realitygap._wording import duration
from realitygap.platforms import names_a_port
from realitygap.robots import typed_port

from ._child import Child
from ._messages import Answer, Answered, Ended, Failure, Interrupted, Message, Pulse, Question, Work

EARLY_S = 2.0
"""Time after which the pace is steady enough for an estimate [s]."""
MOST_POINTS = 4000
"""Largest number of points of a robot's line on a page: 200 s."""


class Job:
    """Something at work.

    The process speaks from the beginning on: attributes are there before this class is initialized.

    Attributes:
        port: Port of the robot that it uses; empty if it uses none.
        ask: Question that somebody has to answer before it goes on; None where nothing waits.
        outcome: What it ended with: a message; None while it goes on.
        is_failed: Whether that was a failure.
        is_link_lost: Whether it failed because the robot did not answer or did not obey.

    Args:
        work: What the process is told first.
        root: Where it works.
        changed: Called after each change, but those of which too many come, from another thread.
    """

    QUIET: ClassVar[tuple[type[Message], ...]] = ()
    """Kinds of messages that are so frequent that pages poll for them."""

    STOPPED: ClassVar = "Stopped."
    LOST: ClassVar = "Its process ended (status {status})."

    SILENT_S: ClassVar = 2.0
    """Time without an answer in a trial from which its robot counts as silent [s]: four commands of half a second,
    because a robot may take some time longer to read its sensors, and a notice that comes and goes helps nobody."""

    port: str = ""

    def __init__(self, work: Work, root: Path, changed: Callable[[], None]) -> None:
        self.ask: Question | None = None
        self.outcome: str | None = None
        self.is_failed = self.is_link_lost = False
        self._answered_s: float | None = None
        self._asking = threading.Lock()
        self._changed = changed
        self._child = Child(work, root, self._hear)

    @property
    def is_over(self) -> bool:
        """True if it has ended."""
        return self.outcome is not None

    @property
    def has_robot(self) -> bool:
        """True if it uses a robot now."""
        return bool(self.port) and not self.is_over

    @property
    def has_met(self) -> bool:
        """True if a robot has answered."""
        return False

    @property
    def is_lost(self) -> bool:
        """True if it had a robot, and the link to it has failed."""
        return self.is_link_lost and self.has_met

    @property
    def age_s(self) -> float:
        """Time since the last answer of a robot that has to answer now [s]; 0 if none has to."""
        return 0.0 if self._answered_s is None else time.monotonic() - self._answered_s

    @property
    def silent_s(self) -> float:
        """The same as long as a robot counts as silent [s]; otherwise 0."""
        age_s = 0.0 if self.is_over else self.age_s
        return age_s if age_s > self.SILENT_S else 0.0

    @property
    def robot_action(self) -> str:
        """Sentence that states what its robot is doing now; empty if it stands still."""
        return ""

    def answer(self, answer: Answer) -> bool:
        """Answer the question of this number; False where it is not asked any more.

        A tap belongs to the question that it was made for: a second one must not answer what is asked next.
        """
        with self._asking:
            if self.ask is None or self.ask.number != answer.number:
                return False
            self.ask = None
        self._child.tell(answer)
        self._changed()
        return True

    def stop_robot(self) -> None:
        """Stop the motors of its robot."""
        self.ask_to_end()

    def ask_to_end(self) -> None:
        """Ask the process to stop its motors and to end. Recorded data are kept."""
        self._child.ask_to_end()

    def end(self) -> None:
        """Ask the process to end, and wait for its end."""
        self._child.end()

    def _hear(self, message: Message) -> None:
        self._take(message)
        if not isinstance(message, self.QUIET):
            self._changed()

    def _take(self, message: Message) -> None:
        """Change by what the process says."""
        match message:
            case Question():
                with self._asking:
                    self.ask = message
            case Answered():
                with self._asking:
                    if self.ask is not None and self.ask.number == message.number:
                        self.ask = None
            case Failure():
                self.is_link_lost = message.is_of_robot
                self._conclude(message.text, is_failed=True)
            case Interrupted():
                self._conclude(self.STOPPED)
            case Ended():
                self.ask = None
                if self.outcome is None:
                    self.is_failed, self.outcome = True, self.LOST.format(status=message.status)

    def _conclude(self, outcome: str, *, is_failed: bool = False) -> None:
        self.is_failed, self.outcome = is_failed, outcome


class Pace:
    """Estimates how long work will take; what was done before it began does not count."""

    def __init__(self) -> None:
        self._first: tuple[float, float] | None = None
        self._last = (0.0, 0.0)

    def note(self, share: float) -> None:
        """Note which share of the work is done, 0 to 1."""
        self._last = (time.monotonic(), share)
        if self._first is None:
            self._first = self._last

    @property
    def seconds_left(self) -> float | None:
        """Time left [s]; None as long as it cannot be estimated."""
        if self._first is None:
            return None
        seconds, done = (last - first for last, first in zip(self._last, self._first, strict=True))
        if seconds < EARLY_S or done <= 0:
            return None
        return max(seconds * (1.0 - self._last[1]) / done, 0.0)

    @property
    def words(self) -> str:
        """Time left in words, with a separator before them; empty as long as it cannot be estimated."""
        left = self.seconds_left
        return "" if left is None else f" · {duration(left)} left"


class MeasuringJob(Job):
    """Trials on a target, which may be a robot.

    Attributes:
        platform: The target.
    """

    QUIET = (Pulse,)

    def __init__(self, work: Work, platform: str, root: Path, changed: Callable[[], None]) -> None:
        self.platform = platform
        self.port = typed_port(platform) if names_a_port(platform) else ""
        super().__init__(work, root, changed)

    @property
    def _done_words(self) -> str:
        """Trials that are saved, in words."""
        raise NotImplementedError

    def _take(self, message: Message) -> None:
        match message:
            case Pulse():
                self._answered_s = time.monotonic() if message.is_driving else None
            case Failure() if message.is_of_robot and self.has_met:
                lost = f"Link lost after {self._done_words} Resume once the robot is back.\n{message.text}"
                super()._take(replace(message, text=lost))
            case _:
                super()._take(message)
