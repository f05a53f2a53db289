"""A digest of rows that depends only on their values.

Every column is hashed separately, as a stream of little-endian values in the order of the rows. A list has two streams,
its lengths and its entries, so that rows may arrive in chunks of any size. NaN has one pattern. A null is a mark in a
second stream and 0 in the first. -0.0 stays -0.0.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap.records._columns import Column, columns_in

Stream = tuple[str, npt.NDArray[Any]]
"""A stream's name, which ends in its type, and its values: (k,), contiguous, little-endian."""


class RowsDigest:
    """The digest of one condition's rows, fed in key order, in any portions."""

    def __init__(self) -> None:
        self._hashes: dict[str, Any] = {}
        self._n_rows = 0

    def update(self, streams: Iterable[Stream], n_rows: int) -> None:
        """Take in the `streams` of the next `n_rows` rows."""
        self._n_rows += n_rows
        for name, values in streams:
            if name not in self._hashes:
                self._hashes[name] = hashlib.sha256()
            self._hashes[name].update(values.data)

    def hexdigest(self) -> str:
        """Return the sha256 over the number of rows and the hash of each stream."""
        streams = {name: stream.hexdigest() for name, stream in self._hashes.items()}
        return _hash_json({"n_rows": self._n_rows, "streams": streams})


def rows_digest(frame: pl.DataFrame) -> str:
    """Return the digest of all rows of a frame with the columns of `SCHEMA`, as hexadecimal sha256."""
    digest = RowsDigest()
    digest.update(row_streams(frame), frame.height)
    return digest.hexdigest()


def study_digest(results_version: int, conditions: dict[str, tuple[str, str]]) -> str:
    """Return the digest of a study as hexadecimal sha256.

    Args:
        results_version: Results version that computed the numbers.
        conditions: Tuples (hash of the condition, digest of its rows) by name. Their order does not matter.
    """
    return _hash_json({"results_version": results_version, "conditions": conditions})


def row_streams(frame: pl.DataFrame) -> Iterator[Stream]:
    """Yield the values of a frame as streams to hash; the condition's name is hashed once, by `study_digest`."""
    for column in columns_in(frame):
        if column.name != "condition":
            yield from _streams(column.name, column, frame[column.name])


def _streams(name: str, column: Column, series: pl.Series) -> Iterator[Stream]:
    is_list = isinstance(column.dtype, pl.List)
    if is_list:
        lengths = series.list.len()
        yield _stream(f"{name}.length", lengths)
        occupied = lengths > 0
        # explode() would put a null where a list is empty
        series = (series if occupied.all() else series.filter(occupied)).explode()
    if column.fields:
        for field in column.fields:
            yield from _streams(f"{name}.{field.name}", field, series.struct.field(field.name))
    elif is_list:
        yield _stream(name, series)
    else:
        if column.nullable:
            yield _stream(f"{name}.null", series.is_null())
            series = series.fill_null(0.0)
        yield _stream(name, series)


def _stream(name: str, series: pl.Series) -> Stream:
    values = np.ascontiguousarray(series.to_numpy())
    if values.dtype.kind == "f":
        missing = np.isnan(values)
        if missing.any():
            values = np.where(missing, values.dtype.type(np.nan), values)
    little = values.dtype.newbyteorder("<")
    return f"{name} {little.kind}{little.itemsize}", values.astype(little, copy=False).view(np.uint8)


def _hash_json(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True, separators=(",", ":")).encode()).hexdigest()
