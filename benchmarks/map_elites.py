"""MAP-Elites with noisy trials, and its speed beside pyribs in our simulator and beside QDax in Kheperax, as JSON.

`python benchmarks/map_elites.py noise --out docs/data` compares ways to deal with noise at equal trials: 20,480 a run,
10 runs, batches of 256, on `sim` in the paper's arena, for each of three spaces of descriptors. They are 1, 2, 4, and 8
trials of each network from the start; elites that are tried again, by a share of each batch and a depth of the cells;
and dominated novelty, with and without. What counts is the corrected archive: each elite is tried 64 times again, and
the means make a new archive. The default is the way of MAP-Elites with the largest fitness per cell of corrected
archives, as a ratio to one trial of each network, in the geometric mean over the spaces.

Plan and rule were set before the first run of this comparison. An earlier one had other random numbers and numbers of
trials alone; one trial won. Then 2 or 3 runs with other seeds were looked at, of most of these ways.

`python benchmarks/map_elites.py speed --out docs/data` measures evaluations a second on one core: `selection =
"map-elites"`, and a loop of pyribs (GridArchive, GaussianEmitter) that tries networks of fixed structure by
`try_genomes`. Both have batches of 256, one trial of a network, and the descriptor `region_share` with 3 cells along
each share. The two are measured in turn, five times each; medians count. Then the example of Kheperax is measured,
with QDax on one core, beside `kheperax/study.toml`, which is that example as far as `sim` can be like it: maze, robot,
steps, fitness, descriptor, cells, and batches are the same. Networks have as many nodes, but NEAT varies them; those of
Kheperax read -1 where a ray meets nothing, ours 0; and ours are scored by a function of all steps.

`python benchmarks/map_elites.py kheperax --out docs/data` compares archives of that maze after 999,424 evaluations, as
many as in the example: one run of theirs and three of ours.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

import kheperax_peer
from environments import build_environment, measure
from realitygap.evolution import genome_from_record
from realitygap.platforms import SimPlatform, try_genomes
from realitygap.runs import Condition, corrected_archive, elites_of, retry_elites, run_replicates
from realitygap.stats import mean_interval
from realitygap.study import load_study
from realitygap.tasks import PythonTask
from realitygap.trials import NoiseKey

TRIALS, BATCH, RUNS = 20_480, 256, 10
NOVELTY = "dominated-novelty"
WAYS: tuple[dict[str, Any], ...] = (
    *({"repeats": repeats, "retry": 0.0, "depth": 1} for repeats in (1, 2, 4, 8)),
    *({"retry": 0.25, "depth": depth} for depth in (1, 2, 4, 8)),
    *({"retry": 0.5, "depth": depth} for depth in (1, 2, 4, 8)),
    *({"retry": 0.75, "depth": depth} for depth in (1, 4)),
    {"retry": 0.5, "depth": 4, "repeats": 2},
    {"retry": 0.0, "competition": NOVELTY},
    {"retry": 0.5, "competition": NOVELTY},
)
SPACES: dict[str, dict[str, Any]] = {
    "motion": {"descriptor": ["mean_turn", "mean_move", "stall_share"], "cells": [20, 10, 5]},
    "end": {"descriptor": ["end"], "cells": [28, 16]},
    "regions": {"kind": "cvt", "descriptor": ["region_share"], "cells": [500]},
}
SEED, NOISE_SEED = 4127, 4128
TIMES, SPEED_BATCHES, MAZE_BATCHES, MAZE_RUNS = 5, 100, 10, 3


def noise() -> dict[str, Any]:
    """Return the corrected archives of each space and way."""
    rows = []
    for space, archive in SPACES.items():
        for way in WAYS:
            condition = Condition(
                name=space,
                platform="sim",
                selection="map-elites",
                seed=NOISE_SEED,
                neat={"population": BATCH, "generations": TRIALS // (BATCH * way.get("repeats", 1))},
                archive={**archive, **way},
            )
            elites = elites_of(condition, run_replicates(condition, 0, RUNS))
            again = retry_elites(condition, elites)
            corrected = corrected_archive(again)
            n_cells, runs = condition.archive.n_cells, range(RUNS)
            scores = [corrected.filter(replicate=run)["again_fitness"].sum() / n_cells for run in runs]
            best = [again.filter(replicate=run)["again_fitness"].max() for run in runs]
            interval = mean_interval(np.array(scores))
            rows.append(
                {
                    "space": space,
                    "way": way,
                    "as_found": float(elites["fitness"].sum()) / n_cells / RUNS,
                    "corrected": statistics.mean(scores),
                    "corrected_interval": [interval.low, interval.high],
                    "filled": elites.height / n_cells / RUNS,
                    "filled_corrected": corrected.height / n_cells / RUNS,
                    "stay": float((again["cell"] == again["again_cell"]).to_numpy().mean()),
                    "best": statistics.mean(best),
                }
            )
            print(json.dumps(rows[-1]), flush=True)
    corrected = np.array([row["corrected"] for row in rows]).reshape(len(SPACES), len(WAYS))
    ratios = np.exp(np.log(corrected / corrected[:, :1]).mean(axis=0)).tolist()
    ranked = [{"way": way, "ratio": ratio} for way, ratio in zip(WAYS, ratios, strict=True)]
    best = max((each for each in ranked if "competition" not in each["way"]), key=lambda each: each["ratio"])
    return {
        "label": "SIM",
        "trials": TRIALS,
        "batch": BATCH,
        "runs": RUNS,
        "rows": rows,
        "ratios": ranked,
        "default": best["way"],
    }


def ours() -> float:
    """Return evaluations a second of runs with selection map-elites."""
    condition = speed_condition()
    began = time.perf_counter()
    run_replicates(condition, 0, 1)
    return BATCH * SPEED_BATCHES / (time.perf_counter() - began)


def speed_condition() -> Condition:
    """Return the condition of the comparison of speed."""
    return Condition(
        name="speed",
        platform="sim",
        selection="map-elites",
        seed=SEED,
        neat={"population": BATCH, "generations": SPEED_BATCHES},
        archive={"descriptor": ["region_share"], "cells": [3] * 6},
    )


def pyribs() -> float:
    """Return evaluations a second of pyribs with networks of fixed structure in our simulator."""
    from ribs.archives import GridArchive
    from ribs.emitters import GaussianEmitter
    from ribs.schedulers import Scheduler

    condition = speed_condition()
    arena, n_inputs = condition.arena.arena(), len(condition.network_inputs)
    genes = {
        "hidden": [],
        "biases": [],
        "innovation": list(range(2 * n_inputs)),
        "source": list(range(n_inputs)) * 2,
        "target": [n_inputs] * n_inputs + [n_inputs + 1] * n_inputs,
        "enabled": [True] * (2 * n_inputs),
    }
    archive = GridArchive(solution_dim=2 * n_inputs, dims=[3] * 6, ranges=[(0.0, 1.0)] * 6, seed=SEED)
    emitter = GaussianEmitter(archive, sigma=1.0, x0=np.zeros(2 * n_inputs), batch_size=BATCH, seed=SEED)
    scheduler = Scheduler(archive, [emitter])
    platform, describe = SimPlatform(), condition.archive.describe
    trials = SimpleNamespace(arena=arena, n_steps=platform.steps)
    began = time.perf_counter()
    for batch in range(SPEED_BATCHES):
        genomes = [
            genome_from_record({**genes, "weight": weights.tolist()}, condition.neat_rules)
            for weights in scheduler.ask()
        ]
        key = NoiseKey(condition.key, 0, batch)
        tried = try_genomes(
            platform, arena, genomes, noise=0.0, noise_key=key, inputs=condition.network_inputs
        )
        described = describe(SimpleNamespace(batch=tried), trials, condition.network_inputs)
        scheduler.tell(tried.coverage_line, described)
    return BATCH * SPEED_BATCHES / (time.perf_counter() - began)


def maze_condition(batches: int) -> Condition:
    """Return the condition of the maze of Kheperax."""
    folder = Path(__file__).parent / "kheperax"
    condition = load_study(folder / "study.toml").conditions[0]
    task = PythonTask.from_file(f"python:{folder / 'energy.py'}:energy").allowed()
    neat = condition.neat.model_copy(update={"generations": batches})
    return condition.model_copy(update={"task": task, "neat": neat})


def maze() -> float:
    """Return evaluations a second of runs in the maze of Kheperax."""
    condition = maze_condition(MAZE_BATCHES)
    began = time.perf_counter()
    run_replicates(condition, 0, 1)
    return MAZE_BATCHES * condition.neat.population / (time.perf_counter() - began)


def kheperax() -> dict[str, Any]:
    """Return what archives of the maze of Kheperax hold at the end: theirs, and ours."""
    condition = maze_condition(kheperax_peer.EVALUATIONS // kheperax_peer.ELITES_BATCH)
    own = []
    for replicate in range(MAZE_RUNS):
        elites = elites_of(condition, run_replicates(condition, replicate, 1))["fitness"].to_numpy()
        n_cells = condition.archive.n_cells
        score = float((elites + kheperax_peer.QD_OFFSET).sum())
        own.append({"filled": len(elites) / n_cells, "qd_score": score, "best": float(elites.max())})
        print(json.dumps(own[-1]), flush=True)
    python = build_environment(kheperax_peer.PEER, fresh=False)
    theirs = measure(kheperax_peer.PEER, python, "archive", seconds=3600.0)
    return {"label": "SIM", "ours": own, "kheperax": theirs}


def speed() -> dict[str, Any]:
    """Return the medians of each, measured in turn, and the ratios."""
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    ours(), pyribs(), maze()  # compile
    times = [(ours(), pyribs(), maze()) for _ in range(TIMES)]
    mine, others, in_maze = (statistics.median(each) for each in zip(*times, strict=True))
    peer = measure(kheperax_peer.PEER, build_environment(kheperax_peer.PEER, fresh=False), "elites")
    return {
        "ours": mine,
        "pyribs": others,
        "ratio": mine / others,
        "ours_in_maze": in_maze,
        "kheperax": peer["median"],
        "ratio_in_maze": in_maze / peer["median"],
        "times": TIMES,
        "versions": peer["versions"],
    }


COMMANDS = {"noise": noise, "speed": speed, "kheperax": kheperax}


def main() -> None:
    """Measure, and write what was measured."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=COMMANDS)
    parser.add_argument("--out", type=Path, required=True, help="folder of the file")
    arguments = parser.parse_args()
    found = COMMANDS[arguments.what]()
    path = arguments.out / f"map-elites-{arguments.what}.json"
    path.write_text(json.dumps(found, indent=1) + "\n", "utf-8")
    print(f"Written: {path}")


if __name__ == "__main__":
    main()
