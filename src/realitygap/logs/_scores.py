"""Tables of scores: one row for each trial, or for the mean of a controller, of any robots and simulators."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from realitygap._limits import MOST_TABLE_BYTES, parse_json, read_file
from realitygap.errors import TableError, did_you_mean

COLUMNS: Mapping[str, tuple[str, ...]] = {
    "controller": ("controller", "policy", "arm", "policy_id"),
    "platform": ("platform",),
    "task": ("task", "task_id"),
    "trial": ("trial", "trial_id", "episode_idx"),
    "block": ("block", "scenario_id"),
    "score": ("score", "success"),
    "n": ("n",),
}
"""Names of each column, the first of which counts. Those after `controller` and `policy` are of fieldtrial and
robostats."""

_FIELDTRIAL = ("arm", "condition", "status", "success")
_ROBOSTATS = ("policy_id", "success", "schema_version")
_WORDS = {"true": 1.0, "yes": 1.0, "success": 1.0, "false": 0.0, "no": 0.0, "failure": 0.0}
_MOST_MISTAKES = 20
_LONGEST_NUMBER = 40


@dataclass(frozen=True)
class ScoreRow:
    """A row of a table of scores.

    Attributes:
        place: File and line, for messages.
        controller: Name of the controller.
        platform: Name of the platform.
        task: Name of the task; empty if the table has no tasks.
        block: Name of the conditions that trials of both platforms share, such as a start; empty if unknown.
        trial: Name of the trial; empty if the score is the mean of a controller.
        score: Score of the trial, or mean score.
        n: Number of trials behind a mean; None if unknown.
        decimals: Decimals of the score, as written.
    """

    place: str
    controller: str
    platform: str
    task: str
    block: str
    trial: str
    score: float
    n: int | None
    decimals: int

    @property
    def is_mean(self) -> bool:
        """True if the score is the mean of a controller."""
        return not self.trial


def read_scores(
    path: str | Path, *, platform: str = "", controller: str = "", score: str = ""
) -> list[ScoreRow]:
    """Return the rows of a table of scores.

    A table is a text file with a line of column names, separated by commas, semicolons, or tabs, or a file with a JSON
    object on each line (.jsonl). It may be the export of fieldtrial, of which rows that are not completed are left out,
    or the episode records of robostats.

    Args:
        path: The file.
        platform: Platform of all rows. Default: the column `platform`.
        controller: Controller of all rows. Default: the column `controller` or `policy`.
        score: Name of the column with scores. Default: `score`, or `success` with true and false.

    Raises:
        TableError: The file cannot be read, lacks a column, or has a value that cannot be.
    """
    path = Path(path)
    rows = list(_rows(path))
    if not rows:
        raise TableError(f"{path} has no rows below its column names. Expected a row for each trial or mean.")
    columns = _Columns.of(path, rows, platform, controller, score)
    found, mistakes = [], []
    for line, row in rows:
        try:
            if columns.counts(row):
                found.append(columns.row(f"{path}, line {line}", row))
        except _ValueError as mistake:
            mistakes.append(f"{path}, line {line}: {mistake}")
    if mistakes:
        more = len(mistakes) - _MOST_MISTAKES
        shown = [*mistakes[:_MOST_MISTAKES], *([f"And {more} more."] if more > 0 else [])]
        raise TableError("\n".join(shown))
    if not found:
        raise TableError(f"{path} has no completed trials.")
    return found


class _ValueError(ValueError):
    """A value of a row that cannot be."""


def _rows(path: Path) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield the line and the values of each row, all as text.

    Raises:
        TableError: The file cannot be read, or is no such table.
    """
    try:
        text = read_file(path, MOST_TABLE_BYTES).decode("utf-8-sig")
    except FileNotFoundError:
        raise TableError(f"There is no file {path}. Name a table of scores (.csv or .jsonl).") from None
    except OSError as error:
        raise TableError(f"Cannot read {path}: {error.strerror or error}. Name a table of scores.") from None
    except UnicodeDecodeError:
        raise TableError(f"{path} is not text in UTF-8. Save the table as CSV in UTF-8.") from None
    yield from _json_rows(path, text) if path.suffix.lower() == ".jsonl" else _text_rows(path, text)


def _text_rows(path: Path, text: str) -> Iterator[tuple[int, dict[str, str]]]:
    head = text.partition("\n")[0]
    separator = max(",;\t", key=head.count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator, strict=True)
    try:
        names = [name.strip().lower() for name in next(reader, [])]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise TableError(f"{path} has two columns {twice[0]!r}. Rename one.")
        for values in reader:
            if not any(value.strip() for value in values):
                continue
            if len(values) != len(names):
                raise TableError(
                    f"{path}, line {reader.line_num}: {len(values)} values, expected {len(names)}, one for each column."
                )
            yield reader.line_num, dict(zip(names, (value.strip() for value in values), strict=True))
    except csv.Error as error:
        raise TableError(f"{path}, line {reader.line_num}: {error}. Save the table as CSV.") from None


def _json_rows(path: Path, text: str) -> Iterator[tuple[int, dict[str, str]]]:
    for line, part in enumerate(text.splitlines(), 1):
        if not part.strip():
            continue
        try:
            values = parse_json(part)
        except ValueError as error:
            raise TableError(f"{path}, line {line}: {error}. Expected a JSON object on each line.") from None
        if not isinstance(values, dict):
            raise TableError(f"{path}, line {line}: {part[:40]!r}, expected a JSON object.")
        yield line, {str(name).lower(): _as_text(value) for name, value in values.items()}


def _as_text(value: Any) -> str:
    return "" if value is None else str(value)


@dataclass(frozen=True)
class _Columns:
    """The columns of a table by what they mean, and the values that all rows have in place of a column."""

    names: Mapping[str, str]
    platform: str
    controller: str
    is_fieldtrial: bool
    is_robostats: bool
    has_replicates: bool

    @classmethod
    def of(
        cls,
        path: Path,
        rows: Iterable[tuple[int, Mapping[str, str]]],
        platform: str,
        controller: str,
        score: str,
    ) -> _Columns:
        """Return the columns of a table.

        Raises:
            TableError: One is missing.
        """
        known = dict.fromkeys(name for _, row in rows for name in row)
        names = {
            meaning: next(name for name in choices if name in known)
            for meaning, choices in COLUMNS.items()
            if any(name in known for name in choices)
        }
        if score:
            if score.lower() not in known:
                raise TableError(f"{path} has no column {score!r} (--score). {did_you_mean(score, known)}")
            names["score"] = score.lower()
        for meaning, given, else_ in (
            ("controller", controller, " or policy. If all rows are of one, name it: --controller NAME"),
            ("platform", platform, f". If all rows are of one, name it before the file: NAME={path}"),
            ("score", score, ". Name the column with the scores: --score COLUMN"),
        ):
            if meaning not in names and not given:
                raise TableError(
                    f"{path} has the columns {', '.join(known)}, but no column {meaning}{else_}."
                )
        is_fieldtrial = all(name in known for name in _FIELDTRIAL)
        replicates = {row.get("replicate", "") for _, row in rows}
        return cls(
            names,
            platform,
            controller,
            is_fieldtrial,
            all(name in known for name in _ROBOSTATS),
            is_fieldtrial and len(replicates) > 1,
        )

    def counts(self, row: Mapping[str, str]) -> bool:
        """Return whether a row is a result: fieldtrial also exports trials that were voided or not finished."""
        return not self.is_fieldtrial or row.get("status", "") == "completed"

    def row(self, place: str, row: Mapping[str, str]) -> ScoreRow:
        """Return a row with its values.

        Raises:
            _ValueError: A value cannot be.
        """
        controller, platform = self.controller or self._named(row, "controller"), self.platform
        score, decimals = _number(row.get(self.names["score"], ""), self.names["score"])
        return ScoreRow(
            place,
            controller,
            platform or self._named(row, "platform"),
            self._text(row, "task"),
            block := self._block(row),
            self._text(row, "trial") or block or (place if self.is_robostats else ""),
            score,
            _count(self._text(row, "n")),
            decimals,
        )

    def _block(self, row: Mapping[str, str]) -> str:
        if not self.is_fieldtrial:
            return self._text(row, "block")
        condition = row["condition"]  # its blocks are of one study only
        return f"{condition}/{row['replicate']}" if self.has_replicates else condition

    def _text(self, row: Mapping[str, str], meaning: str) -> str:
        return row.get(self.names.get(meaning, ""), "")

    def _named(self, row: Mapping[str, str], meaning: str) -> str:
        text = self._text(row, meaning)
        if not text:
            raise _ValueError(f"{self.names[meaning]} is empty, expected a name.")
        return text


def _number(text: str, name: str) -> tuple[float, int]:
    """Return a score, and its decimals as written.

    Raises:
        _ValueError: It is none.
    """
    if text.lower() in _WORDS:
        return _WORDS[text.lower()], 0
    try:
        value = float(text) if len(text) <= _LONGEST_NUMBER and "_" not in text else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        hint = " Percent is not guessed: write 0.85 for 85 %." if "%" in text else ""
        raise _ValueError(f"{name} is {text[:40]!r}, expected a number such as 0.85.{hint}")
    digits = text.lower().partition("e")[0].partition(".")[2]
    return value, 9 if "e" in text.lower() else len(digits)


def _count(text: str) -> int | None:
    """Return the number of trials behind a mean.

    Raises:
        _ValueError: It is none.
    """
    if not text:
        return None
    if not (text.isascii() and text.isdecimal() and len(text) < 10 and int(text) > 0):
        raise _ValueError(f"n is {text[:40]!r}, expected a whole number of trials, at least 1.")
    return int(text)
