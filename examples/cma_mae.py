"""CMA-MAE of pyribs evolves the weights of a fixed network in our simulator.

pyribs has emitters for vectors, such as those of CMA-ME and CMA-MAE (Fontaine & Nikolaidis 2023). Here a vector has the
weights of a network without hidden nodes. Each is tried four times, and described by its share of blocked steps and by
the share of its cells in the left half of the arena. At the end, the elites are tried again with fresh noise.

    uv run --extra qd python examples/cma_mae.py
"""

import numpy as np
from ribs.archives import GridArchive
from ribs.emitters import EvolutionStrategyEmitter
from ribs.schedulers import Scheduler

from realitygap import Condition
from realitygap.evolution import Genome, genome_from_record
from realitygap.platforms import retry_genomes
from realitygap.trials import NoiseKey, TrialBatch

BATCHES, REPEATS, RETRIES = 60, 4, 64
CONDITION = Condition(name="fixed", platform="sim")
N_INPUTS = len(CONDITION.network_inputs)


def genome_of(weights: np.ndarray) -> Genome:
    """Return a network whose inputs all lead to both outputs, with these weights, (2 * inputs,)."""
    n = 2 * N_INPUTS
    record = {
        "hidden": [],
        "biases": [],
        "innovation": list(range(n)),
        "source": list(range(N_INPUTS)) * 2,
        "target": [N_INPUTS] * N_INPUTS + [N_INPUTS + 1] * N_INPUTS,
        "weight": weights.tolist(),
        "enabled": [True] * n,
    }
    return genome_from_record(record, CONDITION.neat_rules)


def try_all(genomes: list[Genome], batch: int, repeats: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean coverage (n,) and descriptors (n, 2) of genomes over their trials."""
    arena = CONDITION.arena.arena()
    keys = [NoiseKey(CONDITION.key, 0, batch, k) for k in range(len(genomes))]
    trials = retry_genomes(
        CONDITION.on,
        arena,
        genomes,
        noise=CONDITION.noise,
        noise_keys=keys,
        repeats=range(repeats),
        inputs=CONDITION.network_inputs,
    )
    left = [left_share(trials, k, arena.grid.columns) for k in range(len(trials.n_line))]
    each = np.column_stack([trials.coverage_line, trials.n_stalls / CONDITION.on.steps, left])
    coverage, *descriptors = each.reshape(len(genomes), repeats, 3).mean(axis=1).T
    return coverage, np.array(descriptors).T


def left_share(trials: TrialBatch, k: int, columns: int) -> float:
    """Return the share of the visited cells that lie in the left half."""
    return float(np.mean(trials.behavior(k) % columns < columns / 2))


def main() -> None:
    """Evolve, and try the elites again."""
    archive, result = (
        GridArchive(solution_dim=2 * N_INPUTS, dims=[10, 10], ranges=[(0, 1), (0, 1)], seed=1, **more)
        for more in ({"learning_rate": 0.1, "threshold_min": 0.0}, {})
    )
    emitters = [
        EvolutionStrategyEmitter(
            archive, x0=np.zeros(2 * N_INPUTS), sigma0=1.0, ranker="imp", batch_size=30, seed=seed
        )
        for seed in range(3)
    ]
    scheduler = Scheduler(archive, emitters, result_archive=result)
    for batch in range(BATCHES):
        coverage, descriptors = try_all([genome_of(each) for each in scheduler.ask()], batch, REPEATS)
        scheduler.tell(coverage, descriptors)

    elites = result.data()
    again, places = try_all([genome_of(each) for each in elites["solution"]], BATCHES, RETRIES)
    print(f"{len(again)} of {result.cells} cells are filled. Mean coverage of elites as found: ", end="")
    print(f"{elites['objective'].mean():.3f}, by {RETRIES} fresh trials: {again.mean():.3f}.")
    stayed = np.mean(result.index_of(places) == elites["index"])
    print(f"{stayed:.0%} of the elites belong in their cell. The best covers {again.max():.3f}.")


if __name__ == "__main__":
    main()
