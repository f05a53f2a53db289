"""Small synthetic frames with the columns of a study; what is in them means nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl

from realitygap.records import SCHEMA, ResultsFolder, list_column

HASH = "0123abcd"
DESCRIPTION = {"name": "example", "seed": 1, "conditions": [{"name": "coverage"}, {"name": "a.b-c_1"}]}


def make_rows(
    condition: str = "coverage", first: int = 0, n: int = 3, generations: int = 2, individuals: int = 4
) -> pl.DataFrame:
    """Rows of replicates `first` to `first + n - 1`; a replicate's rows do not depend on its neighbors."""
    each = [
        _replicate(condition, replicate, generations, individuals) for replicate in range(first, first + n)
    ]
    return pl.concat(each)


def _replicate(condition: str, replicate: int, generations: int, individuals: int) -> pl.DataFrame:
    n = generations * individuals
    rng = np.random.default_rng([replicate, len(condition)])
    generation, individual = np.divmod(np.arange(n, dtype=np.uint32), np.uint32(individuals))
    genes = rng.integers(1, 7, n)
    hidden = rng.integers(0, 3, n)

    def ids(high: int) -> np.ndarray:
        return rng.integers(0, high, (n, 6), dtype=np.int32)

    genome = pl.DataFrame(
        {
            "hidden": list_column(ids(9), hidden),
            "biases": list_column(rng.normal(size=(n, 6)), hidden * rng.integers(0, 2)),
            "innovation": list_column(ids(40), genes),
            "source": list_column(ids(9), genes),
            "target": list_column(ids(9), genes),
            "weight": list_column(rng.normal(size=(n, 6)), genes),
            "enabled": list_column(rng.random((n, 6)) < 0.8, genes),
        }
    )
    has_novelty = condition != "coverage"
    parents = rng.integers(0, individuals, (n, 2), dtype=np.uint32)
    return pl.DataFrame(
        {
            "condition": pl.repeat(condition, n, eager=True),
            "replicate": np.full(n, replicate, dtype=np.uint32),
            "generation": generation,
            "individual": individual,
            "species": rng.integers(0, 3, n, dtype=np.uint32),
            "parents": list_column(parents, np.where(generation == 0, 0, rng.integers(1, 3, n))),
            "fitness": rng.random(n),
            "novelty": pl.Series(rng.random(n) if has_novelty else [None] * n, dtype=pl.Float64),
            "coverage_line": rng.random(n),
            "coverage_ends": rng.random(n),
            "cells": list_column(rng.integers(0, 72, (n, 30), dtype=np.uint8), rng.integers(0, 31, n)),
            "stalls": rng.integers(0, 80, n, dtype=np.uint32),
            "nodes": rng.integers(5, 9, n, dtype=np.uint32),
            "connections": rng.integers(1, 9, n, dtype=np.uint32),
            "genome": genome.to_struct(),
            "key": rng.integers(0, 2**64, n, dtype=np.uint64),
        },
        schema=SCHEMA,
    )


def make_folder(path: Path, n_chunks: int = 3, size: int = 2) -> ResultsFolder:
    """A folder with `n_chunks` chunks of `size` replicates of the condition `coverage`."""
    folder = ResultsFolder.create(path, DESCRIPTION)
    for first in range(0, n_chunks * size, size):
        folder.publish("coverage", first, make_rows(first=first, n=size), HASH)
    return folder
