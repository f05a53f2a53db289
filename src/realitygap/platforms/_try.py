"""Trials of networks on a platform: many in one call, or one with every step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import Genome, decode_all
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.math.philox import MAX_INDIVIDUALS
from realitygap.kernels.neat.genome import NeatRules
from realitygap.tasks import Task, Trajectories
from realitygap.trials import (
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
from realitygap.world import Arena

from ._platform import Platform

TRACE_BYTES = 8_000_000
"""Memory for stored steps [bytes]."""


def open_trials(
    platform: Platform,
    arena: Arena,
    rules: NeatRules,
    *,
    inputs: Sequence[str] | None = None,
    noise: float,
    bias_value: float,
) -> PlatformTrials:
    """Return a platform set up in an arena, ready to try networks of one kind.

    Args:
        platform: The robot as simulated.
        arena: Arena of the trials.
        rules: NEAT's, of which only the network's kind counts.
        inputs: Names of what the networks see, in order; the paper's when not given.
        noise: Level a: each reading is moved by a * U(-1, 1); on `sim` on top of the robot's own noise.
        bias_value: Value of the constant input.

    Raises:
        ValueError: The platform cannot give such inputs or takes no such number of robots, or the noise is not a
            finite number from 0 on.
    """
    platform.check_robots(arena)
    names = paper_inputs(rules) if inputs is None else tuple(inputs)
    return platform.prepare(arena, rules, inputs=names, noise=noise, bias_value=bias_value)


def open_for_genomes(
    platform: Platform,
    arena: Arena,
    genomes: Sequence[Genome],
    *,
    inputs: Sequence[str] | None,
    noise: float,
) -> PlatformTrials:
    """Return a platform set up as by `open_trials`, ready to try networks of these genomes.

    Raises:
        ValueError: As in `open_trials`, or the genomes are of several kinds.
    """
    check_genomes(genomes, inputs)
    first = genomes[0]
    return open_trials(platform, arena, first.rules, inputs=inputs, noise=noise, bias_value=first.bias_value)


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
        arena: Arena of the trials.
        genomes: Genomes with these inputs and 2 outputs, all of one kind: constant input, activation, recurrence, and
            biases of nodes are the same.
        noise: Level a: each reading is moved by a * U(-1, 1); on `sim` on top of the robot's own noise.
        noise_key: Key of the random numbers. Genome k draws those of individual `noise_key.individual` + k.
        inputs: Names of the inputs, in order (`Task.inputs`). Default: the paper's obstacle, stall, and time, and
            `bias` if the genomes have a constant input.

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


def traced_at_once(trials: PlatformTrials, n_inputs: int, *, is_single: bool) -> int:
    """Return how many trials fit into `TRACE_BYTES` if every step is stored; at least one block of lanes."""
    numbers = 10 + 2 * len(trials.sensors) + n_inputs
    numbers *= trials.arena.n_robots
    blocks = TRACE_BYTES // ((4 if is_single else 8) * numbers * (trials.n_steps + 1) * LANES)
    return max(1, blocks) * LANES


def scores_of(
    task: Task, trials: PlatformTrials, tried: Tried, network_inputs: tuple[str, ...]
) -> NDArray[np.float64]:
    """Return what each trial is worth by a task, shape (n,); with several robots in an arena, the mean of theirs.

    Raises:
        TaskError: The task cannot be scored in the arena, or a function of the user failed.
    """
    scores = np.asarray(
        task.fitness(trajectories_of(trials, tried, network_inputs), trials.arena), np.float64
    )
    n_robots = trials.arena.n_robots
    return scores if n_robots == 1 else np.asarray(scores.reshape(-1, n_robots).mean(axis=1))


def trajectories_of(trials: PlatformTrials, tried: Tried, network_inputs: tuple[str, ...]) -> Trajectories:
    """Return trials as a task sees them; of several robots in an arena, those of each trial one after the other.

    Coverage and stalls are then those of all robots of a trial.
    """
    batch = tried.batch
    if trials.arena.others:
        batch = batch.repeated(trials.arena.n_robots)
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
    partners: Sequence[Genome] = (),
) -> Trajectory:
    """Try one genome once and keep every step; arguments and errors as in `try_genomes`.

    Args:
        platform, arena, genome, noise, noise_key, inputs: Arguments of `try_genomes`.
        partners: Genomes of the other robots in the arena; the same genome when not given.
    """
    which = np.arange(1 + len(partners), dtype=np.int32)[None]
    genomes = [genome, *partners]
    trials = open_for_genomes(platform, arena, genomes, inputs=inputs, noise=noise)
    networks, counters = decode_all(genomes), counters_of(noise_key)
    tried = trials.carry_out(networks, which if partners else which[0], noise_key.key, counters, trace=True)
    others = tuple(_trajectory(trials, tried, robot) for robot in range(1, arena.n_robots))
    return _trajectory(trials, tried, 0, others)


def _trajectory(
    trials: PlatformTrials, tried: Tried, robot: int, others: tuple[Trajectory, ...] = ()
) -> Trajectory:
    """Return the trajectory of one robot of the first trial."""
    batch, trace = tried.batch, tried.trace
    names = batch.drawn_names if robot == 0 else ()
    return Trajectory(
        trials.step_s,
        poses_of(trace.poses[:, :, robot], trials.arena.start),
        tried.distances[:, :, robot].astype(np.float64) * trials.distance_unit,
        trace.inputs[:, :, robot].astype(np.float64),
        trace.commands[:, :, robot].astype(np.float64),
        trace.stalled[:, robot],
        float(batch.coverage_line[0]),
        float(batch.coverage_ends[0]),
        tuple(int(cell) for cell in batch.behavior(0)),
        tuple(name for name in trials.sensors if name.startswith("range.")),
        trace.wheels[:, :, robot].astype(np.float64),
        trace.readings[:, :, robot].astype(np.float64),
        trials.sensors,
        tuple(batch.drawn[0].tolist()) if names else (),
        names,
        others,
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
    trials = open_for_genomes(platform, arena, genomes, inputs=inputs, noise=noise)
    return trials, trials.carry_out(decode_all(genomes), which, noise_key.key, counters, trace=trace)
