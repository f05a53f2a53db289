"""The size of a Parquet file by its own description, read before polars is given the file.

A few bytes can stand for gigabytes: pages are compressed, and a run of equal values is one number. polars makes room
for what the file says. So its description and the head of each page are read here first, in Thrift's compact protocol.

Source: the Parquet format, `parquet.thrift`; Thrift's compact protocol.
"""

from __future__ import annotations

from typing import Any

from realitygap._limits import MOST_CHUNK_BYTES, LimitError

MOST_VALUES = MOST_CHUNK_BYTES // 8
"""Maximum number of values in all columns together."""
_MOST_DEPTH = 16
_MOST_ITEMS = 1_000_000
_WIDTH = 8
"""Width of the length and the mark at a file's end [bytes]."""


def check_size(parquet: bytes) -> None:
    """Raise an error if a Parquet file holds more than memory has room for.

    Raises:
        LimitError: The file holds more.
        ValueError: It is not a Parquet file.
    """
    try:
        n_bytes, n_values = _sizes(parquet)
    except (IndexError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"its description cannot be read ({type(error).__name__})") from None
    if n_bytes > MOST_CHUNK_BYTES or n_values > MOST_VALUES:
        raise LimitError(
            f"it holds {n_values:,} values in {n_bytes:,} bytes, expected at most {MOST_VALUES:,} in "
            f"{MOST_CHUNK_BYTES:,}"
        )


def _sizes(parquet: bytes) -> tuple[int, int]:
    """Return the decompressed bytes, and values, by the description and by the heads of pages: the larger of both."""
    length = int.from_bytes(parquet[-_WIDTH:-4], "little")
    if not 0 < length <= len(parquet) - _WIDTH:
        raise ValueError("its description is longer than the file")
    described = _Thrift(parquet, len(parquet) - _WIDTH - length).struct()
    n_bytes = n_values = paged_bytes = paged_values = 0
    for group in described[4]:
        for column in group[1]:
            about = column[3]
            n_bytes += _count(about[6])
            n_values += _count(about[5])
            begin = min(about[9], about.get(11) or about[9])
            more_bytes, more_values = _pages(parquet, _count(begin), _count(about[7]))
            paged_bytes += more_bytes
            paged_values += more_values
    return max(n_bytes, paged_bytes), max(n_values, paged_values)


def _pages(parquet: bytes, begin: int, n_bytes: int) -> tuple[int, int]:
    """Return the decompressed bytes and values of the pages of a column."""
    large = values = 0
    at, end = begin, begin + n_bytes
    while at < end:
        thrift = _Thrift(parquet, at)
        head = thrift.struct()
        large += _count(head[2])
        details = head.get(5) or head.get(8) or head.get(7) or {}
        values += _count(details.get(1, 0))
        at = thrift.at + _count(head[3])
    return large, values


def _count(value: Any) -> int:
    if not isinstance(value, int) or value < 0:
        raise ValueError(f"it has a size of {value}")
    return value


class _Thrift:
    """Reads a value from bytes, field by field."""

    def __init__(self, data: bytes, at: int) -> None:
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
            return None
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
