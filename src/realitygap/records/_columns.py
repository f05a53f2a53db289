"""The columns of a simulated study, with their types, units, and meaning."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl


@dataclass(frozen=True)
class Column:
    """One column of a frame, or one field of a struct column."""

    name: str
    dtype: pl.DataType
    description: str
    nullable: bool = False
    fields: tuple[Column, ...] = ()


_IDS = pl.List(pl.Int32())

_GENOME = (
    Column("hidden", _IDS, "Node ids of the hidden nodes."),
    Column("biases", pl.List(pl.Float64()), "Biases, one per output and hidden node; empty without biases."),
    Column("innovation", _IDS, "Innovation numbers, one per connection gene."),
    Column("source", _IDS, "Node ids that the connections start from."),
    Column("target", _IDS, "Node ids that the connections lead to."),
    Column("weight", pl.List(pl.Float64()), "Weights of the connections."),
    Column("enabled", pl.List(pl.Boolean()), "True for each connection that takes part in the network."),
)

COLUMNS: tuple[Column, ...] = (
    Column("condition", pl.String(), "Name of the condition."),
    Column("replicate", pl.UInt32(), "Number of the run within its condition, from 0."),
    Column("generation", pl.UInt32(), "Generation within the run, from 0."),
    Column("individual", pl.UInt32(), "Individual within the generation, from 0."),
    Column("species", pl.UInt32(), "Species that the individual belongs to."),
    Column(
        "parents",
        pl.List(pl.UInt32()),
        "Individuals of the generation before from which this one descends; empty in generation 0.",
    ),
    Column("fitness", pl.Float64(), "The number that selection uses."),
    Column(
        "novelty",
        pl.Float64(),
        "Mean distance to the nearest neighbors [unit of the behavior]; null unless selection is novelty.",
        nullable=True,
    ),
    Column(
        "coverage_line",
        pl.Float64(),
        "Visited share of the reachable cells, along the driven line [0..1]; null if a robot drove for another task "
        "and the cells were not counted.",
    ),
    Column(
        "coverage_ends",
        pl.Float64(),
        "Visited share of the reachable cells, at the ends of steps [0..1]; null if a person scored a robot's trial "
        "and saw only the line.",
    ),
    Column(
        "cells",
        pl.List(pl.UInt8()),
        "Cells visited along the line, in the order of first visits: columns * row + column, "
        "where (0, 0) is the lower left of the reachable grid.",
    ),
    Column("stalls", pl.UInt32(), "Steps in which the robot was blocked."),
    Column("nodes", pl.UInt32(), "Nodes of the genome."),
    Column("connections", pl.UInt32(), "Enabled connections of the genome."),
    Column(
        "genome",
        pl.Struct({column.name: column.dtype for column in _GENOME}),
        "The genome.",
        fields=_GENOME,
    ),
    Column("key", pl.UInt64(), "Key of the random numbers, with which the study repeats the trial."),
)

FAR_PARENTS = "descriptor"
"""Column of runs whose parents are of any generation."""

EXTRA: tuple[Column, ...] = (
    Column(
        "drawn",
        pl.List(pl.Float64()),
        "Platform sim: numbers that were drawn for the trial, in the order of the names in the study's description, "
        "`drawn` of the condition; empty if no number is drawn.",
    ),
    Column(
        "task_fitness",
        pl.Float64(),
        "Other tasks than coverage: score of the trial, also if selection does not use it.",
    ),
    Column(
        "behavior",
        pl.List(pl.Float64()),
        "Distances that do not compare cells: the behavior, such as the final x and y [m].",
    ),
    Column(
        FAR_PARENTS,
        pl.List(pl.Float64()),
        'With `selection = "map-elites"`: numbers that describe the individual, means over its trials. Its parents are '
        "then counted from the first individual of the run, and `fitness` is a mean over its trials.",
    ),
    Column(
        "tries",
        pl.UInt32(),
        "With `archive.retry`: how often the genome has been tried. From 2 on, the parent is the same genome when it "
        "was tried before; `fitness` and `descriptor` are of this time alone.",
    ),
    Column(
        "partners",
        pl.List(pl.Struct({column.name: column.dtype for column in _GENOME})),
        'With `networks = "each"`: genomes of the other robots in the trial, in order, with the fields of `genome`.',
        fields=_GENOME,
    ),
)
"""Columns that only some conditions have. They are null in rows of other conditions."""

EXTRA_SCHEMA: pl.Schema = pl.Schema({column.name: column.dtype for column in EXTRA})
SCHEMA: pl.Schema = pl.Schema({column.name: column.dtype for column in COLUMNS})
KEYS: tuple[str, ...] = ("replicate", "generation", "individual")


def columns_in(frame: pl.DataFrame) -> list[Column]:
    """Return the columns of a frame in order: those that all have, and the extra ones that are there."""
    return [*COLUMNS, *(column for column in EXTRA if column.name in frame.columns)]


def schema_with(names: Iterable[str]) -> pl.Schema:
    """Return `SCHEMA`, and those extra columns that are among the names."""
    there = set(names)
    return pl.Schema({**SCHEMA, **{name: dtype for name, dtype in EXTRA_SCHEMA.items() if name in there}})


def column_table() -> list[tuple[str, str, str]]:
    """Return the name, type and description (with unit) of each column; a struct's fields as `column.field`."""
    rows: list[tuple[str, str, str]] = []
    for column in (*COLUMNS, *EXTRA):
        if column.fields and isinstance(column.dtype, pl.List):
            rows.append((column.name, "List(Struct)", column.description))
            continue
        rows.append((column.name, "Struct" if column.fields else str(column.dtype), column.description))
        rows += [
            (f"{column.name}.{field.name}", str(field.dtype), field.description) for field in column.fields
        ]
    return rows


def list_column(values: npt.NDArray[Any], lengths: npt.NDArray[np.integer[Any]]) -> pl.Series:
    """Return a polars list column from padded rows: the first `lengths[i]` entries of row i.

    Args:
        values: (n, k), any numeric or boolean type, which becomes the type of the entries.
        lengths: (n,) integers, 0 <= lengths[i] <= k.

    Returns:
        (n,) series of lists.

    Raises:
        ValueError: shapes do not fit each other, or a length is out of range.
    """
    if values.ndim != 2 or lengths.shape != values.shape[:1]:
        raise ValueError(
            f"values has shape {values.shape}, lengths {lengths.shape}, expected (n, k) and (n,)."
        )
    n, k = values.shape
    if n and not 0 <= lengths.min() <= lengths.max() <= k:
        raise ValueError(f"lengths run from {lengths.min()} to {lengths.max()}, expected 0 to {k}.")
    if n == 0 or k == 0:
        empty = pl.Series(values=values.reshape(-1)[:0]).dtype
        return pl.Series(values=[[]], dtype=pl.List(empty)).new_from_index(0, n)
    padded = pl.DataFrame({"values": np.ascontiguousarray(values), "lengths": lengths.astype(np.uint32)})
    return padded.select(pl.col("values").arr.to_list().list.head(pl.col("lengths"))).to_series()


def check_rows(frame: pl.DataFrame, condition: str, first: int) -> int:
    """Return the last replicate of a frame that is fit to be published.

    Args:
        frame: Columns as in `SCHEMA`, and any of `EXTRA`, in any order.
        condition: Condition that every row must have.
        first: Replicate of the first row. The following replicates must have no gap.

    Returns:
        The last replicate.

    Raises:
        TypeError: it is not a polars frame.
        ValueError: columns, types, nulls, ranges, names or the order and completeness of the rows are wrong.
    """
    if not isinstance(frame, pl.DataFrame):
        raise TypeError(f"The rows are a {type(frame).__name__}, expected a polars DataFrame.")
    _check_schema(frame)
    if frame.is_empty():
        raise ValueError("The frame has no rows, expected at least one replicate.")
    _check_nulls(frame, columns_in(frame))
    if (frame["condition"] != condition).any():
        raise ValueError(
            f"Every row's condition must be {condition!r}, found {frame['condition'].unique().to_list()}."
        )
    last = _check_order(frame, first)
    _check_ranges(frame)
    return last


def check_part(frame: pl.DataFrame, first: int) -> None:
    """Check some columns of a chunk that is read: nulls, ranges, and the order of the rows if their keys are there.

    Args:
        frame: Columns of a published chunk.
        first: The first row's replicate.

    Raises:
        ValueError: A value is missing or out of its range, or rows are not in order.
    """
    _check_nulls(frame, [column for column in (*COLUMNS, *EXTRA) if column.name in frame.columns])
    _check_ranges(frame)
    if set(KEYS) <= set(frame.columns) and not frame.is_empty():
        _check_order(frame, first)


def _check_schema(frame: pl.DataFrame) -> None:
    found = frame.schema
    expected = schema_with(found)
    problems = [f"no column {name!r} ({dtype})" for name, dtype in expected.items() if name not in found]
    problems += [f"unknown column {name!r}" for name in found if name not in expected]
    problems += [
        f"{name!r} is {found[name]}, expected {dtype}"
        for name, dtype in expected.items()
        if name in found and found[name] != dtype
    ]
    if problems:
        raise ValueError(f"The frame's columns do not fit: {'; '.join(problems)}.")


def _check_nulls(frame: pl.DataFrame, columns: Iterable[Column]) -> None:
    for column in columns:
        series = frame[column.name]
        parts = [(column, series)]
        is_list = bool(column.fields) and isinstance(column.dtype, pl.List)
        structs = series.explode().drop_nulls() if is_list else series
        parts += [(field, structs.struct.field(field.name)) for field in column.fields]
        for part, values in parts:
            # explode() would put a null where a list is empty
            inner = (
                isinstance(part.dtype, pl.List)
                and values.filter(values.list.len() > 0).explode().null_count()
            )
            if (values.null_count() and not part.nullable) or inner:
                name = part.name if part is column else f"{column.name}.{part.name}"
                raise ValueError(f"Column {name!r} holds nulls, expected a value in every row.")


def _check_ranges(frame: pl.DataFrame) -> None:
    """Shares must be shares, and parents must be individuals: reports count and index by them."""
    for name in ("coverage_line", "coverage_ends"):
        if name in frame.columns and not frame[name].drop_nulls().is_between(0.0, 1.0).all():
            raise ValueError(f"Column {name!r} holds a value that is not from 0 to 1.")
    if {"parents", "individual"} <= set(frame.columns) and not frame.is_empty():
        n = len(frame["individual"].unique())
        if has_far_parents(frame):
            n *= int(frame["generation"].to_numpy().max()) + 1 if "generation" in frame.columns else 2**32
        last = frame["parents"].explode().drop_nulls().to_numpy().max(initial=0)
        if last >= n:
            raise ValueError(f"Column 'parents' holds individual {last}, expected at most {n - 1}.")


def has_far_parents(rows: pl.DataFrame) -> bool:
    """Return whether parents are of any generation, counted from the first individual of the run (MAP-Elites)."""
    return FAR_PARENTS in rows.columns and rows[FAR_PARENTS].null_count() < rows.height


def _check_order(frame: pl.DataFrame, first: int) -> int:
    """Rows must count up: individuals from 0 in each generation, generations from 0 in each replicate."""
    replicate, generation, individual = (frame[key].to_numpy().astype(np.int64) for key in KEYS)
    if (replicate[0], generation[0], individual[0]) != (first, 0, 0):
        raise ValueError(
            "The first row is (replicate, generation, individual) = "
            f"{(int(replicate[0]), int(generation[0]), int(individual[0]))}, expected {(first, 0, 0)}."
        )
    steps = tuple(np.diff(key) for key in (replicate, generation, individual))
    same_run, next_run = steps[0] == 0, steps[0] == 1
    fits = same_run & (steps[1] == 0) & (steps[2] == 1)
    fits |= same_run & (steps[1] == 1) & (individual[1:] == 0)
    fits |= next_run & (generation[1:] == 0) & (individual[1:] == 0)
    if not fits.all():
        row = int(np.argmin(fits)) + 1
        before, here = ((int(replicate[i]), int(generation[i]), int(individual[i])) for i in (row - 1, row))
        raise ValueError(
            f"Row {row} is (replicate, generation, individual) = {here} after {before}: rows must be sorted, "
            "each number once, with no gap, individuals and generations counting from 0."
        )
    return int(replicate[-1])
