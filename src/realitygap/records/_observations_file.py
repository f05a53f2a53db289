"""Observed trials as lines of JSON, for other programs. The first line says of what, where and how much was observed.

Commands of realitygap 0.1 saved their trials in such files: a robot's trial has a line when it begins and, if a person
has to say what they saw, one when the robot has driven. A crash in the midst of a line costs that trial and no other.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from realitygap._limits import MOST_LINES_BYTES, LimitError, parse_json, read_file
from realitygap._version import __version__
from realitygap.errors import RecordError

from ._ending import UNDER_WAY
from ._files import reading
from ._output import write_whole
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


def write_observations(path: Path | str, head: ObservationsHead, trials: Iterable[TrialRecord]) -> None:
    """Write trials into a new file; an existing one is replaced.

    Raises:
        RecordError: It cannot be written.
    """
    write_whole(Path(path), [_first_line(head), *(_line(trial_to_dict(trial)) for trial in trials)])


def read_lines(path: Path) -> Observations:
    """Read the trials of a file of JSON lines; a torn last line is left out, and `problem` says so.

    Raises:
        RecordError: It is of another format, or damaged before its last line.
    """
    with reading(path):
        data = read_file(path, MOST_LINES_BYTES)
    first, _, rest = data.partition(b"\n")
    head = _head(path, first)
    trials: list[TrialRecord] = []
    under_way: dict[tuple[str, int, str], TrialRecord] = {}
    notes: list[Note] = []
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
            if trial is not None:
                key = trial.purpose, trial.number, trial.genome
                under_way.pop(key, None)
                if trial.end in UNDER_WAY:
                    under_way[key] = trial
                else:
                    trials.append(trial)
    return Observations(head, tuple(trials), problem, tuple(under_way.values()), tuple(notes))


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
    try:
        return head_from_dict(values)
    except ValueError as error:
        raise RecordError(f"{path} is damaged: its first line {error}.") from None


def head_from_dict(values: Mapping[str, Any]) -> ObservationsHead:
    """Return the head that `ObservationsHead.to_dict` described.

    Raises:
        ValueError: Something is missing, or there is no such observation level.
    """
    values = {"identity": "", **values}
    names = ObservationsHead.__dataclass_fields__
    missing = [name for name in names if name not in values]
    if missing or values["observe"] not in OBSERVATIONS:
        raise ValueError(f"has no {', '.join(missing)}" if missing else f"says observe {values['observe']!r}")
    return ObservationsHead(**{name: values[name] for name in names})


def _first_line(head: ObservationsHead) -> bytes:
    return _line({"format": OBSERVATIONS_FORMAT, **head.to_dict(), "realitygap": __version__})


def _line(values: Mapping[str, Any]) -> bytes:
    return json.dumps(values, separators=(",", ":"), allow_nan=False).encode() + b"\n"
