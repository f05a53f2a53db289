from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from realitygap.records import COLUMNS, EXTRA_SCHEMA, SCHEMA, ResultsFolder, column_table, list_column
from realitygap.records._columns import check_rows
from realitygap.records._digest import rows_digest
from tests.records.rows import make_rows


def test_table_describes_every_column_and_every_field_of_the_genome():
    table = column_table()
    names = [name for name, _, _ in table]
    fields = [f"{column.name}.{field.name}" for column in COLUMNS for field in column.fields]
    assert [name for name in names if "." not in name] == [*SCHEMA, *EXTRA_SCHEMA]
    assert [name for name in names if "." in name] == fields
    assert len(set(names)) == len(names)
    assert all(description.endswith(".") for _, _, description in table)
    assert {name: kind for name, kind, _ in table}["genome.weight"] == "List(Float64)"


def test_list_column_cuts_padded_rows_to_their_lengths():
    column = list_column(np.array([[1, 2], [3, 4], [5, 6]], dtype=np.uint8), np.array([2, 0, 1]))
    assert column.dtype == pl.List(pl.UInt8)
    assert column.to_list() == [[1, 2], [], [5]]


@pytest.mark.parametrize("shape", [(0, 3), (3, 0), (0, 0)])
def test_list_column_keeps_the_type_when_there_are_no_values(shape):
    column = list_column(np.zeros(shape, dtype=bool), np.zeros(shape[0], dtype=int))
    assert column.dtype == pl.List(pl.Boolean)
    assert column.to_list() == [[]] * shape[0]


@pytest.mark.parametrize("lengths", [[3, 0], [-1, 0], [1]])
def test_list_column_refuses_lengths_that_do_not_fit(lengths):
    with pytest.raises(ValueError, match="length"):
        list_column(np.zeros((2, 2)), np.array(lengths))


def test_rows_that_fit_give_the_last_replicate():
    assert check_rows(make_rows(first=4, n=3), "coverage", 4) == 6


def test_replicates_may_differ_in_their_numbers_of_generations():
    rows = pl.concat([make_rows(n=1, generations=3), make_rows(first=1, n=1, generations=1)])
    assert check_rows(rows, "coverage", 0) == 1


def test_columns_in_another_order_are_fit():
    assert check_rows(make_rows().select(reversed(SCHEMA)), "coverage", 0) == 2


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda rows: rows.drop("key"), "no column 'key'"),
        (lambda rows: rows.with_columns(extra=1), "unknown column 'extra'"),
        (
            lambda rows: rows.with_columns(pl.col("stalls").cast(pl.Int64)),
            "'stalls' is Int64, expected UInt32",
        ),
        (lambda rows: rows.head(0), "no rows"),
        (lambda rows: rows.with_columns(fitness=pl.lit(None, pl.Float64)), "'fitness' holds nulls"),
        (
            lambda rows: rows.with_columns(cells=pl.lit([1, None], pl.List(pl.UInt8))),
            "'cells' holds nulls",
        ),
        (
            lambda rows: rows.with_columns(
                pl.col("genome").struct.with_fields(weight=pl.lit([None], pl.List(pl.Float64)))
            ),
            "'genome.weight' holds nulls",
        ),
        (lambda rows: rows.with_columns(coverage_line=float("nan")), "'coverage_line' holds a value"),
        (lambda rows: rows.with_columns(coverage_ends=1.5), "'coverage_ends' holds a value"),
        (
            lambda rows: rows.with_columns(parents=pl.lit([40_000], pl.List(pl.UInt32))),
            "'parents' holds individual 40000, expected at most",
        ),
        (lambda rows: rows.with_columns(condition=pl.lit("novelty")), "must be 'coverage', found"),
        (lambda rows: rows.tail(-1), "expected .0, 0, 0."),
        (lambda rows: rows.filter(pl.col("replicate") != 1), "no gap"),
        (lambda rows: rows[[*range(5), *range(6, rows.height)]], "no gap"),
        (lambda rows: rows[[1, 0, *range(2, rows.height)]], "expected .0, 0, 0."),
        (lambda rows: rows.reverse(), "expected .0, 0, 0."),
        (lambda rows: pl.concat([rows, rows]), "each number once"),
        (lambda rows: rows.sort("individual", maintain_order=True), "sorted"),
    ],
)
def test_rows_that_do_not_fit_are_refused(spoil, message):
    with pytest.raises(ValueError, match=message):
        check_rows(spoil(make_rows()), "coverage", 0)


def test_rows_that_are_not_a_frame_are_refused():
    with pytest.raises(TypeError, match="dict"):
        check_rows({}, "coverage", 0)


def test_extra_columns_are_kept_digested_and_null_where_a_condition_has_none(tmp_path: Path) -> None:
    plain = make_rows()
    drawn = [[float(k), 0.5] for k in range(plain.height)]
    extra = plain.with_columns(pl.lit("sim").alias("condition"), pl.Series("drawn", drawn))
    other = extra.with_columns(pl.Series("drawn", [[1.0, 0.5], *drawn[1:]]))
    digests = []
    for name, frame in (("a", extra), ("b", other)):
        folder = ResultsFolder.create(tmp_path / name, {"conditions": ["coverage", "sim"]})
        with folder.locked():
            folder.publish("coverage", 0, plain, "h")
            folder.publish("sim", 0, frame, "h")
        digests.append(folder.digest())
    assert digests[0] != digests[1]
    assert folder.read("coverage").schema == SCHEMA
    assert folder.read("sim")["drawn"].to_list() == other["drawn"].to_list()
    for both in (folder.read(), folder.scan().collect(), folder.read(columns=["condition", "drawn"])):
        assert both["drawn"].to_list() == [None] * plain.height + other["drawn"].to_list()
    assert folder.read("coverage", columns=["drawn"]).height == plain.height
    wrong = extra.with_columns(pl.col("drawn").list.first())
    with pytest.raises(ValueError, match="'drawn' is Float64, expected List"):
        check_rows(wrong, "sim", 0)


def test_rows_with_genomes_of_partners_have_a_digest_and_are_checked():
    rows = make_rows(n=1)
    genomes = rows["genome"].to_list()
    partners = pl.Series("partners", [genomes[:2]] * rows.height, EXTRA_SCHEMA["partners"])
    whole = rows.with_columns(partners)
    check_rows(whole, "coverage", 0)
    changed = [{**genomes[1], "weight": [0.5 for _ in genomes[1]["weight"]]}, genomes[0]]
    others = [
        whole.with_columns(pl.Series("partners", [each] * rows.height, EXTRA_SCHEMA["partners"]))
        for each in (genomes[1::-1], genomes[:1], changed)
    ]
    assert len({rows_digest(frame) for frame in (rows, whole, *others)}) == 5
    lacking = [{**genomes[0], "weight": None}, genomes[1]]
    with pytest.raises(ValueError, match=r"partners.weight' holds nulls"):
        check_rows(
            whole.with_columns(pl.Series("partners", [lacking] * rows.height, partners.dtype)), "coverage", 0
        )
