"""Novelty search by hand, and what its archive has seen.

Genomes are asked for, tried, scored by how new the cells are that they visited, and told. The maps say how many of the
400 networks visited each cell: of a search for novelty, and of one for coverage with the same first networks.
"""

import sys

import numpy as np
from matplotlib.figure import Figure

from realitygap import Condition, PaperArchive, Population
from realitygap.platforms import try_genomes
from realitygap.trials import NoiseKey

GENERATIONS = 50


def visits_of(selection: str) -> tuple[np.ndarray, int]:
    """How many networks visited each cell, and how many behaviors the archive keeps."""
    condition = Condition(name=selection, selection=selection, noise=0.5)
    arena, archive = condition.arena.arena(), PaperArchive(condition.novelty)
    population = Population(3, 2, condition.neat, key=condition.key, bias=condition.has_bias_input)
    visits = np.zeros((arena.grid.rows, arena.grid.columns))
    for generation in range(GENERATIONS):
        genomes, key = population.ask(), NoiseKey(condition.key, 0, generation)
        trials = try_genomes(condition.on, arena, genomes, noise=0.5, noise_key=key)
        behaviors = [trials.behavior(k) for k in range(len(genomes))]
        for cells in behaviors:
            visits.ravel()[cells] += 1
        novelty = archive.update(behaviors)
        population.tell(novelty if selection == "novelty" else trials.coverage_line)
    return visits, len(archive)


figure = Figure(figsize=(9.6, 2.75))
for k, selection in enumerate(("novelty", "coverage")):
    visits, n_kept = visits_of(selection)
    axes = figure.add_axes((0.01 + 0.485 * k, 0.01, 0.465, 0.88))
    shown = axes.imshow(visits, origin="lower", cmap="Blues", vmin=0, vmax=8 * GENERATIONS)
    for row, column in np.ndindex(visits.shape):
        color = "white" if visits[row, column] > 4 * GENERATIONS else "#1c1f24"
        axes.text(
            column, row, f"{visits[row, column]:.0f}", ha="center", va="center", fontsize=7.5, color=color
        )
    axes.set(xticks=[], yticks=[])
    for side in axes.spines.values():
        side.set_color("#d3d8de")
    seen = f"{(visits > 0).sum()} of {visits.size} cells"
    axes.set_title(
        f"selected by {selection}: {seen}, {n_kept} behaviors in the archive", fontsize=9, loc="left"
    )
figure.text(
    0.968, 0.45, f"SIM, one run of {8 * GENERATIONS} networks each", rotation=90, va="center", fontsize=8
)
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "archive.png", dpi=150)
