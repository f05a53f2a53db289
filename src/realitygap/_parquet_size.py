"""The size of a Parquet file by its own description, read before polars is given the file.

A few bytes can stand for gigabytes: pages are compressed, and a run of equal values is one number. polars makes room
for what the file says. So its description and the head of each page are read here first, in Thrift's compact protocol.

Source: the Parquet format, `parquet.thrift`; Thrift's compact protocol.
"""

from __future__ import annotations

import mmap
from typing import Any, NamedTuple

from realitygap._limits import MOST_CHUNK_BYTES, LimitError

MOST_VALUES = MOST_CHUNK_BYTES // 8
"""Maximum number of values in all columns together."""
Bytes = bytes | mmap.mmap
_MOST_DEPTH = 16
_MOST_ITEMS = 1_000_000
_WIDTH = 8
"""Width of the length and the mark at a file's end [bytes]."""


class Part(NamedTuple):
    """The size of a column in a group of rows: by the description or by the heads of its pages, the larger of both.

    Attributes:
        column: Name of the column, or of the column that it is in.
        n_bytes: Decompressed bytes.
        n_values: Values.
        page: Values of its largest page; 8 bytes are one, too.
    """

    column: str
    n_bytes: int
    n_values: int
    page: int


def check_size(parquet: Bytes) -> None:
    """Raise an error if a Parquet file holds more than memory has room for.

    Raises:
        LimitError: The file holds more.
        ValueError: It is not a Parquet file.
    """
    parts = [part for group in group_sizes(parquet) for part in group]
    n_bytes, n_values = sum(part.n_bytes for part in parts), sum(part.n_values for part in parts)
    if n_bytes > MOST_CHUNK_BYTES or n_values > MOST_VALUES:
        raise LimitError(
            f"it holds {n_values:,} values in {n_bytes:,} bytes, expected at most {MOST_VALUES:,} in "
            f"{MOST_CHUNK_BYTES:,}"
        )


def group_sizes(parquet: Bytes) -> list[list[Part]]:
    """Return the sizes of the columns in each group of rows. A column in a column, such as of a list, is one of them.

    Raises:
        ValueError: It is not a Parquet file.
    """
    try:
        return [
            [_part(parquet, column[3], _count(group[3])) for column in group[1]]
            for group in _description(parquet)[4]
        ]
    except (IndexError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"its description cannot be read ({type(error).__name__})") from None


def _description(parquet: Bytes) -> dict[int, Any]:
    length = int.from_bytes(parquet[-_WIDTH:-4], "little")
    if not 0 < length <= len(parquet) - _WIDTH:
        raise ValueError("its description is longer than the file")
    return _Thrift(parquet, len(parquet) - _WIDTH - length).struct()


def _part(parquet: Bytes, about: dict[int, Any], n_rows: int) -> Part:
    begin = min(about[9], about.get(11) or about[9])
    pages = _pages(parquet, _count(begin), _count(about[7]))
    n_bytes, n_values = (sum(sizes) for sizes in zip(*pages, strict=True)) if pages else (0, 0)
    return Part(
        about[3][0].decode("utf-8", "replace"),
        max(_count(about[6]), n_bytes),
        max(_count(about[5]), n_values, n_rows),
        max((max(values, size // 8) for size, values in pages), default=0),
    )


def _pages(parquet: Bytes, begin: int, n_bytes: int) -> list[tuple[int, int]]:
    """Return the decompressed bytes and values of each page of a column."""
    pages = []
    at, end = begin, begin + n_bytes
    while at < end:
        thrift = _Thrift(parquet, at)
        head = thrift.struct()
        details = head.get(5) or head.get(8) or head.get(7) or {}
        pages.append((_count(head[2]), _count(details.get(1, 0))))
        at = thrift.at + _count(head[3])
    return pages


def _count(value: Any) -> int:
    if not isinstance(value, int) or value < 0:
        raise ValueError(f"it has a size of {value}")
    return value


class _Thrift:
    """Reads a value from bytes, field by field."""

    def __init__(self, data: Bytes, at: int) -> None:
        self._data = data
        self._n_items = 0
        self.at = at

    def struct(self, depth: int = 0) -> dict[int, Any]:
        """Return the fields of a struct by their numbers."""
        if depth > _MOST_DEPTH:
            raise ValueError("its description is nested too deeply")
        fields: dict[int, Any] = {}
        number = 0
        while head := self._byte():
            number = number + (head >> 4) if head >> 4 else self._zigzag()
            fields[number] = self._value(head & 15, depth)
        return fields

    def _value(self, kind: int, depth: int, *, in_list: bool = False) -> Any:
        self._n_items += 1
        if self._n_items > _MOST_ITEMS:
            raise ValueError("its description is too long")
        if kind in (1, 2):  # a field's truth is its type, a list's a byte
            return self._byte() == 1 if in_list else kind == 1
        if kind == 3:
            return self._byte()
        if kind in (4, 5, 6):
            return self._zigzag()
        if kind == 7:
            self.at += 8
            return None
        if kind == 8:
            length = self._varint()
            self.at += length
            return self._data[self.at - length : self.at]
        if kind in (9, 10):
            head = self._byte()
            length = head >> 4 if head >> 4 < 15 else self._varint()
            return [self._value(head & 15, depth + 1, in_list=True) for _ in range(length)]
        if kind == 12:
            return self.struct(depth + 1)
        raise ValueError(f"its description has a value of type {kind}")

    def _byte(self) -> int:
        self.at += 1
        return self._data[self.at - 1]

    def _varint(self) -> int:
        value = shift = 0
        while (byte := self._byte()) & 128:
            value |= (byte & 127) << shift
            shift += 7
            if shift > 63:
                raise ValueError("its description has a number beyond 64 bits")
        return value | byte << shift

    def _zigzag(self) -> int:
        value = self._varint()
        return (value >> 1) ^ -(value & 1)
