"""Base class of drivers of robots on a port: the recording of a session, and the end of a `with` block."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from realitygap.errors import RecordError, RobotError

from ._clock import Clock
from ._recording import NoRecorder, Recorder

_SET_UP = ("label", "step_s", "n_sensors", "reading_max")


class PortDriver:
    """A robot behind a link. Its calls, and what goes wrong with them, are recorded if a file is named."""

    link: Any
    info: Any
    _recorder: Recorder | NoRecorder

    def _record_into(self, path: Path | str | None, clock: Clock) -> Recorder | NoRecorder:
        try:
            self._recorder = NoRecorder() if path is None else Recorder(path, clock)
        except RecordError:
            self.link.close()
            raise
        return self._recorder

    def _record_set_up(self, name: str, **more: Any) -> None:
        set_up: Mapping[str, Any] = {each: getattr(self, each) for each in _SET_UP}
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

    def close(self) -> None:
        """Stop the motors and let go of the robot; safe to call twice."""
        raise NotImplementedError

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
