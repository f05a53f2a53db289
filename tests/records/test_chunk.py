from __future__ import annotations

import pytest

from realitygap.records._chunk import ChunkName, check_condition


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
