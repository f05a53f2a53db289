"""Text tables: CSV and similar formats of other programs, with any separator, read block by block."""

from __future__ import annotations

import gzip
import io
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO

import numpy as np
import polars as pl

from realitygap._limits import open_plain
from realitygap.errors import LogError

from ._log_map import TextFormat
from ._source import Batch, Floats, check_columns

BLOCK_BYTES = 8 << 20
"""Read at once, so that memory does not grow with the file."""
SNIFFED_LINES = 60
SNIFFED_BYTES = 1 << 18
COMMENTS = (b"#", b"%", b"//")
SEPARATORS = {"tab": "\t", "space": " "}
NOTHING = ("", "nan", "null", "none", "na", "n/a", "-nan", "nan(ind)")
"""Texts for a missing number."""
_BLANKS = re.compile(rb"[ \t]+")
_SECONDS = re.compile(r"(.*stamp)([._/])(?:sec|secs|seconds)")
_SPACE_AT_END = re.compile(rb"(?m)^ | $")


class TextSource:
    """A table in a text file, which may be compressed by gzip.

    Raises:
        LogError: The file cannot be read, or is no table.
    """

    is_table = True
    rate_hz = 0.0

    def __init__(self, path: Path, text: TextFormat) -> None:
        self.path = path
        self._text = text
        lines = self._first_lines()
        data = [line for line in lines if not line.startswith(COMMENTS)]
        if not data:
            raise LogError(f"{path} has no rows. Expected a table of numbers.")
        self._separator = SEPARATORS.get(text.separator, text.separator) or _separator_of(data)
        self._decimal = text.decimal or _decimal_of(data, self._separator)
        widest = max(len(self._cells(line)) for line in data)
        self._has_header = self._is_header(data) if text.header is None else text.header
        self._names = self._header(lines, data, widest)

    def _open(self) -> IO[bytes]:
        try:
            if self.path.suffix == ".gz":
                packed = gzip.GzipFile(fileobj=(file := open_plain(self.path)))
                packed.myfileobj = file  # type: ignore[assignment]  # is closed with it
                return io.BufferedReader(packed)
            return open_plain(self.path)
        except OSError as error:
            raise LogError(f"Cannot read {self.path}: {error.strerror or error}. Name a file.") from None

    def _first_lines(self) -> list[bytes]:
        with self._open() as file:
            try:
                start = file.read(SNIFFED_BYTES)
            except (OSError, EOFError) as error:
                raise LogError(f"Cannot read {self.path}: {error}.") from None
        start = start.removeprefix(b"\xef\xbb\xbf")
        if b"\0" in start:
            raise LogError(
                f"{self.path} is no text. Expected a table as text, or a file that ends in .parquet, .mcap, .db3, "
                "or .bag."
            )
        lines = start.splitlines()[self._text.skip_lines :]
        return [line.strip() for line in lines if line.strip()][:SNIFFED_LINES]

    def _cells(self, line: bytes) -> list[str]:
        text = line.decode("utf-8", "replace").strip()
        cells = text.split() if self._separator == " " else text.split(self._separator)
        return [cell.strip().strip("\"'") for cell in cells]

    def _numbers(self, line: bytes) -> int:
        """Return the number of cells of a line that are numbers."""
        return sum(_is_number(cell, self._decimal) for cell in self._cells(line))

    def _is_header(self, data: list[bytes]) -> bool:
        return not self._numbers(data[0]) and (len(data) == 1 or self._numbers(data[1]) > 0)

    def _header(self, lines: list[bytes], data: list[bytes], widest: int) -> list[str]:
        numbered = [str(k + 1) for k in range(widest)]
        if self._text.names:
            if len(self._text.names) > widest:
                raise LogError(
                    f"{self.path} has {widest} columns, and text.names of the mapping has {len(self._text.names)}. "
                    "Give as many names as columns."
                )
            return [*self._text.names, *numbered[len(self._text.names) :]]
        if self._has_header:
            cells = self._cells(data[0])
            names = [cell or numbered[k] for k, cell in enumerate(cells)] + numbered[len(cells) :]
        else:
            first = lines.index(data[0])
            above = self._cells(lines[first - 1].lstrip(b"#%/ ")) if first else []
            names = above if len(above) == widest else numbered
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise LogError(
                f"{self.path} has several columns of the name {twice[0]!r}. Give text.names in the mapping, or set "
                "text.header = false and name columns by number."
            )
        return names

    def columns(self) -> list[str]:
        """Return the names of all columns; their numbers, counted from 1, are names as well.

        The columns `stamp.sec` and `stamp.nanosec` of a message's header also are one column `stamp`, in seconds.
        """
        return [*self._names, *self._stamps()]

    def _stamps(self) -> dict[str, tuple[str, str]]:
        """Return the columns of the seconds and the nanoseconds of each stamp."""
        stamps = {}
        for name in self._names:
            match = _SECONDS.fullmatch(name)
            for nano in ("nanosec", "nanosecs", "nsec", "nsecs", "nanoseconds"):
                if match and match[1] not in self._names and f"{match[1]}{match[2]}{nano}" in self._names:
                    stamps[match[1]] = (name, f"{match[1]}{match[2]}{nano}")
        return stamps

    def time_of(self, names: Sequence[str]) -> str:
        """Return no column: a table names it in its mapping."""
        return ""

    def batches(self, names: Sequence[str], rows: str = "") -> Iterator[Batch]:
        """Yield batches like `Source.batches`."""
        stamps = {name: both for name, both in self._stamps().items() if name in names}
        plain = [name for name in names if name not in stamps]
        chosen = {
            name: self._index(name) for name in (*plain, *(part for both in stamps.values() for part in both))
        }
        first = 1
        # numbers stand for the names, so that rows may be shorter than the widest, and names may be anything
        head = self._separator.join(str(k) for k in range(len(self._names))).encode() + b"\n"
        for block in self._blocks(rows):
            try:
                frame = pl.read_csv(
                    head + block,
                    infer_schema=False,
                    columns=sorted(set(chosen.values())),
                    separator=self._separator,
                    quote_char='"' if b'"' in block else None,
                    truncate_ragged_lines=True,
                    encoding="utf8-lossy",
                )
            except pl.exceptions.PolarsError as error:
                raise LogError(f"{self.path} cannot be read near row {first}: {error}") from None
            values = {name: self._column(name, frame[str(index)], first) for name, index in chosen.items()}
            values |= {name: values[sec] + values[nano] * 1e-9 for name, (sec, nano) in stamps.items()}
            if len(frame):
                yield Batch(first, values)
            first += len(frame)

    def _index(self, name: str) -> int:
        if name in self._names:
            return self._names.index(name)
        if name.isdecimal() and 1 <= int(name) <= len(self._names):
            return int(name) - 1
        check_columns(self, [name])
        raise AssertionError  # check_columns raises

    def _blocks(self, rows: str) -> Iterator[bytes]:
        """Yield whole lines of the table, cleaned, some megabytes at a time."""
        is_first, rest, to_skip = True, b"", self._text.skip_lines
        header = self._has_header
        with self._open() as file:
            while True:
                try:
                    block = file.read(BLOCK_BYTES)
                except (OSError, EOFError) as error:
                    raise LogError(f"{self.path} is damaged or cut off: {error}.") from None
                if is_first:
                    block, is_first = block.removeprefix(b"\xef\xbb\xbf"), False
                whole, newline, tail = (rest + block).rpartition(b"\n")
                lines, rest = (whole + newline, tail) if block else (rest, b"")
                if b"\r" in lines:
                    lines = lines.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
                while to_skip and lines:
                    lines, to_skip = lines.partition(b"\n")[2], to_skip - 1
                lines = self._cleaned(lines, rows if not header else "")
                if header and lines:
                    lines, header = lines.partition(b"\n")[2], False
                    lines = self._cleaned(lines, rows)
                if lines:
                    yield lines
                if not block:
                    return
                if len(rest) > 4 * BLOCK_BYTES:
                    raise LogError(
                        f"{self.path} has a line of more than {len(rest):,} bytes. Expected a table."
                    )

    def _cleaned(self, lines: bytes, rows: str) -> bytes:
        if self._separator == " ":
            lines = _SPACE_AT_END.sub(b"", _BLANKS.sub(b" ", lines))
        if any(mark in lines for mark in COMMENTS) or b"\n\n" in lines or lines.startswith(b"\n") or rows:
            start = rows.encode() + self._separator.encode() if rows else b""
            kept = [
                line
                for line in lines.split(b"\n")
                if line.strip() and not line.startswith(COMMENTS) and line.startswith(start)
            ]
            lines = b"\n".join(kept) + b"\n" if kept else b""
        return lines.replace(b",", b".") if self._decimal == "," else lines

    def _column(self, name: str, texts: pl.Series, first: int) -> Floats:
        texts = texts.str.strip_chars()
        numbers = texts.cast(pl.Float64, strict=False)
        if numbers.null_count() > texts.null_count():
            if numbers.null_count() == len(numbers):
                moments = texts.str.to_datetime(
                    strict=False, time_unit="ns", time_zone="UTC", ambiguous="null"
                )
                if not moments.null_count() and len(moments):
                    return moments.dt.epoch("ns").cast(pl.Float64).to_numpy() / 1e9
            odd = numbers.is_null() & ~texts.str.to_lowercase().is_in(NOTHING).fill_null(value=True)
            if odd.any():
                row = int(np.flatnonzero(odd.to_numpy())[0])
                raise LogError(
                    f"{self.path}: row {first + row} has {str(texts[row])[:40]!r} in column {name}, expected a number. "
                    "Mend the row, or name another column."
                )
        return numbers.fill_null(np.nan).to_numpy()


def _is_number(cell: str, decimal: str) -> bool:
    try:
        float(cell.replace(",", ".") if decimal == "," else cell)
    except ValueError:
        return False
    return True


def _separator_of(lines: list[bytes]) -> str:
    """Return the separator that cuts most lines into as many cells as most others."""
    texts = [line.decode("utf-8", "replace") for line in lines]
    for separator in ("\t", ";", ","):
        counts = [text.count(separator) for text in texts]
        if min(counts) > 0 and counts.count(counts[-1]) > len(counts) / 2:
            return separator
    return " " if any(" " in text.strip() for text in texts) else ","


def _decimal_of(lines: list[bytes], separator: str) -> str:
    if separator == ",":
        return "."
    text = b"\n".join(lines)
    has_comma = re.search(rb"\d,\d", text) is not None
    return "," if has_comma and re.search(rb"\d\.\d", text) is None else "."
