"""Repeated trials of networks, each with its own noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import Genome, decode_all
from realitygap.kernels.math.philox import MAX_REPEATS
from realitygap.tasks import Task
from realitygap.trials import NoiseKey, TrialBatch, check_genomes, counters_of, paper_inputs
from realitygap.world import Arena

from ._platform import Platform
from ._try import open_trials, scores_of, traced_at_once


def retry_genomes(
    platform: Platform,
    arena: Arena,
    genomes: Sequence[Genome],
    *,
    noise: float,
    noise_keys: Sequence[NoiseKey],
    repeats: range,
    inputs: Sequence[str] | None = None,
    partners: Sequence[Sequence[Genome]] = (),
) -> TrialBatch:
    """Try each of n genomes once for each number in `repeats`, with a total of r trials each.

    Args:
        platform: The robot as simulated.
        arena: Arena of the trials.
        genomes: Genomes of one kind, as in `try_genomes`. They may come from different runs.
        noise: Level a: each reading is moved by a * U(-1, 1).
        noise_keys: (n,) keys of the random numbers. `repeats` replaces their own `repeat`.
        repeats: Repeat 0 is the trial that a study has recorded; any other number is fresh noise.
        inputs: Inputs of the networks, as in `try_genomes`.
        partners: Genomes of the other robots in the arena, of each genome; its own when not given.

    Returns:
        n * r trials, those of a genome together: `coverage_line.reshape(n, r)` has a row per genome.

    Raises:
        ValueError: No genome, one with other inputs or outputs, genomes of several kinds, another number of
            keys than of genomes, a repeat below 0 or beyond 4095, or noise that is not a finite number from 0 on.
    """
    return score_genomes(
        platform,
        arena,
        genomes,
        noise=noise,
        noise_keys=noise_keys,
        repeats=repeats,
        inputs=inputs,
        partners=partners,
    )[0]


def score_genomes(
    platform: Platform,
    arena: Arena,
    genomes: Sequence[Genome],
    task: Task | None = None,
    *,
    noise: float,
    noise_keys: Sequence[NoiseKey],
    repeats: range,
    inputs: Sequence[str] | None = None,
    partners: Sequence[Sequence[Genome]] = (),
) -> tuple[TrialBatch, NDArray[np.float64]]:
    """Try genomes as `retry_genomes` does, and score each trial by a task, as an evolution would.

    Args:
        platform, arena, genomes, noise, noise_keys, repeats, inputs, partners: Arguments of `retry_genomes`.
        task: The task; no trial is scored if not given.

    Returns:
        The n * r trials, and (n, r) scores; 0 if there is no task.

    Raises:
        TaskError: The task cannot be scored in the arena.
        ValueError: As in `retry_genomes`.
    """
    every = [*genomes, *(partner for team in partners for partner in team)]
    check_genomes(every, inputs)
    teams = np.arange(len(every), dtype=np.int32)
    if len(every) > len(genomes):
        teams = np.hstack([teams[: len(genomes), None], teams[len(genomes) :].reshape(len(genomes), -1)])
    if len(noise_keys) != len(genomes):
        raise ValueError(f"There are {len(noise_keys)} noise keys, expected {len(genomes)}: one a genome.")
    if len(repeats) and not 0 <= min(repeats) <= max(repeats) < MAX_REPEATS:
        raise ValueError(f"repeats is {repeats}, expected numbers from 0 to {MAX_REPEATS - 1}.")
    n_repeats, n_cells = len(repeats), arena.grid.n_cells
    shape = (len(genomes) * n_repeats,)
    cells, counts = np.zeros((*shape, n_cells), np.uint8), np.zeros((3, *shape), np.int32)
    drawn, scores = np.empty((*shape, 0)), np.zeros(shape)
    first, names = genomes[0], paper_inputs(genomes[0].rules) if inputs is None else tuple(inputs)
    drawn_names: tuple[str, ...] = ()
    is_traced = task is not None and task.needs_trace
    if n_repeats:
        trials = open_trials(
            platform, arena, first.rules, inputs=names, noise=noise, bias_value=first.bias_value
        )
        networks = decode_all(every)
        together = traced_at_once(trials, len(names), is_single=platform.is_single) if is_traced else shape[0]
    for key in {noise_key.key for noise_key in noise_keys} if n_repeats else ():
        rows = [row for row, noise_key in enumerate(noise_keys) if noise_key.key == key]
        firsts = np.concatenate([counters_of(replace(noise_keys[row], repeat=0)) for row in rows])
        counters = np.repeat(firsts, n_repeats, axis=0)
        counters[:, 1] |= np.tile(np.array(repeats, np.uint32), len(rows))
        which = np.repeat(teams[rows], n_repeats, axis=0)
        places = (np.array(rows)[:, None] * n_repeats + np.arange(n_repeats)).reshape(-1)
        for k in range(0, len(places), together):
            part = slice(k, k + together)
            tried = trials.carry_out(networks, which[part], key, counters[part], trace=is_traced)
            batch, place = tried.batch, places[part]
            if batch.drawn_names:
                drawn_names = batch.drawn_names
                drawn = drawn if drawn.shape[1] else np.empty((*shape, len(drawn_names)))
                drawn[place] = batch.drawn
            cells[place] = batch.cells
            counts[:, place] = batch.n_line, batch.n_ends, batch.n_stalls
            if task is not None:
                scores[place] = scores_of(task, trials, tried, names)
    n_line, n_ends, n_stalls = counts
    batch = TrialBatch(cells, n_line, n_ends, n_stalls, drawn=drawn, drawn_names=drawn_names)
    return batch, scores.reshape(len(genomes), n_repeats)
