"""NEAT on the classical tasks beside the published results: the numbers of the page "Classical tasks".

    uv run python docs/make_classical_tasks.py

Carries out what `realitygap bench TASK` does, with seeds on which no setting was tuned, and writes
docs/data/classical-tasks.csv, from which the page's tables are made. Takes 6 minutes on 2 cores; with another seed
perhaps an hour, where a population stays among networks that balance for most of 100,000 actions. `--seed` takes
another seed, `--runs` fewer runs, for a first look, and `--out` another file.
"""

from __future__ import annotations

import argparse
import csv
import json
from pathlib import Path
from typing import Any

from realitygap.study import measure_task

DATA = Path(__file__).parent / "data" / "classical-tasks.csv"
SEED = 4711
COLUMNS = [
    "task",
    "group",
    "name",
    "settings",
    "seed",
    "seeds",
    "solved",
    "mean_evaluations",
    "median_evaluations",
    "sd_evaluations",
    "worst_evaluations",
    "mean_hidden",
    "mean_connections",
    "mean_generalization",
    "sd_generalization",
]
# In the source every network makes one pass a step, in which each node sees the others as they were a step before.
SOURCE_PASSES = {"recurrent": True}
RANDOM_START = {"start_hidden": 10, "start_topology": "random"}
# Where no difference counts all are one species. A high threshold alone keeps apart those that share no gene.
NO_DISTANCE = {"excess_coefficient": 0, "disjoint_coefficient": 0, "weight_coefficient": 0}
ABLATIONS: dict[str, dict[str, Any]] = {
    "full": {},
    "no mating": {"crossover": 0},
    "random start": RANDOM_START,
    # Fewer generations than the source's 1,000: see the page.
    "no speciation": {**NO_DISTANCE, **RANDOM_START, "generations": 300},
    "no growth": {"add_node": 0, "add_link": 0, "start_hidden": 10, "start_topology": "layer"},
}
# Values that the paper leaves open, each changed alone in `stanley-2002`.
OPEN_CHOICES: list[dict[str, Any]] = [
    {"weight_step": 1.0},
    {"weight_step": 2.5, "replaced_weight": 2.5},
    {"weight_limit": 8.0},
    {"reenable": 0},
    {"crossover_only": 0.2},
    {"survival": 0.4},
    {"representative": "champion"},
    {"disabled_rule": "inherit"},
    {"equal_parents": "smaller"},
    {"split_bias_links": True},
    {"structural_mutations": "independent"},
]
RUNS = [("xor", 100), ("double-pole", 100), ("double-pole-no-velocity", 40)]
ABLATION_RUNS = 30


def measured(task: str, settings: str, seeds: int, seed: int, **changes: Any) -> dict[str, Any]:
    """One row of the data, but for its group and name."""
    print(f"{task}, {settings} {changes or ''}", flush=True)
    figures = measure_task(task, settings, seeds=seeds, seed=seed, changes=changes)
    row = {**figures, "settings": settings, "seed": seed}
    return {key: rounded(row.get(key)) for key in COLUMNS}


def all_rows(seed: int, most: int) -> list[dict[str, Any]]:
    """Every row of the data: tasks, open choices, ablations; of each at most so many runs."""
    rows = [
        {**measured(task, settings, min(seeds, most), seed), "group": "tasks"}
        for task, seeds in RUNS
        for settings in ("stanley-2002", "default")
    ]
    for changes in OPEN_CHOICES:
        name = ", ".join(f"{key} = {json.dumps(value)}" for key, value in changes.items())
        rows.append(
            {
                **measured("xor", "stanley-2002", min(100, most), seed, **changes),
                "group": "open",
                "name": name,
            }
        )
    for name, changes in ABLATIONS.items():
        changes = {**SOURCE_PASSES, **changes}
        row = measured("double-pole", "stanley-2002", min(ABLATION_RUNS, most), seed, **changes)
        rows.append({**row, "group": "ablations", "name": name})
    return rows


def rounded(value: Any) -> Any:
    """A number as it stands in the data."""
    return f"{value:.2f}" if isinstance(value, float) else "" if value is None else value


def main() -> None:
    """Measure everything and write it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seed", type=int, default=SEED, help="of the random numbers")
    parser.add_argument("--runs", type=int, default=100, help="at most so many of each")
    parser.add_argument("--out", type=Path, default=DATA, help="file to write")
    wanted = parser.parse_args()
    rows = all_rows(wanted.seed, wanted.runs)
    with wanted.out.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    print(f"Written: {wanted.out}")


if __name__ == "__main__":
    main()
