"""XOR with `stanley-2002` under other readings of the paper: part of the page "Classical tasks".

    uv run python docs/make_xor_sizes.py

Measure evaluations and sizes of solvers with one choice changed at a time, with several changed together, and with
other networks counted than the first solver. Write docs/data/xor-sizes.csv, from which the page's table is made. This
takes about 20 minutes on one core. `--runs` sets the runs per row, `--seed` the seed, and `--out` the file.
"""

from __future__ import annotations

import argparse
import csv
import json
import statistics
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from realitygap.evolution import Genome, NeatSettings, Population, decode_all
from realitygap.kernels.tasks.xor import try_xor
from realitygap.runs import run_task
from realitygap.study import task_settings
from realitygap.tasks import CLASSICAL_TASKS

DATA = Path(__file__).parent / "data" / "xor-sizes.csv"
SEED = 4711
FIGURES = ("evaluations", "hidden", "connections")
COLUMNS = [
    "group",
    "name",
    "seed",
    "runs",
    "solved",
    *(f"{part}_{figure}" for figure in FIGURES for part in ("mean", "se")),
]

ONE_CHANGE: list[dict[str, Any]] = [
    {},
    {"split_bias_links": True},
    {"add_link_tries": 1},
    {"structural_mutations": "independent"},
    {"mutate_weights": 0.9},
    {"replace_weight": 0.3},
    {"weight_step": 1.0},
    {"weight_step": 2.5, "replaced_weight": 2.5},
    {"weight_step": 6.0, "replaced_weight": 6.0, "weight_limit": 8.0},
    {"weight_limit": 8.0},
    {"replaced_weight": 30.0, "weight_limit": 30.0},
    {"initial_weight": 5.0},
    {"disabled_rule": "inherit"},
    {"reenable": 0.0},
    {"stay_disabled": 1.0, "reenable": 0.0},
    {"normalize_genes": "never"},
    {"normalize_genes": "always"},
    {"threshold": 2.0},
    {"threshold": 4.0},
    {"weight_coefficient": 2.0},
    {"representative": "champion"},
    {"assign": "nearest"},
    {"interspecies": 0.05},
    {"crossover": 0.0},
    {"crossover_only": 0.2},
    {"crossover_only": 1.0},
    {"average_weights": 0.4},
    {"equal_parents": "smaller"},
    {"survival": 0.1},
    {"survival": 0.4},
    {"champion_counts": "offspring"},
    {"stagnation_factor": 0.01},
    {"stagnation": 1000},
    {"population_stagnation": 10_000},
    {"add_link": 0.02},
    {"add_node": 0.02},
]
RELEASE = {
    "mutate_weights": 0.9,
    "weight_step": 2.5,
    "replaced_weight": 2.5,
    "weight_limit": 8.0,
    "reenable": 0.0,
    "crossover_only": 0.2,
    "average_weights": 0.4,
    "equal_parents": "smaller",
    "disabled_rule": "inherit",
    "normalize_genes": "never",
    "representative": "champion",
    "champion_counts": "offspring",
    "stagnation_factor": 0.01,
}
WIDE = {"weight_step": 6.0, "replaced_weight": 30.0, "weight_limit": 30.0}
# The closest of about 200 combinations that two searches tried, each with 60 or 80 runs of another seed.
CLOSEST = {
    **WIDE,
    "initial_weight": 15.0,
    "reenable": 0.2,
    "disabled_rule": "inherit",
    "structural_mutations": "independent",
    "champion_counts": "offspring",
    "best_species_spared": True,
    "population_stagnation": 10_000,
}
TOGETHER: dict[str, dict[str, Any]] = {
    "every choice of Stanley's release that is a setting": RELEASE,
    '`disabled_rule = "inherit"`, `reenable = 0.0`': {"disabled_rule": "inherit", "reenable": 0.0},
    "weights within 30: `weight_step = 6.0`, `replaced_weight = 30.0`": WIDE,
    'the same, `normalize_genes = "always"`': {**WIDE, "normalize_genes": "always"},
    "the closest of about 200 combinations": CLOSEST,
}


def settings_with(changes: Mapping[str, Any]) -> NeatSettings:
    """Return the settings of `stanley-2002` on XOR with some of them changed."""
    return task_settings("xor", "stanley-2002", changes)


def measured(changes: Mapping[str, Any], runs: int, seed: int) -> dict[str, Any]:
    """Return evaluations and sizes over the runs that solved XOR."""
    settings = settings_with(changes)
    results = [run_task(CLASSICAL_TASKS["xor"], settings, seed, replicate) for replicate in range(runs)]
    solvers = [result for result in results if result.solved]
    return summary(runs, [(solver.evaluations, solver.n_hidden, solver.n_connections) for solver in solvers])


def summary(runs: int, solvers: Sequence[tuple[float, float, float]]) -> dict[str, Any]:
    """Return mean and standard error of each of `FIGURES` over the runs with a solver."""
    row: dict[str, Any] = {"runs": runs, "solved": len(solvers)}
    if len(solvers) < 2:
        return row
    for figure, values in zip(FIGURES, zip(*solvers, strict=True), strict=True):
        row[f"mean_{figure}"] = f"{statistics.fmean(values):.2f}"
        row[f"se_{figure}"] = f"{statistics.stdev(values) / len(values) ** 0.5:.2f}"
    return row


def size(genome: Genome) -> tuple[int, int]:
    """Return hidden nodes and enabled connections."""
    hidden = sum(node.kind == "hidden" for node in genome.nodes)
    return hidden, sum(connection.enabled for connection in genome.connections)


def pruned_size(genome: Genome) -> tuple[int, int]:
    """Return hidden nodes and enabled connections on a path from an input to the output."""
    links = [(link.source, link.target) for link in genome.connections if link.enabled]
    inputs = {node.id for node in genome.nodes if node.kind in ("input", "bias")}
    outputs = {node.id for node in genome.nodes if node.kind == "output"}
    live = reached(inputs, links) & reached(outputs, [(target, source) for source, target in links])
    kept = [link for link in links if set(link) <= live]
    return len({node for link in kept for node in link} - inputs - outputs), len(kept)


def reached(start: set[int], links: Sequence[tuple[int, int]]) -> set[int]:
    """Return the nodes to which the links lead from some nodes, those included."""
    found: set[int] = set(start)
    before: set[int] = set()
    while found != before:
        before = set(found)
        found |= {target for source, target in links if source in before}
    return found


def counted_otherwise(runs: int, seed: int) -> dict[str, dict[str, Any]]:
    """Return the figures of `stanley-2002` by which network of the last generation is counted."""
    counts: dict[str, list[tuple[float, float, float]]] = {}
    for replicate in range(runs):
        population = Population(2, 1, settings_with({}), seed=seed, replicate=replicate)
        for generation in range(population.settings.generations):
            genomes = population.ask()
            fitness, solved = try_all(genomes)
            if solved:
                n_before = generation * len(genomes)
                for name, row in counted_rows(genomes, fitness, solved).items():
                    counts.setdefault(name, []).append((n_before + row[0], *row[1]))
                break
            population.tell(fitness)
    return {name: summary(runs, rows) for name, rows in counts.items()}


def counted_rows(
    genomes: Sequence[Genome], fitness: Sequence[float], solved: Sequence[int]
) -> dict[str, tuple[int, tuple[int, int]]]:
    """Return evaluations in the last generation and the size, by which network is counted."""
    first, last = solved[0], solved[-1]
    fittest = max(solved, key=lambda row: fitness[row])
    smallest = min(solved, key=lambda row: size(genomes[row])[1])
    hidden, _ = size(genomes[first])
    return {
        "the first solver (as above)": (first + 1, size(genomes[first])),
        "the last solver of its generation, as in Stanley's release": (last + 1, size(genomes[last])),
        "the fittest solver, whole generations counted": (len(genomes), size(genomes[fittest])),
        "the smallest solver, whole generations counted": (len(genomes), size(genomes[smallest])),
        "the first solver without dead ends": (first + 1, pruned_size(genomes[first])),
        "the first solver with its disabled connections": (
            first + 1,
            (hidden, len(genomes[first].connections)),
        ),
    }


def try_all(genomes: Sequence[Genome]) -> tuple[list[float], list[int]]:
    """Return the fitness of each network, and which ones solve XOR."""
    networks, rules = decode_all(genomes), genomes[0].rules
    room = np.zeros((2, rules.n_inputs + networks.bias.shape[1]))
    tried = [try_xor(networks, row, rules, 1.0, *room) for row in range(len(genomes))]
    return [fitness for fitness, _ in tried], [row for row, (_, is_right) in enumerate(tried) if is_right]


def main() -> None:
    """Measure every row and write the file."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seed", type=int, default=SEED, help="Seed of the random numbers.")
    parser.add_argument("--runs", type=int, default=300, help="Runs per row.")
    parser.add_argument("--out", type=Path, default=DATA, help="File to write.")
    wanted = parser.parse_args()
    rows = []
    for changes in ONE_CHANGE:
        name = ", ".join(f"`{key} = {json.dumps(value)}`" for key, value in changes.items())
        rows.append(
            {
                "group": "one change",
                "name": name or "nothing changed",
                **measured(changes, wanted.runs, wanted.seed),
            }
        )
        print(rows[-1], flush=True)
    for name, changes in TOGETHER.items():
        rows.append({"group": "together", "name": name, **measured(changes, wanted.runs, wanted.seed)})
        print(rows[-1], flush=True)
    for name, row in counted_otherwise(min(wanted.runs, 100), wanted.seed).items():
        rows.append({"group": "counted", "name": name, **row})
    with wanted.out.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows({**row, "seed": wanted.seed} for row in rows)
    print(f"Written: {wanted.out}")


if __name__ == "__main__":
    main()
