"""Species, innovations and lineage of runs, derived from their rows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap.records._columns import Column, has_far_parents

DerivedFrame = Literal["species", "innovations", "lineage"]

_RUN = ("condition", "replicate")
_INDIVIDUAL = (*_RUN, "generation", "individual")


@dataclass(frozen=True)
class Derived:
    """A frame that is derived from rows.

    Attributes:
        row: Meaning of a row.
        columns: Columns of the frame.
        needs: Columns of the rows that it is derived from.
        of: Function of the rows of whole runs, in key order, that returns the frame.
    """

    row: str
    columns: tuple[Column, ...]
    needs: tuple[str, ...]
    of: Callable[[pl.DataFrame], pl.DataFrame]

    @property
    def schema(self) -> pl.Schema:
        """Names and types of the columns."""
        return pl.Schema({column.name: column.dtype for column in self.columns})

    def frame(self, rows: pl.DataFrame) -> pl.DataFrame:
        """Return the frame, its columns in order and of their types."""
        return self.of(rows).select(pl.col(name).cast(dtype) for name, dtype in self.schema.items())


# species


def _species(rows: pl.DataFrame) -> pl.DataFrame:
    best = pl.col("fitness").arg_max()
    return (
        rows.group_by(*_RUN, "generation", "species", maintain_order=True)
        .agg(
            pl.len().alias("size"),
            pl.col("individual").get(best).alias("best"),
            pl.col("fitness").max().alias("best_fitness"),
            pl.col("fitness").mean().alias("mean_fitness"),
            pl.col("coverage_line").max().alias("best_coverage_line"),
        )
        .with_columns(pl.col("generation").min().over(*_RUN, "species").alias("founded"))
        .sort("replicate", "generation", "species", maintain_order=True)
    )


# innovations


def _innovations(rows: pl.DataFrame) -> pl.DataFrame:
    genes = (
        rows.select(
            *_INDIVIDUAL,
            (pl.col("generation") == pl.col("generation").max().over(*_RUN)).alias("in_last"),
            *(pl.col("genome").struct.field(name) for name in ("innovation", "source", "target")),
        )
        .explode("innovation", "source", "target")
        .drop_nulls("innovation")
    )
    return (
        genes.group_by(*_RUN, "innovation", maintain_order=True)
        .agg(
            pl.col("source", "target", "generation", "individual").first(),
            pl.len().alias("carriers"),
            pl.col("in_last").sum().alias("carriers_last"),
            pl.col("generation").last().alias("last_generation"),
        )
        .sort("replicate", "innovation", maintain_order=True)
    )


# lineage

_GENES = ("hidden", "biases", "innovation", "source", "target", "weight", "enabled")


def _lineage(rows: pl.DataFrame) -> pl.DataFrame:
    first, second = parent_rows(rows)
    own = rows["genome"].struct.field("innovation")
    inherited = pl.DataFrame(
        {"own": own, "a": _taken(own, first), "b": _taken(own, second)},
    ).select(pl.col("own").list.set_difference("a").list.set_difference("b").list.sort())
    unchanged = _equal_genomes(rows["genome"], first) & (second < 0)
    return rows.select(*_INDIVIDUAL, "species", "fitness", "coverage_line", "coverage_ends").with_columns(
        rows["parents"].list.get(0, null_on_oob=True).alias("parent_1"),
        rows["parents"].list.get(1, null_on_oob=True).alias("parent_2"),
        pl.Series(
            "origin",
            np.select([first < 0, second >= 0, unchanged], ["first", "crossover", "copy"], "mutation"),
        ),
        inherited.to_series().alias("new"),
        pl.Series("to_champion", _lead_to_champion(rows, first, second)),
    )


def parent_rows(rows: pl.DataFrame) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return for each row the rows of its first and second parent, (n,) and (n,), -1 without parent.

    Args:
        rows: Rows of whole runs in key order, with individual, generation, and parents.
    """
    starts_generation = (rows["individual"] == 0).to_numpy()
    generation_starts = np.flatnonzero(starts_generation)
    before = generation_starts[np.maximum(np.cumsum(starts_generation) - 2, 0)]
    if has_far_parents(rows):
        starts_run = starts_generation & (rows["generation"] == 0).to_numpy()
        before = np.flatnonzero(starts_run)[np.cumsum(starts_run) - 1]
    found = []
    for k in (0, 1):
        parent = rows["parents"].list.get(k, null_on_oob=True).cast(pl.Int64).fill_null(-1).to_numpy()
        found.append(np.where(parent >= 0, before + parent, -1))
    return found[0], found[1]


def _taken(lists: pl.Series, at: npt.NDArray[np.int64]) -> pl.Series:
    """Return the lists of the rows `at`; an empty one for -1."""
    taken = lists.gather(np.maximum(at, 0))
    return pl.select(
        pl.when(pl.Series(at >= 0)).then(taken).otherwise(pl.lit([], dtype=lists.dtype))
    ).to_series()


def _equal_genomes(genomes: pl.Series, other: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    """Return whether each genome has exactly the genes of that in the row `other`."""
    others = genomes.gather(np.maximum(other, 0))
    equal = np.ones(len(genomes), np.bool_)
    for name in _GENES:
        equal &= (genomes.struct.field(name) == others.struct.field(name)).to_numpy()
    return equal


def _lead_to_champion(
    rows: pl.DataFrame, first: npt.NDArray[np.int64], second: npt.NDArray[np.int64]
) -> npt.NDArray[np.bool_]:
    """Return whether each row is its run's champion, or an ancestor of it."""
    leads = np.zeros(rows.height, np.bool_)
    champions = (
        rows.with_row_index("row")
        .group_by("replicate", maintain_order=True)
        .agg(pl.col("row").get(pl.col("coverage_line").arg_max()))["row"]
        .to_numpy()
    )
    leads[champions] = True
    generation = rows["generation"].to_numpy()
    for number in range(int(generation.max(initial=0)), 0, -1):
        here = np.flatnonzero(leads & (generation == number))
        for parent in (first[here], second[here]):
            leads[parent[parent >= 0]] = True
    return leads


_RUN_COLUMNS = (
    Column("condition", pl.String(), "Name of the condition."),
    Column("replicate", pl.UInt32(), "Number of the run within its condition, from 0."),
)
_U32 = pl.UInt32()

DERIVED: Mapping[str, Derived] = {
    "species": Derived(
        "one species in one generation",
        (
            *_RUN_COLUMNS,
            Column("generation", _U32, "Generation within the run, from 0."),
            Column("species", _U32, "Number of the species, never used again in the run."),
            Column("founded", _U32, "First generation of the species."),
            Column("size", _U32, "Number of its individuals."),
            Column("best", _U32, "Individual of highest fitness, the first of several equal ones."),
            Column("best_fitness", pl.Float64(), "Its fitness."),
            Column("mean_fitness", pl.Float64(), "Mean fitness of the members."),
            Column(
                "best_coverage_line", pl.Float64(), "Highest coverage of a member, along the line [0..1]."
            ),
        ),
        (*_INDIVIDUAL, "species", "fitness", "coverage_line"),
        _species,
    ),
    "innovations": Derived(
        "one innovation number in one run",
        (
            *_RUN_COLUMNS,
            Column("innovation", _U32, "Innovation number."),
            Column("source", pl.Int32(), "Node id that the connection starts from."),
            Column("target", pl.Int32(), "Node id that it leads to."),
            Column(
                "generation",
                _U32,
                "Generation in which it arose; 0 for the connections of all first networks.",
            ),
            Column("individual", _U32, "First individual of that generation with it."),
            Column("carriers", _U32, "Number of individuals with it, enabled or not, in all generations."),
            Column("carriers_last", _U32, "Number of individuals with it in the last generation."),
            Column("last_generation", _U32, "Last generation with it."),
        ),
        (*_INDIVIDUAL, "genome"),
        _innovations,
    ),
    "lineage": Derived(
        "one individual",
        (
            *_RUN_COLUMNS,
            Column("generation", _U32, "Generation within the run, from 0."),
            Column("individual", _U32, "Individual within the generation, from 0."),
            Column(
                "parent_1",
                _U32,
                "Its first parent, of the generation before or, with MAP-Elites, of any; null if it has none.",
                nullable=True,
            ),
            Column("parent_2", _U32, "Its second parent; null if it has none.", nullable=True),
            Column(
                "origin",
                pl.String(),
                "first (no parent), copy (one parent, unchanged), mutation (one parent) or crossover (two, with or "
                "without mutation).",
            ),
            Column("new", pl.List(pl.UInt32()), "Innovation numbers that no parent has."),
            Column("species", _U32, "Species that it belongs to."),
            Column("fitness", pl.Float64(), "The number that selection uses."),
            Column(
                "coverage_line", pl.Float64(), "Visited share of the reachable cells, along the line [0..1]."
            ),
            Column("coverage_ends", pl.Float64(), "Visited share, at the ends of steps [0..1]."),
            Column(
                "to_champion",
                pl.Boolean(),
                "True for the run's champion (highest coverage_line, the first of several equal ones) and its "
                "ancestors.",
            ),
        ),
        (
            *_INDIVIDUAL,
            "species",
            "parents",
            "fitness",
            "coverage_line",
            "coverage_ends",
            "genome",
            "descriptor",
        ),
        _lineage,
    ),
}


def derived_table(what: DerivedFrame) -> list[tuple[str, str, str]]:
    """Return the name, type and description of each column of a derived frame, in order."""
    return [(column.name, str(column.dtype), column.description) for column in DERIVED[what].columns]
