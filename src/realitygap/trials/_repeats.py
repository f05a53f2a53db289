"""Networks tried again and again, each on noise of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import Genome
from realitygap.kernels._philox import MAX_REPEATS
from realitygap.world import Arena

from ._batch import NoiseKey, TrialBatch, check_genomes, counters_of
from ._try import Platform, try_all


def retry_genomes(
    platform: Platform,
    arena: Arena,
    genomes: Sequence[Genome],
    *,
    noise: float,
    noise_keys: Sequence[NoiseKey],
    repeats: range,
    inputs: Sequence[str] | None = None,
) -> TrialBatch:
    """Try each of n genomes once for each number in `repeats`, r in all.

    Args:
        platform: The robot as simulated.
        arena: Where.
        genomes: Of one kind, as in `try_genomes`; they may come from different runs.
        noise: Level a: each reading is moved by a * U(-1, 1).
        noise_keys: (n,) which random numbers each draws; their own `repeat` gives way to those in `repeats`.
        repeats: Repeat 0 is the trial that a study has recorded; any other number is fresh noise.
        inputs: What the networks see, as in `try_genomes`.

    Returns:
        n * r trials, those of a genome together: `coverage_line.reshape(n, r)` has a row per genome.

    Raises:
        ValueError: No genome, one with other inputs or outputs, genomes of several kinds, another number of
            keys than of genomes, a repeat below 0 or beyond 4095, or noise that is not a finite number from 0 on.
    """
    check_genomes(genomes, inputs)
    if len(noise_keys) != len(genomes):
        raise ValueError(f"There are {len(noise_keys)} noise keys, expected {len(genomes)}: one a genome.")
    if len(repeats) and not 0 <= min(repeats) <= max(repeats) < MAX_REPEATS:
        raise ValueError(f"repeats is {repeats}, expected numbers from 0 to {MAX_REPEATS - 1}.")
    n_repeats = len(repeats)
    cells = np.zeros((len(genomes), n_repeats, arena.grid.n_cells), np.uint8)
    counts = np.zeros((3, len(genomes), n_repeats), np.int32)
    drawn: dict[int, NDArray[np.float64]] = {}
    names: tuple[str, ...] = ()
    for key in {noise_key.key for noise_key in noise_keys}:
        rows = [row for row, noise_key in enumerate(noise_keys) if noise_key.key == key]
        if not n_repeats:
            continue
        firsts = np.concatenate([counters_of(replace(noise_keys[row], repeat=0)) for row in rows])
        counters = np.repeat(firsts, n_repeats, axis=0)
        counters[:, 1] |= np.tile(np.array(repeats, np.uint32), len(rows))
        which = np.repeat(np.array(rows, np.int32), n_repeats)
        _, tried = try_all(platform, arena, genomes, which, key, counters, inputs=inputs, noise=noise)
        batch = tried.batch
        cells[rows] = batch.cells.reshape(len(rows), n_repeats, -1)
        drawn |= dict(zip(rows, batch.drawn.reshape(len(rows), n_repeats, -1), strict=True))
        names = batch.drawn_names
        counts[:, rows] = np.reshape([batch.n_line, batch.n_ends, batch.n_stalls], (3, len(rows), n_repeats))
    all_drawn = np.concatenate([drawn[row] for row in range(len(genomes))]) if drawn else np.empty((0, 0))
    n_line, n_ends, n_stalls = counts.reshape(3, -1)
    return TrialBatch(
        cells.reshape(-1, arena.grid.n_cells), n_line, n_ends, n_stalls, drawn=all_drawn, drawn_names=names
    )
