"""What robots share that live in this program: their ways out."""

from __future__ import annotations

from realitygap._closing import ClosedOnExit
from realitygap.errors import RobotError


class ProgramRobot(ClosedOnExit):
    """A robot that lives in this program: it can be stopped, closed and left, and is not asked once it was closed."""

    _is_open = True
    _closed = "This simulated robot is closed: make a new one."

    def stop(self) -> None:
        """Nothing to do where it moves only while a command lasts; safe to call at any moment, and twice."""

    def close(self) -> None:
        """Stop it and let go of it; safe to call twice."""
        self.stop()
        self._is_open = False

    def _check_open(self) -> None:
        if not self._is_open:
            raise RobotError(self._closed)
