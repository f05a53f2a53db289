"""Networks tried on a platform: many in one call, or one kept step by step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import Genome, decode_all
from realitygap.kernels._genome import NeatRules
from realitygap.kernels._philox import MAX_INDIVIDUALS
from realitygap.robots import JyroPlatform, SimPlatform, TwinPlatform
from realitygap.tasks import Trajectories
from realitygap.world import Arena

from ._batch import (
    NoiseKey,
    PlatformTrials,
    Trajectory,
    TrialBatch,
    Tried,
    check_genomes,
    counters_of,
    paper_inputs,
    poses_of,
)
from ._jyro import JyroTrials
from ._sim import SimTrials
from ._twin_trials import TwinTrials

Platform = JyroPlatform | SimPlatform | TwinPlatform
"""A platform on which networks can be tried in one call."""


def open_trials(
    platform: Platform,
    arena: Arena,
    rules: NeatRules,
    *,
    inputs: Sequence[str] | None = None,
    noise: float,
    bias_value: float,
) -> PlatformTrials:
    """A platform set up in an arena, ready to try networks of one kind.

    Args:
        platform: The robot as simulated.
        arena: Where.
        rules: NEAT's, of which only the network's kind counts.
        inputs: Names of what the networks see, in order; the paper's when not given.
        noise: Level a: each reading is moved by a * U(-1, 1); on `sim` on top of the robot's own noise.
        bias_value: Of the constant input.

    Raises:
        ValueError: The platform cannot give such inputs, or the noise is not a finite number from 0 on.
    """
    names = paper_inputs(rules) if inputs is None else tuple(inputs)
    if isinstance(platform, SimPlatform):
        return SimTrials(platform, arena, rules, inputs=names, noise=noise, bias_value=bias_value)
    if isinstance(platform, TwinPlatform):
        if noise:
            raise ValueError(
                f"noise is {noise:g}, expected none on platform 'twin': its readings are noisy already."
            )
        return TwinTrials(platform, arena, rules, inputs=names, bias_value=bias_value)
    if names != paper_inputs(rules):
        raise ValueError(
            f"The networks see {', '.join(names)}, expected {', '.join(paper_inputs(rules))} on platform 'jyro'. "
            "Choose platform 'sim'."
        )
    return JyroTrials(platform, arena, rules, noise=noise, bias_value=bias_value)


def try_all(
    platform: Platform,
    arena: Arena,
    genomes: Sequence[Genome],
    which: NDArray[np.int32],
    key: int,
    counters: NDArray[np.uint32],
    *,
    inputs: Sequence[str] | None,
    noise: float,
    trace: bool = False,
) -> tuple[PlatformTrials, Tried]:
    """Trial k is one of genome `which[k]` with the random numbers of `counters[k]`."""
    check_genomes(genomes, inputs)
    first = genomes[0]
    trials = open_trials(
        platform, arena, first.rules, inputs=inputs, noise=noise, bias_value=first.bias_value
    )
    return trials, trials.carry_out(decode_all(genomes), which, key, counters, trace=trace)


def try_genomes(
    platform: Platform,
    arena: Arena,
    genomes: Sequence[Genome],
    *,
    noise: float,
    noise_key: NoiseKey,
    inputs: Sequence[str] | None = None,
) -> TrialBatch:
    """Try each of n genomes of one population once.

    Args:
        platform: The robot as simulated.
        arena: Where.
        genomes: With these inputs and 2 outputs; all of one kind: constant input, activation, recurrence and biases of
            nodes are the same.
        noise: Level a: each reading is moved by a * U(-1, 1); on `sim` on top of the robot's own noise.
        noise_key: Which random numbers; genome k draws those of individual `noise_key.individual` + k.
        inputs: Names of what the networks see, in order (`Task.inputs`); the paper's obstacle, stall and time when not
            given, and `bias` where the genomes have a constant input.

    Raises:
        ValueError: No genome, one with other inputs or outputs, genomes of several kinds, noise that is not a
            finite number from 0 on, inputs that the platform cannot give, or more individuals than there are
            numbers for.
    """
    return _try_in_order(platform, arena, genomes, noise, noise_key, inputs)[1].batch


def trace_genomes(
    platform: Platform,
    arena: Arena,
    genomes: Sequence[Genome],
    *,
    noise: float,
    noise_key: NoiseKey,
    inputs: Sequence[str] | None = None,
) -> Trajectories:
    """Try each of n genomes once and keep every step; arguments and errors as in `try_genomes`."""
    trials, tried = _try_in_order(platform, arena, genomes, noise, noise_key, inputs, trace=True)
    names = paper_inputs(genomes[0].rules) if inputs is None else tuple(inputs)
    return trajectories_of(trials, tried, names)


def trajectories_of(trials: PlatformTrials, tried: Tried, network_inputs: tuple[str, ...]) -> Trajectories:
    """Trials as a task sees them."""
    batch = tried.batch
    return Trajectories(
        trials.arena,
        trials.step_s,
        tried.trace,
        trials.sensors,
        network_inputs,
        batch.coverage_line,
        batch.coverage_ends,
        batch.n_stalls,
        dict(zip(batch.drawn_names, np.ascontiguousarray(batch.drawn.T), strict=True)),
    )


def trace_genome(
    platform: Platform,
    arena: Arena,
    genome: Genome,
    *,
    noise: float,
    noise_key: NoiseKey,
    inputs: Sequence[str] | None = None,
) -> Trajectory:
    """Try one genome once and keep every step; arguments and errors as in `try_genomes`."""
    trials, tried = _try_in_order(platform, arena, [genome], noise, noise_key, inputs, trace=True)
    batch, trace = tried.batch, tried.trace
    return Trajectory(
        trials.step_s,
        poses_of(trace.poses[:, :, 0], trials.arena.start),
        tried.distances[:, :, 0].astype(np.float64) * trials.distance_unit,
        trace.inputs[:, :, 0].astype(np.float64),
        trace.commands[:, :, 0].astype(np.float64),
        trace.stalled[:, 0],
        float(batch.coverage_line[0]),
        float(batch.coverage_ends[0]),
        tuple(int(cell) for cell in batch.behavior(0)),
        tuple(name for name in trials.sensors if name.startswith("range.")),
        trace.wheels[:, :, 0].astype(np.float64),
        trace.readings[:, :, 0].astype(np.float64),
        trials.sensors,
        tuple(batch.drawn[0].tolist()) if batch.drawn_names else (),
        batch.drawn_names,
    )


def _try_in_order(
    platform: Platform,
    arena: Arena,
    genomes: Sequence[Genome],
    noise: float,
    noise_key: NoiseKey,
    inputs: Sequence[str] | None,
    *,
    trace: bool = False,
) -> tuple[PlatformTrials, Tried]:
    n = len(genomes)
    if noise_key.individual + n > MAX_INDIVIDUALS:
        raise ValueError(
            f"The last of {n} genomes from individual {noise_key.individual} on is beyond {MAX_INDIVIDUALS - 1}: its "
            "numbers would repeat. Begin lower, or try fewer in a call."
        )
    which, counters = np.arange(n, dtype=np.int32), counters_of(noise_key, n)
    return try_all(
        platform, arena, genomes, which, noise_key.key, counters, inputs=inputs, noise=noise, trace=trace
    )
