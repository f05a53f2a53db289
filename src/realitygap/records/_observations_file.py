"""A file of observed trials, one line of JSON for each, which are stored as they end.

The first line says of what, where and how much was observed. A trial is on the disk when `append` returns; a crash in
the midst of a line costs that trial and no other. A robot's trial has a line when it begins and, if a person has to say
what they saw, one when the robot has driven: after a crash the file says which trial was under way.
"""

from __future__ import annotations

import datetime
import json
import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from realitygap._closed_on_exit import ClosedOnExit
from realitygap._limits import MOST_LINES_BYTES, LimitError, parse_json, read_file
from realitygap._version import __version__
from realitygap.errors import RecordError

from ._ending import UNDER_WAY
from ._files import reading
from ._inside import open_inside
from ._lock import lock_descriptor
from ._output import refuse_results, write_whole
from ._trial_record import OBSERVATIONS, Observe, TrialRecord

OBSERVATIONS_FORMAT = "realitygap observations 1"
_WIDTHS = {"commands": 2, "wheels": 2, "poses": 3}


@dataclass(frozen=True)
class ObservationsHead:
    """The common head of all trials of a file.

    Attributes:
        target: Platform, as the user named it.
        label: Label of its trials in figures: SIM, TWIN, EMULATED or REAL.
        robot: Name or file of the robot.
        arena: Arena, as in `Arena.to_dict`.
        step_s: Duration of a command [s].
        observe: Observation level.
        identity: Identity of the target, which does not depend on its name; empty if only the name identifies it.
    """

    target: str
    label: str
    robot: str
    arena: Mapping[str, Any]
    step_s: float
    observe: Observe
    identity: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, equal to those that a file gives."""
        plain: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        return plain


@dataclass(frozen=True)
class Observations:
    """The trials of a file.

    Attributes:
        head: Common values of the trials.
        trials: Trials in the order in which they ended.
        problem: Description of what was left out, with the reason; empty if nothing was.
        under_way: The last line of each trial that never ended, because the program did: what the robot drove, if its
            `end` is "driven".
        notes: Notes, oldest first.
    """

    head: ObservationsHead
    trials: tuple[TrialRecord, ...]
    problem: str = ""
    under_way: tuple[TrialRecord, ...] = ()
    notes: tuple[Note, ...] = ()


class Note(TypedDict):
    """A remark of a person on a trial, or on the whole file if `trial` is None; `time` is UTC."""

    trial: int | None
    text: str
    who: str
    time: str


def not_compared(there: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """Return the key that does not distinguish targets: `target` if identities are known, otherwise `identity`."""
    return "target" if there.get("identity") and wanted.get("identity") else "identity"


def trial_to_dict(trial: TrialRecord) -> dict[str, Any]:
    """Return a trial as plain values, without those that it lacks; an unknown voltage of the battery is null."""
    values = {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in vars(trial).items()
    }
    if not len(trial.last_readings):
        del values["last_readings"], values["last_stalled"]
    for name in ("times", "raw", "problem"):
        if not values[name]:
            del values[name]
    return {**values, "battery_v": None if math.isnan(trial.battery_v) else trial.battery_v}


def trial_from_dict(values: Mapping[str, Any]) -> TrialRecord:
    """Return the trial that `trial_to_dict` described.

    Raises:
        ValueError: Something is missing, or not of the shape that it has in a trial.
    """
    try:
        battery_v, measured = values["battery_v"], values.get("end_pose")
        trial = TrialRecord(
            start=_pose(values["start"]),
            step_s=float(values["step_s"]),
            commands=_table("commands", values),
            readings=_table("readings", values),
            stalled=np.array(values["stalled"], np.bool_).reshape(-1),
            cells=tuple(int(cell) for cell in values["cells"]),
            wheels=_table("wheels", values),
            poses=_table("poses", values),
            genome=str(values["genome"]),
            number=int(values["number"]),
            purpose=str(values["purpose"]),
            battery_v=math.nan if battery_v is None else float(battery_v),
            end=str(values["end"]),
            end_pose=None if measured is None else _pose(measured),
            last_readings=np.array(values.get("last_readings", []), np.float64),
            last_stalled=bool(values.get("last_stalled", False)),
            times=np.array(values.get("times", []), np.float64).reshape(-1),
            raw=_table("raw", {"raw": values.get("raw", [])}),
            problem=str(values.get("problem", "")),
        )
    except KeyError as error:
        raise ValueError(f"a trial without {error}") from None
    except (TypeError, ValueError) as error:
        raise ValueError(f"a trial that cannot be read ({error})") from None
    t = len(trial.commands)
    rows = {"readings": len(trial.readings), "stalled": len(trial.stalled)}
    rows |= {
        name: len(table) - 1
        for name, table in (("wheels", trial.wheels), ("poses", trial.poses))
        if len(table)
    }
    looks = t + (len(trial.last_readings) > 0)
    rows |= {name: n - looks + t for name in ("times", "raw") if (n := len(getattr(trial, name)))}
    for name, n in rows.items():
        if n != t:
            raise ValueError(f"a trial with {t} commands whose {name} are of {n}")
    for name in ("start", "commands", "readings", "wheels", "poses", "times", "raw"):
        if not np.all(np.isfinite(getattr(trial, name))):
            raise ValueError(f"a trial whose {name} are not all numbers")
    return trial


def _pose(values: Any) -> tuple[float, float, float]:
    x, y, heading = map(float, values)
    return x, y, heading


def _table(name: str, values: Mapping[str, Any]) -> NDArray[np.float64]:
    rows = values[name]
    width = _WIDTHS.get(name) or (len(rows[0]) if rows else 0)
    table: NDArray[np.float64] = np.array(rows, np.float64).reshape(len(rows), width)
    return table


class ObservationsFile(ClosedOnExit):
    """A file to which trials are added as they end.

    An existing file is extended. An incomplete last line is cut off and described in `problem`. A target whose identity
    is known on both sides may have another name, such as another port.

    Args:
        path: Path of the file. It is made if it does not exist.
        head: Common values of its trials.
        within: The folder that the user named, if the name of the file in it is not the user's.

    Attributes:
        trials: Trials in the file when it was opened.
        under_way: Trials that never ended, by purpose, number, and controller; `append` adds and removes them.
        problem: Description of what was cut off; empty if nothing was.

    Raises:
        RecordError: It is another file, of another target, damaged, or cannot be written.
    """

    def __init__(self, path: Path | str, head: ObservationsHead, *, within: Path | None = None) -> None:
        self.path = Path(path)
        if within is None and self.path.is_symlink():  # the user named it
            self.path = self.path.resolve()
        self._within = self.path.parent if within is None else within
        self.head = head
        self.trials: tuple[TrialRecord, ...] = ()
        self.under_way: dict[tuple[str, int, str], TrialRecord] = {}
        self.problem = ""
        refuse_results(self.path)
        held = self._take_up()
        try:
            descriptor = open_inside(self._within, self.path, os.O_RDWR | os.O_CREAT)
            self._file = os.fdopen(descriptor, "r+b", buffering=0)
            self._lock()
            self._file.truncate(held)
            self._file.seek(max(held - 1, 0))
            if not held:
                self._write(_first_line(head))
            elif self._file.read(1) != b"\n":
                self._write(b"\n")  # the last line is whole, and only its end was cut off
        except OSError as error:
            raise self._cannot(error) from error

    def _take_up(self) -> int:
        """Return the number of existing bytes to keep."""
        if not self.path.exists():
            return 0
        with reading(self.path):
            data = read_file(self.path, MOST_LINES_BYTES, plain=True)
        if b"\n" not in data and _first_line(self.head).startswith(data):
            return 0  # a crash while the first line was written
        found, held = _parse(self.path, data)
        there, wanted = found.head.to_dict(), self.head.to_dict()
        of_no_matter = not_compared(there, wanted)
        other = [name for name in wanted if name != of_no_matter and there[name] != wanted[name]]
        if other and not found.trials and not found.under_way:
            return 0  # it has no trials, so it may be rewritten
        if other:
            what = "; ".join(f"{name} {_short(there[name])} and not {_short(wanted[name])}" for name in other)
            raise RecordError(
                f"{self.path} has trials of another kind: {what}. They cannot be combined. Name another file."
            )
        self.trials, self.problem = found.trials, found.problem
        for trial in found.under_way:
            _keep_under_way(self.under_way, trial)
        return held

    def append(self, trial: TrialRecord) -> None:
        """Keep a trial; it is on the disk when this returns.

        Raises:
            RecordError: It cannot be written; what was kept before is safe.
        """
        try:
            self._write(_line(trial_to_dict(trial)))
        except OSError as error:
            raise self._cannot(error) from error
        _keep_under_way(self.under_way, trial)

    def _lock(self) -> None:
        """Keep other programs from writing to the file until it is closed.

        Raises:
            RecordError: Another program writes to it.
        """
        try:
            lock_descriptor(self._file.fileno())
        except (BlockingIOError, PermissionError) as error:
            self._file.close()
            raise RecordError(
                f"{self.path} is in use: another program saves trials in it. Wait until it ends, or name another "
                "file."
            ) from error
        except OSError:  # this file system cannot lock files
            pass

    def note(self, text: str, who: str, trial: int | None = None) -> None:
        """Keep a remark on a trial or on the whole file.

        Raises:
            RecordError: It cannot be written.
        """
        time = datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")
        try:
            self._write(_line({"note": text, "trial": trial, "who": who, "time": time}))
        except OSError as error:
            raise self._cannot(error) from error

    def _write(self, line: bytes) -> None:
        n = self._file.write(line)
        os.fsync(self._file.fileno())
        if n != len(line):
            raise OSError(0, "it is full")

    def _cannot(self, error: OSError) -> RecordError:
        return RecordError(
            f"Could not write {self.path}: {error.strerror or error}. Earlier trials are safe. Make room, or "
            "name a file that can be written."
        )

    def close(self) -> None:
        """Let go of it; safe to call twice."""
        self._file.close()


def write_observations(path: Path | str, head: ObservationsHead, trials: Iterable[TrialRecord]) -> None:
    """Write trials into a new file; an existing one is replaced.

    Raises:
        RecordError: It cannot be written.
    """
    write_whole(Path(path), [_first_line(head), *(_line(trial_to_dict(trial)) for trial in trials)])


def is_observations(path: Path | str) -> bool:
    """Return whether a file begins as one with observed trials does, of this version or another."""
    path = Path(path)
    if not path.is_file():
        return False
    with reading(path), path.open("rb") as file:
        return b"realitygap observations" in file.read(200)


def read_observations(path: Path | str) -> Observations:
    """Read the trials of a file; a torn last line is left out, and `problem` says so.

    Raises:
        RecordError: There is none, it is of another format, or damaged before its last line.
    """
    path = Path(path)
    if not path.exists():
        raise RecordError(f"There is no file {path}. Name one with observed trials.")
    with reading(path):
        data = read_file(path, MOST_LINES_BYTES)
    return _parse(path, data)[0]


def _parse(path: Path, data: bytes) -> tuple[Observations, int]:
    """Return the content of a file, and the number of its bytes that are complete."""
    first, newline, rest = data.partition(b"\n")
    head = _head(path, first)
    trials: list[TrialRecord] = []
    under_way: dict[tuple[str, int, str], TrialRecord] = {}
    notes: list[Note] = []
    held = len(first) + len(newline)
    problem = ""
    lines = rest.split(b"\n")
    for number, line in enumerate(lines, 2):
        is_last = number == len(lines) + 1
        if is_last and not line:
            break
        try:
            values = _object(line)
            trial = None if "note" in values else trial_from_dict(values)
            if trial is None:
                notes.append(_note_from_dict(values))
        except ValueError as error:
            if not is_last:
                raise RecordError(f"{path} is damaged: line {number} is {error}.") from None
            problem = (
                f"{path}: the last line, {len(line)} bytes, was cut off in a crash, and its trial is lost."
            )
        else:
            held += len(line) + (not is_last)
            if trial is not None:
                _keep_under_way(under_way, trial)
                if trial.end not in UNDER_WAY:
                    trials.append(trial)
    return Observations(head, tuple(trials), problem, tuple(under_way.values()), tuple(notes)), held


def _keep_under_way(under_way: dict[tuple[str, int, str], TrialRecord], trial: TrialRecord) -> None:
    """Keep the trials that have not ended, by purpose, number, and controller."""
    key = trial.purpose, trial.number, trial.genome
    under_way.pop(key, None)
    if trial.end in UNDER_WAY:
        under_way[key] = trial


def _note_from_dict(values: Mapping[str, Any]) -> Note:
    texts = [values.get(name) for name in ("note", "who", "time")]
    trial = values.get("trial")
    if not all(isinstance(text, str) for text in texts) or not isinstance(trial, int | None):
        raise ValueError("a note that cannot be read")
    return Note(trial=trial, text=str(texts[0]), who=str(texts[1]), time=str(texts[2]))


def _object(line: bytes) -> dict[str, Any]:
    try:
        values = parse_json(line, nan=True)
    except LimitError:
        raise
    except ValueError:
        raise ValueError("no JSON") from None
    if not isinstance(values, dict):
        raise ValueError("no object")
    return values


def _head(path: Path, line: bytes) -> ObservationsHead:
    try:
        values = _object(line)
    except ValueError:
        values = {}
    if values.get("format") != OBSERVATIONS_FORMAT:
        raise RecordError(
            f"{path} is not a file of observed trials, or of another version: its first line does not say "
            f"{OBSERVATIONS_FORMAT!r}. Name one that this realitygap ({__version__}) wrote."
        )
    values.setdefault("identity", "")
    names = ObservationsHead.__dataclass_fields__
    missing = [name for name in names if name not in values]
    if missing or values["observe"] not in OBSERVATIONS:
        what = f"has no {', '.join(missing)}" if missing else f"says observe {values['observe']!r}"
        raise RecordError(f"{path} is damaged: its first line {what}.")
    return ObservationsHead(**{name: values[name] for name in names})


def _first_line(head: ObservationsHead) -> bytes:
    return _line({"format": OBSERVATIONS_FORMAT, **head.to_dict(), "realitygap": __version__})


def _line(values: Mapping[str, Any]) -> bytes:
    return json.dumps(values, separators=(",", ":"), allow_nan=False).encode() + b"\n"


def _short(value: Any) -> str:
    if isinstance(value, Mapping):
        return f"{value.get('name', '...')!r}"
    return repr(value)
