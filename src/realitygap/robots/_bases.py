"""Base classes of robots: in this program, and behind a port. They stop, close, and are recorded in one way."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from realitygap._closed_on_exit import ClosedOnExit
from realitygap.errors import RecordError, RobotError

from ._clock import Clock
from ._contract import Observation
from ._recording import NoRecorder, Recorder

_SET_UP = ("label", "step_s", "n_sensors", "reading_max")


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


class PortDriver:
    """A robot behind a link. Its calls, and what goes wrong with them, are recorded if a file is named.

    Attributes:
        link: The link to the robot.
        info: Facts about the robot.
    """

    link: Any
    info: Any
    _recorder: Recorder | NoRecorder
    _released: Callable[[], object]
    """Lets go of what a robot that was not closed would still hold."""

    def _record_into(self, path: Path | str | None, clock: Clock) -> Recorder | NoRecorder:
        try:
            self._recorder = NoRecorder() if path is None else Recorder(path, clock)
        except RecordError:
            self.link.close()
            raise
        return self._recorder

    def _record_set_up(self, name: str, **more: object) -> None:
        set_up: Mapping[str, object] = {key: getattr(self, key) for key in _SET_UP}
        self._recorder.begin({"port": name, "robot": asdict(self.info), **set_up, **more})

    def _record_failure(self, name: str, error: BaseException) -> None:
        self._recorder.begin({"port": name, "error": str(error)})
        self._recorder.close()

    @contextlib.contextmanager
    def _noted(self, name: str) -> Iterator[None]:
        """Record what goes wrong with a call."""
        try:
            yield
        except RobotError as error:
            self._recorder.fault(name, error)
            raise

    def _seen(self, seen: Observation) -> Observation:
        """Record an observation, and return it."""
        more = {"channels": seen.channels} if seen.channels else {}
        self._recorder.call("observe", readings=seen.readings, stalled=seen.stalled, raw=seen.raw, **more)
        return seen

    def stop(self) -> None:
        """Stop the motors. This is safe at any moment, and if called twice."""
        if not self.link.is_open:
            return
        try:
            self._recorder.call("stop")
        finally:  # also if the recording fails
            self._stop_motors()

    def close(self) -> None:
        """Stop the motors and close the port. This is safe if called twice.

        Raises:
            RobotError: The motors could not be stopped; the port is closed all the same.
        """
        if not self.link.is_open:
            return
        try:
            self._end()
        finally:
            self.link.close()
            self._released()
            self._recorder.call("close")
            self._recorder.close()

    def _stop_motors(self) -> None:
        raise NotImplementedError

    def _end(self) -> None:
        """Stop the motors for good."""
        self._stop_motors()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.close()
        except RobotError as failure:
            if error is None:
                raise
            error.add_note(str(failure))
