"""Base class of robots that live in this program: how they stop and close."""

from __future__ import annotations

from realitygap._closed_on_exit import ClosedOnExit
from realitygap.errors import RobotError


class ProgramRobot(ClosedOnExit):
    """A robot that lives in this program. Using it after it was closed is an error."""

    _is_open = True
    _closed = "This simulated robot is closed: make a new one."

    def stop(self) -> None:
        """Do nothing, because the robot moves only while a command lasts.

        This is safe at any moment, and if called twice.
        """

    def close(self) -> None:
        """Stop the robot and release it. This is safe if called twice."""
        self.stop()
        self._is_open = False

    def _check_open(self) -> None:
        if not self._is_open:
            raise RobotError(self._closed)
