"""Many runs of one condition, in one call."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import DTypeLike, NDArray

from realitygap._process import use_polars
from realitygap.errors import OutgrownError, whole_number
from realitygap.evolution import distance_kind
from realitygap.kernels.neat import block
from realitygap.kernels.neat.block import RunRows, RunRules
from realitygap.records import list_column, schema_with

from ._condition import Condition
from ._staged import run_staged
from ._teams import draw_teams

# The largest genome that a run may grow.
MOST_GENES = 16_384
MOST_HIDDEN = 4_096

# Room for genes beyond the first ones; doubled and run again where it was not enough.
FIRST_ROOM = 16
FIRST_HIDDEN_ROOM = 4

# The number of a replicate is a word of the random numbers' counter.
MAX_REPLICATES = 1 << 32


def run_rules(condition: Condition) -> RunRules:
    """Return the selection rules of a condition's runs, in the form that kernels read."""
    novelty = condition.novelty
    selection = {
        "coverage": block.COVERAGE,
        "fitness": block.COVERAGE,
        "novelty": block.NOVELTY,
        "random": block.RANDOM,
        "map-elites": block.ELITES,
    }[condition.selection]
    if condition.selection == "novelty" and novelty.kind == "lehman-stanley":
        selection = block.NEAREST_NOVELTY
    return RunRules(
        n_generations=condition.neat.generations,
        population=condition.neat.population,
        selection=selection,
        count_ends=condition.counted_cells == "ends",
        archive_size=novelty.archive_size,
        above_all=novelty.enter == "above-all",
        by_column=novelty.sort == "x-then-y",
        distance=distance_kind(novelty.distance),
        neighbors=novelty.neighbors,
        archive_threshold=float(novelty.threshold),
        archive_patience=novelty.patience,
    )


def _empty_rows(condition: Condition, n_runs: int, n_cells: int, room: int, hidden_room: int) -> RunRows:
    shape = (n_runs, condition.neat.generations, condition.neat.population)

    def zeros(dtype: DTypeLike, *more: int) -> NDArray[Any]:
        return np.zeros((*shape, *more), dtype)

    return RunRows(
        fitness=zeros(np.float64),
        novelty=zeros(np.float64),
        counts=zeros(np.int32, 3),
        cells=zeros(np.uint8, n_cells),
        species=zeros(np.int32),
        parents=zeros(np.int32, 2),
        n_connections=zeros(np.int32),
        n_hidden=zeros(np.int32),
        innovation=zeros(np.int32, room),
        source=zeros(np.int32, room),
        target=zeros(np.int32, room),
        weight=zeros(np.float64, room),
        enabled=zeros(np.bool_, room),
        hidden=zeros(np.int32, hidden_room),
        bias=zeros(np.float64, 2 + hidden_room),
        ended=zeros(np.float64, 2),
        drawn=zeros(np.float64, len(condition.drawn_names)),
        task_fitness=zeros(np.float64),
        descriptor=zeros(np.float64, len(condition.descriptor_names)),
        tries=zeros(np.int32),
    )


def run_rows(condition: Condition, first_replicate: int, n_runs: int, *, staged: bool = False) -> RunRows:
    """Run `n_runs` runs of a condition; see `run_replicates` for them as a frame.

    Args:
        condition: Condition as resolved.
        first_replicate: Number of the first run.
        n_runs: Number of runs, at least 1.
        staged: True to use the method for all platforms even if the whole-run kernel is available. The rows are the
            same.

    Returns:
        Arrays (n_runs, generations, individuals, ...).

    Raises:
        TypeError: A number is not a whole one.
        ValueError: No run, or one beyond replicate 4,294,967,295, where random numbers would repeat.
        OutgrownError: A genome grew beyond `MOST_GENES` or `MOST_HIDDEN`.
    """
    if condition.is_physical:
        raise ValueError(
            f"Condition {condition.name!r} is tried on a robot, expected one that is computed. Drive it: "
            "realitygap drive STUDY --port PORT."
        )
    first_replicate = whole_number("first_replicate", first_replicate, 0, MAX_REPLICATES - 1)
    n_runs = whole_number("n_runs", n_runs, 1, MAX_REPLICATES - first_replicate)
    arena = condition.arena.arena()
    neat = condition.neat_rules
    rules = run_rules(condition)
    room = neat.n_first_genes + FIRST_ROOM
    hidden_room = neat.start_hidden + FIRST_HIDDEN_ROOM
    carry_out = run_staged if staged or not _is_whole(condition) else _run_whole
    while True:
        rows = _empty_rows(condition, n_runs, arena.grid.n_cells, room, hidden_room)
        if carry_out(condition, rules, first_replicate, rows, room, hidden_room):
            return rows
        if room == MOST_GENES and hidden_room == MOST_HIDDEN:
            raise OutgrownError(
                f"Condition {condition.name!r}, replicates {first_replicate} to "
                f"{first_replicate + n_runs - 1}: a genome grew beyond {MOST_GENES:,} connection genes or "
                f"{MOST_HIDDEN:,} hidden nodes, the maximum. Nothing of these runs is saved. Lower add_node "
                "and add_link, or run fewer generations."
            )
        room, hidden_room = min(2 * room, MOST_GENES), min(2 * hidden_room, MOST_HIDDEN)


def _is_whole(condition: Condition) -> bool:
    """Return whether its platform computes whole evolutions of its task."""
    return condition.on.runs_whole and condition.coverage is not None and condition.selection != "map-elites"


def _run_whole(
    condition: Condition, rules: RunRules, first_replicate: int, rows: RunRows, room: int, hidden_room: int
) -> bool:
    """Run all in one call of the platform; arguments and result as of `run_staged`."""
    return condition.on.run_whole(
        condition.arena.arena(),
        condition.neat_rules,
        rules,
        inputs=condition.network_inputs,
        noise=condition.noise,
        bias_value=condition.neat.bias_value,
        key=condition.key,
        first_replicate=first_replicate,
        rows=rows,
        room=(room, hidden_room),
    )


def prepare_kernels(conditions: Iterable[Condition] = ()) -> None:
    """Compile, or load from disk, all that runs need, by runs that are as small as can be.

    Args:
        conditions: Conditions to be run. Default: a condition of the paper.
    """
    least = [_least(condition) for condition in conditions if not condition.is_physical]
    done: list[dict[str, Any]] = []
    for condition in least or [_least(Condition(name="least"))]:
        # what kernels are compiled for: types, and not numbers
        like: dict[str, Any] = {"platform": condition.platform, "is_single": condition.on.is_single}
        like |= {"task": condition.task.model_dump(), "whole": _is_whole(condition)}
        like["several"] = condition.arena.robots > 1
        like["archive"] = condition.selection == "map-elites"
        if like not in done:
            done.append(like)
            run_rows(condition, 0, 1)


def _least(condition: Condition) -> Condition:
    """Return the condition with a population of two that live for one step, and have children."""
    short = condition.on.model_copy(update={"steps": 1})
    neat = condition.neat.model_copy(update={"population": 2, "generations": 2})
    return condition.model_copy(update={"on": short, "neat": neat})


def run_replicates(
    condition: Condition, first_replicate: int, n_runs: int, *, staged: bool = False
) -> pl.DataFrame:
    """Run `n_runs` runs of a condition.

    Args:
        condition: Condition as resolved.
        first_replicate: Number of the first run.
        n_runs: Number of runs, at least 1.
        staged: As in `run_rows`.

    Returns:
        One row for each individual, with the columns of the records, sorted by replicate, generation, and individual.
        The rows of a replicate do not depend on the other replicates.

    Raises:
        TypeError, ValueError: As `run_rows`.
    """
    return _frame_of(condition, first_replicate, run_rows(condition, first_replicate, n_runs, staged=staged))


def _frame_of(condition: Condition, first_replicate: int, rows: RunRows) -> pl.DataFrame:
    """Return the rows of runs as a frame with the columns of the records."""
    use_polars()
    n_runs, n_generations, n = rows.fitness.shape
    total = n_runs * n_generations * n
    n_cells = condition.arena.arena().grid.n_cells

    def flat(array: NDArray[Any]) -> NDArray[Any]:
        return array.reshape(total, *array.shape[3:])

    counts = flat(rows.counts)
    n_connections = flat(rows.n_connections)
    n_hidden = flat(rows.n_hidden)
    enabled = flat(rows.enabled)
    parents = flat(rows.parents)
    run, generation, individual = np.unravel_index(np.arange(total), (n_runs, n_generations, n))
    used = np.arange(enabled.shape[1]) < n_connections[:, None]
    rules = condition.neat_rules
    n_biases = rules.n_outputs + n_hidden if rules.node_bias else np.zeros_like(n_hidden)
    genome = pl.DataFrame(
        {
            "hidden": list_column(flat(rows.hidden), n_hidden),
            "biases": list_column(flat(rows.bias), n_biases),
            "innovation": list_column(flat(rows.innovation), n_connections),
            "source": list_column(flat(rows.source), n_connections),
            "target": list_column(flat(rows.target), n_connections),
            "weight": list_column(flat(rows.weight), n_connections),
            "enabled": list_column(enabled, n_connections),
        }
    ).to_struct("genome")
    novelty = pl.Series("novelty", flat(rows.novelty)).fill_nan(None)
    extra: dict[str, pl.Series | NDArray[Any]] = {}
    if condition.on.records_draws:
        extra["drawn"] = list_column(flat(rows.drawn), np.full(total, rows.drawn.shape[-1]))
    if condition.coverage is None:
        extra["task_fitness"] = flat(rows.task_fitness)
    if condition.records_behavior:
        start = condition.placed_arena.start
        extra["behavior"] = list_column(flat(rows.ended) + np.array([start.x, start.y]), np.full(total, 2))
    if condition.descriptor_names:
        extra["descriptor"] = list_column(flat(rows.descriptor), np.full(total, rows.descriptor.shape[-1]))
    if condition.retries_elites:
        extra["tries"] = flat(rows.tries).astype(np.uint32)
    if condition.arena.networks == "each":
        extra["partners"] = _partners(condition, genome, first_replicate, n_runs)
    return pl.DataFrame(
        {
            "condition": pl.repeat(condition.name, total, dtype=pl.String, eager=True),
            "replicate": (first_replicate + run).astype(np.uint32),
            "generation": generation.astype(np.uint32),
            "individual": individual.astype(np.uint32),
            "species": flat(rows.species).astype(np.uint32),
            "parents": list_column(parents.clip(min=0).astype(np.uint32), (parents >= 0).sum(axis=1)),
            "fitness": flat(rows.fitness),
            "novelty": novelty,
            "coverage_line": counts[:, 0] / n_cells,
            "coverage_ends": counts[:, 1] / n_cells,
            "cells": list_column(flat(rows.cells), counts[:, 0]),
            "stalls": counts[:, 2].astype(np.uint32),
            "nodes": (rules.n_inputs + rules.n_outputs + n_hidden).astype(np.uint32),
            "connections": (enabled & used).sum(axis=1).astype(np.uint32),
            "genome": genome,
            "key": pl.repeat(condition.key, total, dtype=pl.UInt64, eager=True),
            **extra,
        },
        schema=schema_with(extra),
    )


def _partners(condition: Condition, genomes: pl.Series, first_replicate: int, n_runs: int) -> pl.Series:
    """Return the genomes of the other robots of each trial, shape (n,) of lists."""
    n, n_robots = condition.neat.population, condition.arena.robots
    which = np.concatenate(
        [
            draw_teams(condition.key, replicate, generation, n, n_robots)[:, 1:]
            + n * (condition.neat.generations * (replicate - first_replicate) + generation)
            for replicate in range(first_replicate, first_replicate + n_runs)
            for generation in range(condition.neat.generations)
        ]
    )
    frame = pl.DataFrame(
        {"trial": np.repeat(np.arange(len(which)), n_robots - 1), "genome": genomes.gather(which.ravel())}
    )
    return frame.group_by("trial", maintain_order=True).agg("genome")["genome"]
