"""Networks tried again and again, each on noise of its own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from realitygap.evolution import Genome, decode_all
from realitygap.kernels._network import Networks
from realitygap.kernels._philox import MAX_REPEATS
from realitygap.kernels._trial import make_trace, make_workspace, run_trials
from realitygap.robots import JyroPlatform
from realitygap.world import Arena

from ._jyro import NoiseKey, TrialBatch, _check_sizes, jyro_rules, jyro_scene


def retry_genomes(
    platform: JyroPlatform,
    arena: Arena,
    genomes: Sequence[Genome],
    *,
    noise: float,
    noise_keys: Sequence[NoiseKey],
    repeats: range,
) -> TrialBatch:
    """Try each of n genomes once for each number in `repeats`, r in all.

    Args:
        platform: The robot as simulated.
        arena: Where.
        genomes: Of one kind, as in `try_genomes`; they may come from different runs.
        noise: Level a: each reading is moved by a * U(-1, 1).
        noise_keys: (n,) which random numbers each draws; their own `repeat` gives way to those in `repeats`.
        repeats: Repeat 0 is the trial that a study has recorded; any other number is fresh noise.

    Returns:
        n * r trials, those of a genome together: `coverage_line.reshape(n, r)` has a row per genome.

    Raises:
        ValueError: No genome, one with other inputs or outputs, genomes of several kinds, another number of
            keys than of genomes, a repeat below 0 or beyond 4095, or noise that is not a finite number from 0 on.
    """
    _check_sizes(genomes)
    if len(noise_keys) != len(genomes):
        raise ValueError(f"There are {len(noise_keys)} noise keys, expected {len(genomes)}: one a genome.")
    if len(repeats) and not 0 <= min(repeats) <= max(repeats) < MAX_REPEATS:
        raise ValueError(f"repeats is {repeats}, expected numbers from 0 to {MAX_REPEATS - 1}.")
    rules = genomes[0].rules
    scene = jyro_scene(platform, arena)
    trial = jyro_rules(
        platform, noise=noise, bias_input=rules.bias_input >= 0, bias_value=genomes[0].bias_value
    )
    networks = decode_all(genomes)
    work = make_workspace(scene, rules.n_inputs + networks.order.shape[1])
    trace = make_trace(scene, rules.n_inputs, -1)
    total = len(genomes) * len(repeats)
    cells = np.zeros((total, arena.grid.n_cells), np.uint8)
    counts = np.zeros((total, 3), np.int32)
    at = 0
    for k, key in enumerate(noise_keys):
        one = Networks._make(part[k : k + 1] for part in networks)
        for repeat in repeats:
            run_trials(
                scene,
                trial,
                one,
                rules,
                np.uint64(key.key),
                key.replicate,
                key.generation,
                key.individual,
                repeat,
                work,
                cells[at : at + 1],
                counts[at : at + 1],
                trace,
            )
            at += 1
    return TrialBatch(cells, counts[:, 0], counts[:, 1], counts[:, 2])
