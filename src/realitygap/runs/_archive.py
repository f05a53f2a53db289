"""The archives of runs with MAP-Elites, from their rows: as found, over the batches, and corrected by more trials."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from realitygap.evolution import decode_all, place_in_cells, ribs_archive
from realitygap.kernels.math.philox import MAX_REPEATS
from realitygap.kernels.neat import elites as kernels
from realitygap.kernels.neat.elites import Cells, Elites
from realitygap.platforms import open_trials, scores_of, traced_at_once
from realitygap.trials import NoiseKey, counters_of

from ._condition import Condition
from ._replay import genome_of

Floats = NDArray[np.float64]

RETRIES = 64
"""Trials with fresh noise by which an archive is corrected."""


def elites_of(condition: Condition, rows: pl.DataFrame) -> pl.DataFrame:
    """Return the elites of runs: the rows of the fittest individual of each cell, the first of equally fit ones.

    Args:
        condition: Condition with selection map-elites.
        rows: Rows of whole runs of it.

    Returns:
        The rows, with the column `cell`: its number, of a grid in row-major order of the descriptors. Sorted by
        replicate and cell. Of an elite that was tried again it is the last row, with the means of all its trials.

    Raises:
        ValueError: Selection is another one. Or elites are tried again, and rows or the columns `parents` and `tries`
            are missing.
    """
    parts = [_held(run, archives) for run, _, archives in _archives(condition, rows)]
    held = pl.concat(parts) if parts else rows
    return _best(held.with_columns(cell=_cells(condition, held["descriptor"])), "cell", "fitness")


def _held(run: pl.DataFrame, archives: Iterable[Elites]) -> pl.DataFrame:
    """Return the rows of the elites of the last archive of a run, with their means."""
    *_, last = archives
    best = last.best[last.best >= 0]
    frame = run.with_row_index("row").select("row", "generation", "individual")
    told = pl.DataFrame({"generation": last.batch[best], "individual": last.individual[best]})
    told = told.cast({"generation": pl.UInt32, "individual": pl.UInt32})
    places = told.join(frame, on=["generation", "individual"], how="left", maintain_order="left")
    return run[places["row"]].with_columns(
        fitness=pl.Series(last.fitness[best]),
        descriptor=pl.Series(last.descriptors[best]).arr.to_list(),
    )


def _archives(
    condition: Condition, rows: pl.DataFrame
) -> Iterator[tuple[pl.DataFrame, Cells, Iterator[Elites]]]:
    """Yield the sorted rows of each run, the cells, and its archive after each batch.

    The archive has no genomes, and changes in place.
    """
    _refuse_other_selections(condition)
    cells = condition.archive.cells_in(condition.placed_arena, condition.key)
    by = ["replicate", "generation", "individual"]
    for run in rows.sort(by, maintain_order=True).partition_by("replicate", maintain_order=True):
        if condition.retries_elites:
            _refuse_parts(condition, run)
        yield run, cells, _archives_of(condition, run, cells)


def _refuse_parts(condition: Condition, run: pl.DataFrame) -> None:
    """Raise an error unless rows of a run begin with its first batch, whole, and say what was tried again.

    Raises:
        ValueError: A column or a row is missing.
    """
    missing = " and no column ".join(name for name in ("parents", "tries") if name not in run.columns)
    if missing:
        raise ValueError(
            f"Rows of condition {condition.name!r} have no column {missing}. Read it as well: elites are tried again, "
            "and their means follow from it."
        )
    n = condition.neat.population
    order = np.arange(run.height)
    is_whole = run.height % n == 0
    is_whole &= np.array_equal(run["generation"].to_numpy(), order // n)
    is_whole &= np.array_equal(run["individual"].to_numpy(), order % n)
    if not is_whole:
        raise ValueError(
            f"Rows of run {run['replicate'][0]} of condition {condition.name!r} are not all rows from its first batch "
            "on. Read these: its elites are tried again, and their means follow from all of their rows."
        )


def _archives_of(condition: Condition, run: pl.DataFrame, cells: Cells) -> Iterator[Elites]:
    d, n = len(cells.low), condition.neat.population
    elites = condition.archive.make_elites(d, n)
    for batch in run.partition_by("generation", maintain_order=True):
        descriptors = batch["descriptor"].explode().to_numpy().reshape(batch.height, d).copy()
        again = np.full(batch.height, -1, np.int32)
        if condition.retries_elites:
            is_again = batch["tries"].to_numpy() > 1
            place_of = {
                int(elites.batch[place]) * n + int(elites.individual[place]): place
                for place in elites.best[elites.best >= 0]
            }
            parents = batch.filter(is_again)["parents"].list.first()
            unknown = [parent for parent in parents if parent not in place_of]
            if unknown:
                raise ValueError(
                    f"Rows of run {run['replicate'][0]} of condition {condition.name!r} try an elite again that the "
                    f"archive does not hold (individual {unknown[0]}): they are rows of other settings."
                )
            again[is_again] = [place_of[parent] for parent in parents]
        tries, kept = np.empty((2, batch.height), np.int32)
        fitness, number = batch["fitness"].to_numpy().copy(), int(batch["generation"][0])
        kernels.place_results(fitness, descriptors, again, tries, cells, elites, number, kept)
        yield elites


def _best(rows: pl.DataFrame, cell: str, fitness: str) -> pl.DataFrame:
    """Return the fittest row of each cell of each run."""
    ranked = rows.with_row_index("order").sort(
        "replicate", cell, fitness, "order", descending=[False, False, True, False]
    )
    return ranked.unique(["replicate", cell], keep="first", maintain_order=True).drop("order")


def _cells(condition: Condition, descriptors: pl.Series) -> NDArray[np.uint32]:
    """Return the cell of each list of descriptors, (n,)."""
    _refuse_other_selections(condition)
    values = descriptors.explode().to_numpy().reshape(len(descriptors), -1)
    cells = condition.archive.cells_in(condition.placed_arena, condition.key)
    return place_in_cells(np.ascontiguousarray(values, np.float64), cells).astype(np.uint32)


def archive_progress(condition: Condition, rows: pl.DataFrame) -> pl.DataFrame:
    """Return what archives hold after each batch.

    Args:
        condition: Condition with selection map-elites.
        rows: Rows of whole runs of it.

    Returns:
        A row for each replicate and generation: `trials` so far, `filled` share of the cells, `qd_score`, the sum of
        the elites' fitness divided by the number of cells, and `best` fitness.

    Raises:
        ValueError: As `elites_of`.
    """
    n_cells, per_batch = condition.archive.n_cells, condition.neat.population * condition.repeats
    lines = []
    for run, cells, archives in _archives(condition, rows):
        for batch, elites in enumerate(archives):
            places = elites.best[elites.best >= 0]
            held = elites.fitness[places]
            if condition.archive.competition != "cells":
                best = np.full(n_cells, -math.inf)
                np.maximum.at(best, place_in_cells(elites.descriptors[places], cells), held)
                held = best[best > -math.inf]
            lines.append(
                {
                    "replicate": int(run["replicate"][0]),
                    "generation": batch,
                    "trials": (batch + 1) * per_batch,
                    "filled": len(held) / n_cells,
                    "qd_score": float(held.sum()) / n_cells,
                    "best": float(held.max()),
                }
            )
    return pl.DataFrame(lines)


def _refuse_other_selections(condition: Condition) -> None:
    if condition.selection != "map-elites":
        raise ValueError(
            f"Condition {condition.name!r} has selection {condition.selection!r}, expected 'map-elites'."
        )


def retry_elites(condition: Condition, elites: pl.DataFrame, trials: int = RETRIES) -> pl.DataFrame:
    """Return elites with the means of trials with fresh noise.

    An archive keeps the fittest of many noisy trials, so its elites are lucky ones: in fitness, and in the cell that
    they were placed in.

    Args:
        condition: Condition with selection map-elites.
        elites: Rows of `elites_of`.
        trials: Number of trials of each, 1 to 4096.

    Returns:
        The rows, with `again_fitness`, `again_deviation`, the standard deviation of fitness between trials,
        `again_descriptor`, and `again_cell`.

    Raises:
        ValueError: Another number of trials.
    """
    if not 1 <= trials <= MAX_REPEATS:
        raise ValueError(f"trials is {trials}, expected 1 to {MAX_REPEATS}.")
    parts = elites.partition_by("replicate", maintain_order=True)
    tried = [_tried_again(condition, part, trials) for part in parts]
    fitness = np.concatenate([np.empty((0, trials)), *(each[0] for each in tried)])
    descriptors = np.concatenate(
        [np.empty((0, len(condition.descriptor_names))), *(each[1] for each in tried)]
    )
    again = pl.Series("again_descriptor", descriptors).arr.to_list()
    placed = elites.with_columns(
        pl.Series("again_fitness", fitness.mean(axis=1)),
        pl.Series("again_deviation", fitness.std(axis=1)),
        again,
    )
    return placed.with_columns(again_cell=_cells(condition, again))


def _tried_again(condition: Condition, elites: pl.DataFrame, n_trials: int) -> tuple[Floats, Floats]:
    """Return fitness (n, t) in each trial, and mean descriptors (n, d), of the elites of one run."""
    genomes = [genome_of(condition, row) for row in elites.iter_rows(named=True)]
    trials = open_trials(
        condition.on,
        condition.arena.arena(),
        condition.neat_rules,
        inputs=condition.network_inputs,
        noise=condition.noise,
        bias_value=condition.neat.bias_value,
    )
    task, names = condition.task_of_trials, condition.network_inputs
    needs_trace = task.needs_trace or condition.archive.needs_trace
    # beyond the batches of the evolution, so that the noise is fresh
    key = NoiseKey(condition.key, int(elites["replicate"][0]), condition.neat.generations)
    networks, counters = decode_all(genomes), counters_of(key, len(genomes))
    total = len(genomes) * n_trials
    together = traced_at_once(trials, len(names), is_single=condition.on.is_single) if needs_trace else total
    fitness, descriptors = np.empty(total), np.empty((total, len(condition.descriptor_names)))
    for first in range(0, total, together):
        part = slice(first, min(first + together, total))
        who, repeat = np.divmod(np.arange(total)[part], n_trials)
        words = counters[who]
        words[:, 1] += repeat.astype(np.uint32)
        tried = trials.carry_out(networks, who.astype(np.int32), condition.key, words, trace=needs_trace)
        fitness[part] = scores_of(task, trials, tried, names)
        descriptors[part] = condition.archive.describe(tried, trials, names)
    means = descriptors.reshape(len(genomes), n_trials, -1).mean(axis=1)
    return fitness.reshape(-1, n_trials), means


def to_ribs(condition: Condition, elites: pl.DataFrame) -> Any:
    """Return the elites of a run as an archive of pyribs, for its figures and emitters; see `ribs_archive`.

    Args:
        condition: Condition with selection map-elites.
        elites: Rows of one run of `elites_of`, or of `corrected_archive`, whose fresh trials then count.

    Raises:
        MissingExtraError: pyribs is not installed.
        ValueError: There are rows of several runs.
    """
    if elites["replicate"].n_unique() > 1:
        raise ValueError(f"There are rows of {elites['replicate'].n_unique()} runs, expected those of one.")
    again = "again_" if "again_fitness" in elites.columns else ""
    return ribs_archive(
        condition.archive.cells_in(condition.placed_arena, condition.key),
        [genome_of(condition, row) for row in elites.iter_rows(named=True)],
        elites[f"{again}fitness"].to_numpy(),
        elites[f"{again}descriptor"].explode().to_numpy().reshape(elites.height, -1),
    )


def corrected_archive(retried: pl.DataFrame) -> pl.DataFrame:
    """Return the archive that elites make by their fresh trials alone: the best of each cell in which they belong.

    Args:
        retried: Rows of `retry_elites`.

    Returns:
        Some of the rows, sorted by replicate and `again_cell`.
    """
    return _best(retried, "again_cell", "again_fitness")
