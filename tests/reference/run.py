"""One run as a loop of asking, trying and telling: the road that the whole-run kernel must equal."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import Genome, PaperArchive, Population
from realitygap.platforms import trace_genome, try_genomes
from realitygap.runs import Condition
from realitygap.trials import NoiseKey

from .coverage import cell_of
from .novelty import NearestArchive, paper_distance, points_of
from .trial import snapped


@dataclass
class Generation:
    """What one generation leaves behind."""

    genomes: list[Genome]
    cells: list[list[int]]
    n_ends: list[int]
    n_stalls: list[int]
    fitness: list[float]
    novelty: list[float]
    species: list[int]
    parents: list[list[int]]


@dataclass
class Run:
    generations: list[Generation] = field(default_factory=list)


def cells_at_ends(poses: NDArray[np.float64], condition: Condition) -> list[int]:
    """Cells in which steps end, in order of first visit, from the poses."""
    grid = condition.arena.arena().grid
    found: dict[int, None] = {}
    for x, y, _ in poses.tolist():
        column, row = cell_of(snapped((x - grid.x) / grid.cell), snapped((y - grid.y) / grid.cell))
        if 0 <= column < grid.columns and 0 <= row < grid.rows:
            found[grid.columns * row + column] = None
    return list(found)


def make_archive(condition: Condition) -> Any:
    grid, settings = condition.arena.arena().grid, condition.novelty
    if settings.kind == "paper":
        return PaperArchive(settings, columns=grid.columns, rows=grid.rows)
    x_first = settings.sort == "x-then-y"

    def distance(one: list[int], other: list[int]) -> float:
        points = [points_of(cells, grid.columns, x_first=x_first) for cells in (one, other)]
        return paper_distance(*points, grid.columns, grid.rows)

    return NearestArchive(distance, settings.neighbors, settings.threshold, settings.patience)


def run(condition: Condition, replicate: int) -> Run:
    """One run of a condition that selects for coverage or novelty."""
    population = Population(
        3,
        2,
        condition.neat,
        key=condition.key,
        replicate=replicate,
        bias=condition.has_bias_input,
    )
    arena = condition.arena.arena()
    archive = make_archive(condition)
    result = Run()
    for generation in range(condition.neat.generations):
        genomes = population.ask()
        noise = {"noise": condition.noise, "noise_key": NoiseKey(condition.key, replicate, generation)}
        batch = try_genomes(condition.on, arena, genomes, **noise)
        cells = [batch.behavior(k).tolist() for k in range(len(genomes))]
        fitness = (batch.coverage_ends if condition.task.cells == "ends" else batch.coverage_line).tolist()
        novelty = [math.nan] * len(genomes)
        if condition.selection == "novelty":
            behaviors = cells
            if condition.task.cells == "ends":
                keys = [NoiseKey(condition.key, replicate, generation, k) for k in range(len(genomes))]
                tracks = [
                    trace_genome(condition.on, arena, genome, noise=condition.noise, noise_key=key)
                    for genome, key in zip(genomes, keys, strict=True)
                ]
                behaviors = [cells_at_ends(track.poses, condition) for track in tracks]
            novelty = fitness = [float(value) for value in archive.update(behaviors)]
        result.generations.append(
            Generation(
                genomes,
                cells,
                batch.n_ends.tolist(),
                batch.n_stalls.tolist(),
                fitness,
                novelty,
                population.species.tolist(),
                population.parents.tolist(),
            )
        )
        population.tell(fitness)
    return result
