"""The digest against a plain reference, and that it sees every value and nothing else."""

from __future__ import annotations

import hashlib
import json
import math
import struct

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from realitygap.records import COLUMNS
from realitygap.records._digest import RowsDigest, row_streams, rows_digest, study_digest
from tests.records.rows import make_rows

_PACK = {
    pl.UInt8: ("B", "u1"),
    pl.UInt32: ("I", "u4"),
    pl.UInt64: ("Q", "u8"),
    pl.Int32: ("i", "i4"),
    pl.Float64: ("d", "f8"),
    pl.Boolean: ("?", "b1"),
}


def plain_digest(rows: pl.DataFrame) -> str:
    """The digest by the letter: one value at a time, with nothing but the standard library."""
    streams: dict[str, bytes] = {}

    def add(name, dtype, value):
        code, suffix = _PACK[type(dtype)]
        packed = struct.pack(f"<{code}", math.nan if value != value else value)
        streams[f"{name} {suffix}"] = streams.get(f"{name} {suffix}", b"") + packed

    def walk(name, column, value):
        if column.fields:
            for field in column.fields:
                walk(f"{name}.{field.name}", field, value[field.name])
        elif isinstance(column.dtype, pl.List):
            add(f"{name}.length", pl.UInt32(), len(value))
            streams.setdefault(f"{name} {_PACK[type(column.dtype.inner)][1]}", b"")
            for entry in value:
                add(name, column.dtype.inner, entry)
        else:
            if column.nullable:
                add(f"{name}.null", pl.Boolean(), value is None)
            add(name, column.dtype, 0.0 if value is None else value)

    for row in rows.iter_rows(named=True):
        for column in COLUMNS[1:]:
            walk(column.name, column, row[column.name])
    hashes = {name: hashlib.sha256(data).hexdigest() for name, data in streams.items()}
    text = json.dumps({"n_rows": rows.height, "streams": hashes}, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


@pytest.mark.parametrize("condition", ["coverage", "novelty"])
def test_digest_equals_the_plain_reference(condition):
    rows = make_rows(condition)
    assert rows_digest(rows) == plain_digest(rows)


def test_digest_of_one_row_with_empty_lists_equals_the_plain_reference():
    row = make_rows(n=1, generations=1, individuals=1)
    empty = row.with_columns(
        parents=pl.lit([], pl.List(pl.UInt32)),
        cells=pl.lit([], pl.List(pl.UInt8)),
        genome=pl.col("genome").struct.with_fields(
            enabled=pl.lit([], pl.List(pl.Boolean)), weight=pl.lit([], pl.List(pl.Float64))
        ),
    )
    assert rows_digest(empty) == plain_digest(empty)


def test_digest_stays_what_it_is():
    """A change of this number changes every digest that anybody has published."""
    row = pl.DataFrame(
        [
            {
                **{column.name: 0 for column in COLUMNS},
                "condition": "coverage",
                "parents": [1, 2],
                "fitness": 0.5,
                "novelty": None,
                "cells": [7, 8, 255],
                "genome": {
                    "hidden": [5],
                    "biases": [],
                    "innovation": [0, 1],
                    "source": [0, -1],
                    "target": [3, 4],
                    "weight": [-0.0, 1e300],
                    "enabled": [True, False],
                },
                "key": 2**64 - 1,
            }
        ],
        schema={column.name: column.dtype for column in COLUMNS},
    )
    assert rows_digest(row) == plain_digest(row)
    assert rows_digest(row) == "70fbb85ca55b1e25771fd7344851d7b2a76f564e90437cd57aa0a7c2d0587295"


def _leaves():
    for column in COLUMNS[1:]:
        yield from (
            ((column.name, field.name) for field in column.fields)
            if column.fields
            else ((column.name, None),)
        )


def _changed(value):
    """The smallest change of a value: one bit, one entry."""
    if isinstance(value, list):
        return [*value[:-1], _changed(value[-1])] if value else [True]
    if isinstance(value, bool):
        return not value
    if isinstance(value, float):
        return math.nextafter(value, math.inf)
    return 0.0 if value is None else value ^ 1


@pytest.mark.parametrize(("name", "field"), list(_leaves()))
@pytest.mark.parametrize("condition", ["coverage", "novelty"])
@given(row=st.integers(0, 23))
@settings(max_examples=5, deadline=None)
def test_any_changed_value_changes_the_digest(name, field, condition, row):
    rows = make_rows(condition)
    records = rows.rows(named=True)
    if field is None:
        records[row][name] = _changed(records[row][name])
    else:
        records[row][name][field] = _changed(records[row][name][field])
    changed = pl.DataFrame(records, schema=rows.schema)
    assert not changed.equals(rows)
    assert rows_digest(changed) != rows_digest(rows)


def test_an_entry_that_moves_to_the_next_list_changes_the_digest():
    rows = make_rows(n=1, generations=1, individuals=2)
    one, other = (rows.with_columns(cells=pl.Series(cells, dtype=pl.List(pl.UInt8))) for cells in
                  ([[1, 2], [3]], [[1], [2, 3]]))  # fmt: skip
    assert rows_digest(one) != rows_digest(other)


def test_swapped_columns_and_swapped_rows_change_the_digest():
    rows = make_rows()
    swapped = rows.with_columns(coverage_line=rows["coverage_ends"], coverage_ends=rows["coverage_line"])
    order = [1, 0, *range(2, rows.height)]
    assert len({rows_digest(rows), rows_digest(swapped), rows_digest(rows[order])}) == 3


def _with_novelty(value):
    rows = make_rows(n=1, generations=1, individuals=1)
    return rows.with_columns(novelty=pl.Series([value], dtype=pl.Float64))


def test_null_zero_minus_zero_and_not_a_number_are_four_values():
    assert len({rows_digest(_with_novelty(value)) for value in (None, 0.0, -0.0, math.nan)}) == 4


def test_every_not_a_number_is_the_same_value():
    other = np.array([0xFFF8_0000_0000_0001], dtype=np.uint64).view(np.float64)
    rows = _with_novelty(0.0).with_columns(novelty=pl.Series(other))
    assert rows_digest(rows) == rows_digest(_with_novelty(math.nan))


def test_rows_may_come_in_any_portions_and_memory_layouts():
    rows = make_rows("novelty")
    digest = RowsDigest()
    for part in (rows[:1], rows[1:7], rows[7:7], pl.concat([rows[7:10], rows[10:]], rechunk=False)):
        digest.update(row_streams(part), part.height)
    assert digest.hexdigest() == rows_digest(rows)


def test_study_digest_sees_names_hashes_and_version_and_no_order():
    conditions = {"a": ("h", "1"), "b": ("h", "2")}
    base = study_digest(1, conditions)
    assert study_digest(1, dict(reversed(conditions.items()))) == base
    others = [
        study_digest(2, conditions),
        study_digest(1, {"a": ("h", "1")}),
        study_digest(1, {"a": ("h", "1"), "c": ("h", "2")}),
        study_digest(1, {"a": ("h", "1"), "b": ("g", "2")}),
        study_digest(1, {"a": ("h", "2"), "b": ("h", "1")}),
    ]
    assert len({base, *others}) == 6
