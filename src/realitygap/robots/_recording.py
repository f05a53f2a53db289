"""A session with a robot as a file: commands, answers, and their times.

Each line is JSON. The first line describes the robot and the units. A line is written in one call, so after a crash
the file has all exchanges up to the last line.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Required, TypedDict, cast

from realitygap._limits import MOST_LINES_BYTES, parse_json, read_file
from realitygap._version import __version__
from realitygap.errors import RecordError, RecordVersionError
from realitygap.settings import shown

from ._clock import Clock

if TYPE_CHECKING:
    import polars as pl

FORMAT = "realitygap robot recording"
FORMAT_VERSION = 1
UNITS = {
    "t": "s since the recording began, by the robot's clock",
    "took_s": "s from sending a command until its answer was complete",
    "move, turn": "-1 to 1",
    "readings": "0 (nothing detected) to 1 (as near as measurable)",
    "raw": "as the robot sends it",
    "sent, answered": "bytes in hexadecimal, answers with their echo",
}
KINDS = {
    "call": "what the program asked of the robot, and what it saw",
    "wire": "bytes that went over the wire for it",
    "fault": "what went wrong with a call",
}
COLUMNS = {
    "t": float,
    "kind": str,
    "name": str,
    "values": str,
    "sent": str,
    "answered": str,
    "took_s": float,
    "outcome": str,
}
"""Columns of the table of a recording."""


class Line(TypedDict, total=False):
    """A line of a recording: a call with its values, bytes over the wire, or a fault."""

    t: Required[float]
    kind: Required[str]
    name: Required[str]
    values: Mapping[str, Any]
    sent: str
    answered: str
    took_s: float
    outcome: str


class Recorder:
    """Writes a recording line by line during a session.

    Args:
        path: A new file.
        clock: The clock of the robot.

    Raises:
        RecordError: The file exists already, or cannot be written.
    """

    def __init__(self, path: Path | str, clock: Clock) -> None:
        self.path = Path(path)
        self._clock = clock
        self._began_s = clock.now()
        self._started = datetime.now(UTC).isoformat(timespec="milliseconds")
        self._early: list[Line] | None = []  # until it is known who is there
        self._is_broken = False
        try:
            self._file = self.path.open("xb", buffering=0)
        except FileExistsError as error:
            raise RecordError(
                f"{path} exists already. A recording never overwrites a file. Name another file."
            ) from error
        except OSError as error:
            raise RecordError(
                f"Could not write {path}: {error.strerror or error}. Name another file."
            ) from error

    def begin(self, set_up: Mapping[str, object]) -> None:
        """Write the first line, which describes the robot and the set-up, then the lines noted before it."""
        self._write(
            {
                "format": FORMAT,
                "version": FORMAT_VERSION,
                "started": self._started,
                **set_up,
                "software": {"realitygap": __version__, "python": platform.python_version()},
                "system": platform.platform(),
                "units": UNITS,
            }
        )
        early, self._early = self._early or [], None
        for line in early:
            self._write(line)

    def wire(
        self, time_s: float, took_s: float, name: str, sent: bytes, answered: bytes, outcome: str
    ) -> None:
        """Record one command and its answer."""
        line = self._line(time_s, "wire", name)
        line["sent"], line["answered"] = sent.hex(), answered.hex()
        line["took_s"], line["outcome"] = round(took_s, 6), outcome
        self._add(line)

    def call(self, name: str, **values: object) -> None:
        """Record a call of the program, or an observation."""
        line = self._line(self._clock.now(), "call", name)
        if values:
            line["values"] = values
        self._add(line)

    def fault(self, name: str, error: BaseException) -> None:
        """Record an error of a call."""
        line = self._line(self._clock.now(), "fault", name)
        line["outcome"] = str(error)
        self._add(line)

    def _line(self, time_s: float, kind: str, name: str) -> Line:
        return {"t": round(time_s - self._began_s, 6), "kind": kind, "name": name}

    def _add(self, line: Line) -> None:
        if self._early is not None:
            self._early.append(line)
        else:
            self._write(line)

    def _write(self, line: Mapping[str, object] | Line) -> None:
        """Write a line. Only the first failure raises an error, so that the robot can be stopped."""
        if self._is_broken:
            return
        data = json.dumps(line, separators=(",", ":")).encode() + b"\n"
        try:
            n_written = self._file.write(data)
        except OSError as error:
            self._is_broken = True
            raise RecordError(
                f"Could not write {self.path}: {error.strerror or error}. Earlier records are safe."
            ) from error
        if n_written != len(data):
            self._is_broken = True
            raise RecordError(f"Could not write {self.path}: it is full. Earlier records are safe.")

    def close(self) -> None:
        """Close the file. Later lines are skipped."""
        self._is_broken = True
        self._file.close()


class NoRecorder:
    """The recorder of a session that is not recorded."""

    def _nothing(self, *_: object, **__: object) -> None:
        pass

    begin = wire = call = fault = close = _nothing


@dataclass(frozen=True)
class Recording:
    """A recorded session.

    Attributes:
        path: Path of the file.
        header: Description of the robot, the set-up, and the software.
        lines: Exchanges in order: `t` [s], `kind`, `name`, and further values.
        is_whole: Whether the last line is complete. After a crash it may be incomplete, and is left out.
    """

    path: Path
    header: Mapping[str, Any]
    lines: tuple[Line, ...]
    is_whole: bool

    def table(self) -> pl.DataFrame:
        """Return one row for each line, with the columns of `COLUMNS`. Missing values are null."""
        import polars as pl

        rows = [
            {**line, "values": json.dumps(line["values"]) if "values" in line else None}
            for line in self.lines
        ]
        return pl.DataFrame(rows, schema=COLUMNS)


def read_recording(path: Path | str) -> Recording:
    """Read a recording.

    Raises:
        RecordError: The file does not exist, or is damaged before its last line.
        RecordVersionError: Another version wrote the file.
    """
    path = Path(path)
    try:
        data = read_file(path, MOST_LINES_BYTES)
    except OSError as error:
        raise RecordError(f"Could not read {path}: {error.strerror or error}.") from error
    whole, newline, rest = data.rpartition(b"\n")
    lines = (
        [_line(path, number, text) for number, text in enumerate(whole.split(b"\n"), 1)] if newline else []
    )
    if not lines or lines[0].get("format") != FORMAT:
        raise RecordError(f"{path} is not a recording of a robot: its first line is not '{FORMAT}'.")
    if lines[0].get("version") != FORMAT_VERSION:
        raise RecordVersionError(
            f"{path} has version {lines[0].get('version')} of the format, expected {FORMAT_VERSION}. Read it with the "
            f"release of realitygap that wrote it ({lines[0].get('software')})."
        )
    for number, line in enumerate(lines[1:], 2):
        if not {"t", "kind", "name"} <= line.keys() or line["kind"] not in tuple(KINDS):
            raise RecordError(f"{path} is damaged: line {number} has no time, kind or name.")
        wrong = [name for name, value in line.items() if not _is_of_column(name, value)]
        if wrong:
            raise RecordError(
                f"{path} is damaged: in line {number} {wrong[0]} is {shown(line[wrong[0]])}, expected "
                f"{_EXPECTED[COLUMNS[wrong[0]]]}."
            )
    return Recording(path, lines[0], cast("tuple[Line, ...]", tuple(lines[1:])), not rest)


_EXPECTED = {float: "a number", str: "a text"}


def _is_of_column(name: str, value: object) -> bool:
    """Return whether a value of a line has the type of its column. `values` is written as JSON."""
    if name not in COLUMNS or name == "values":
        return True
    return isinstance(value, int | float if COLUMNS[name] is float else str) and not isinstance(value, bool)


def _line(path: Path, number: int, text: bytes) -> dict[str, Any]:
    try:
        line = parse_json(text, nan=True)
    except ValueError as error:
        raise RecordError(f"{path} is damaged: line {number} is no JSON ({error}).") from error
    if not isinstance(line, dict):
        raise RecordError(f"{path} is damaged: line {number} is no object.")
    return line
