from __future__ import annotations

import polars as pl
import pytest

from realitygap.errors import RecordError
from realitygap.records import SCHEMA, _chunk
from realitygap.records._chunk import ChunkName, check_condition
from tests.records.rows import make_rows


@pytest.mark.parametrize("condition", ["coverage", "a.b-c_1", "x.000000001-000000002", "-", "0", "a" * 150])
def test_a_name_is_parsed_into_what_it_was_made_from(condition):
    name = ChunkName(condition, 7, 123456789)
    check_condition(condition)
    assert ChunkName.parse(str(name)) == name


def test_a_name_is_padded_to_nine_digits():
    assert str(ChunkName("coverage", 0, 9)) == "coverage.000000000-000000009.parquet"


@pytest.mark.parametrize(
    "name",
    [
        "coverage.parquet",
        "coverage.0-9.parquet",
        "coverage.000000009-000000000.parquet",
        "coverage.000000000-000000009.parquet.bak",
        ".000000000-000000009.parquet",
        "a b.000000000-000000009.parquet",
        ".coverage.000000000-000000009.parquet.17.tmp",
        "coverage.٠٠٠٠٠٠٠٠٠-000000009.parquet",
    ],
)
def test_other_names_are_not_those_of_chunks(name):
    assert ChunkName.parse(name) is None


@pytest.mark.parametrize(
    "name", ["", ".", "..", ".hidden", "a/b", "a\\b", "a b", "ü", "a\n", "a" * 151, None, 3]
)
def test_conditions_that_cannot_name_a_file_are_refused(name):
    with pytest.raises(ValueError, match="cannot name a file"):
        check_condition(name)


@pytest.mark.parametrize("columns", [None, ["replicate", "generation", "individual", "cells"]])
def test_forged_rows_are_refused_though_they_are_sealed(tmp_path, monkeypatch, columns):
    rows = make_rows(n=1)
    forged = {
        "Column 'cells' holds nulls": rows.with_columns(cells=pl.lit(None, SCHEMA["cells"])),
        "rows must be sorted": rows.with_columns(generation=pl.col("generation") * 2**31),
    }
    with monkeypatch.context() as patch:
        patch.setattr(_chunk, "check_rows", lambda *_: 0)
        contents = {
            problem: _chunk.encode_chunk(tmp_path, "coverage", 0, frame, "0")
            for problem, frame in forged.items()
        }
    for problem, (chunk, content) in contents.items():
        chunk.path.write_bytes(content)
        with pytest.raises(RecordError, match=rf"was not written by realitygap: .*{problem}"):
            _chunk.read_rows(chunk.path, columns)
