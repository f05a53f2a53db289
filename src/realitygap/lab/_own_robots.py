"""Emulated robots that visitors drive by hand: each visitor has one, and none of them occupies the lab's robot."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path

from realitygap.errors import StudyError

from ._control import RobotControl, Visitor
from ._job import Job

GONE_S = 60.0
"""Time without a page after which the emulated robot of a visitor ends [s]."""
MOST = 8
"""Largest number of these robots; each has a process."""


class OwnRobots:
    """The emulated robots of visitors.

    Args:
        root: Folder of the lab.
        lock: Held while anything begins to use a robot.
        changed: Called after each change.
        clock: Returns the time [s].
    """

    def __init__(
        self,
        root: Path,
        lock: threading.RLock,
        changed: Callable[[], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._root, self._lock, self._changed, self._clock = root, lock, changed, clock
        self._robots: dict[str, RobotControl] = {}
        self._seen: dict[str, float] = {}

    def of(self, visitor: Visitor) -> RobotControl | None:
        """Return the control of a visitor's robot, because a page of the visitor shows it; None if there is none."""
        self._seen[visitor.key] = self._clock()
        return self._robots.get(visitor.key)

    def connect(self, port: str, witness: str, visitor: Visitor) -> None:
        """Start an emulated robot for a visitor.

        Raises:
            StudyError: The visitor has one, or there are too many.
        """
        with self._lock:
            running = [robot for robot in self._robots.values() if robot.job is not None]
            if len(running) >= MOST:
                raise StudyError(f"{MOST} emulated robots are in use. Wait until one is disconnected.")
            robot = self._robots.get(visitor.key) or RobotControl(self._root, self._lock, self._changed)
            robot.connect(port, witness, visitor)
            self._robots[visitor.key] = robot
        self.of(visitor)
        self._watch()

    def jobs(self) -> list[Job]:
        """Return the processes of these robots."""
        return [job for robot in list(self._robots.values()) for job in robot.jobs()]

    def end_unseen(self) -> None:
        """End the robots whose visitors have had no page for `GONE_S`."""
        with self._lock:
            for key, robot in list(self._robots.items()):
                if self._clock() - self._seen[key] > GONE_S:
                    for job in robot.jobs():
                        job.ask_to_end()
                    del self._robots[key]

    def _watch(self) -> None:
        """Look for unseen robots now and then, as long as there are robots."""
        self.end_unseen()
        if self._robots:
            waiting = threading.Timer(GONE_S / 6, self._watch)
            waiting.daemon = True
            waiting.start()
