"""Trials on the platform `jyro`: many networks tried in one call, or one trial kept step by step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import whole_number
from realitygap.evolution import Genome, decode_all
from realitygap.kernels._math import sin_cos
from realitygap.kernels._philox import MAX_GENERATIONS, MAX_INDIVIDUALS, MAX_REPEATS
from realitygap.kernels._trial import Trace, TrialRules, TrialScene, make_trace, make_workspace, run_trials
from realitygap.robots import STEP_S, JyroPlatform
from realitygap.world import Arena


def jyro_scene(platform: JyroPlatform, arena: Arena) -> TrialScene:
    """Arena, body and sensors in the form that kernels read.

    Raises:
        ValueError: More than 256 cells: a cell is kept as one byte.
    """
    if arena.grid.n_cells > 256:
        raise ValueError(f"The arena has {arena.grid.n_cells} reachable cells, expected at most 256.")
    walls = np.array(arena.walls, np.float64).reshape(-1, 4)
    along = walls[:, 2:] - walls[:, :2]
    length = np.sqrt((along * along).sum(axis=1))
    normals = np.stack([-along[:, 1] / length, along[:, 0] / length], axis=1)
    offsets = (normals * walls[:, :2]).sum(axis=1)
    mounts = platform.sensors.mounts
    sensors = np.empty((len(mounts), 4))
    radius = 0.0
    for k, (forward, left, direction) in enumerate(mounts):
        sine, cosine = sin_cos(direction)
        sensors[k] = forward, left, cosine, sine
        radius = max(radius, math.hypot(forward, left) + platform.sensors.max_range)
    grid = arena.grid
    return TrialScene(
        walls=walls,
        normals=np.column_stack([normals, offsets]),
        body=np.array(platform.body.corners, np.float64),
        body_radius=platform.body_radius,
        sensors=sensors,
        sensor_radius=radius,
        sensor_range=float(platform.sensor_range),
        start=np.array(arena.start, np.float64),
        grid=np.array([grid.x, grid.y, grid.cell], np.float64),
        columns=grid.columns,
        rows=grid.rows,
    )


def jyro_rules(platform: JyroPlatform, *, noise: float, bias_input: bool, bias_value: float) -> TrialRules:
    """How a trial on `jyro` is run, in the form that kernels read.

    Raises:
        ValueError: The noise is not a finite number from 0 on.
    """
    if not (math.isfinite(noise) and noise >= 0):
        raise ValueError(f"noise is {noise}, expected a finite number, 0 or more.")
    return TrialRules(
        n_steps=platform.steps,
        step_s=STEP_S,
        speed=platform.speed,
        turn_rate=platform.turn_rate,
        noise=float(noise),
        clip=platform.noisy_reading == "clip",
        bias_input=bias_input,
        bias_value=float(bias_value),
    )


@dataclass(frozen=True)
class TrialBatch:
    """What came of n trials in an arena of c reachable cells.

    Attributes:
        cells: (n, c) uint8; the first `n_line` of a row are the cells along the line in order of first
            visit, columns * row + column.
        n_line: (n,) cells that the line crosses; the start counts.
        n_ends: (n,) cells in which steps end; the start counts.
        n_stalls: (n,) blocked steps.
    """

    cells: NDArray[np.uint8]
    n_line: NDArray[np.int32]
    n_ends: NDArray[np.int32]
    n_stalls: NDArray[np.int32]

    @property
    def coverage_line(self) -> NDArray[np.float64]:
        """(n,) visited share of the reachable cells along the line, 0..1."""
        return np.divide(self.n_line, self.cells.shape[1])

    @property
    def coverage_ends(self) -> NDArray[np.float64]:
        """(n,) visited share of the reachable cells at the ends of steps, 0..1."""
        return np.divide(self.n_ends, self.cells.shape[1])

    def behavior(self, k: int) -> NDArray[np.uint8]:
        """The cells that trial k visited along its line, in order of first visit."""
        return self.cells[k, : self.n_line[k]]


@dataclass(frozen=True)
class Trajectory:
    """A trial step by step; row 0 is the start.

    Attributes:
        step_s: How long a step lasts [s].
        poses: (t + 1, 3) x [m], y [m], heading [rad, counter-clockwise from +x].
        readings: (t + 1, s) distance each sensor measures [m], without noise.
        inputs: (t, i) what the network saw: largest noisy reading, stall, time and, where it has one, the
            constant.
        commands: (t, 2) what it answered: move and turn.
        stalled: (t + 1,) whether the step was blocked.
        coverage_line, coverage_ends: Visited share of the reachable cells, 0..1.
        cells: Cells along the line in order of first visit, columns * row + column.
    """

    step_s: float
    poses: NDArray[np.float64]
    readings: NDArray[np.float64]
    inputs: NDArray[np.float64]
    commands: NDArray[np.float64]
    stalled: NDArray[np.bool_]
    coverage_line: float
    coverage_ends: float
    cells: tuple[int, ...]

    def _repr_svg_(self) -> str:
        from ._picture import path_picture

        return path_picture(self).to_svg(360.0)


@dataclass(frozen=True)
class NoiseKey:
    """Which random numbers a trial draws: those of one individual of one run.

    Raises:
        TypeError: One of them is not a whole number.
        ValueError: One is out of its range, beyond which numbers would repeat.
    """

    key: int
    replicate: int = 0
    generation: int = 0
    individual: int = 0
    repeat: int = 0

    def __post_init__(self) -> None:
        limits = {
            "key": 1 << 64,
            "replicate": 1 << 32,
            "generation": MAX_GENERATIONS,
            "individual": MAX_INDIVIDUALS,
            "repeat": MAX_REPEATS,
        }
        for name, limit in limits.items():
            object.__setattr__(self, name, whole_number(name, getattr(self, name), 0, limit - 1))


def _run(
    platform: JyroPlatform,
    arena: Arena,
    genomes: Sequence[Genome],
    noise: float,
    noise_key: NoiseKey,
    kept_steps: int,
) -> tuple[TrialBatch, Trace]:
    _check_sizes(genomes)
    if noise_key.individual + len(genomes) > MAX_INDIVIDUALS:
        raise ValueError(
            f"The last of {len(genomes)} genomes from individual {noise_key.individual} on is beyond "
            f"{MAX_INDIVIDUALS - 1}: its numbers would repeat. Begin lower, or try fewer in a call."
        )
    rules = genomes[0].rules
    scene = jyro_scene(platform, arena)
    trial = jyro_rules(
        platform, noise=noise, bias_input=rules.bias_input >= 0, bias_value=genomes[0].bias_value
    )
    networks = decode_all(genomes)
    work = make_workspace(scene, rules.n_inputs + networks.order.shape[1])
    trace = make_trace(scene, rules.n_inputs, kept_steps)
    cells = np.zeros((len(genomes), arena.grid.n_cells), np.uint8)
    counts = np.zeros((len(genomes), 3), np.int32)
    run_trials(
        scene,
        trial,
        networks,
        rules,
        np.uint64(noise_key.key),
        noise_key.replicate,
        noise_key.generation,
        noise_key.individual,
        noise_key.repeat,
        work,
        cells,
        counts,
        trace,
    )
    return TrialBatch(cells, counts[:, 0], counts[:, 1], counts[:, 2]), trace


def try_genomes(
    platform: JyroPlatform,
    arena: Arena,
    genomes: Sequence[Genome],
    *,
    noise: float,
    noise_key: NoiseKey,
) -> TrialBatch:
    """Try each of n genomes of one population once.

    Args:
        platform: The robot as simulated.
        arena: Where.
        genomes: With 3 inputs (largest reading, stall, time), or 4 with the constant one, and 2 outputs; all of
            one kind: constant input, activation, recurrence and biases of nodes are the same.
        noise: Level a: each reading is moved by a * U(-1, 1).
        noise_key: Which random numbers; genome k draws those of individual `noise_key.individual` + k.

    Raises:
        ValueError: No genome, one with other inputs or outputs, genomes of several kinds, noise that is not a
            finite number from 0 on, or more individuals than there are numbers for.
    """
    return _run(platform, arena, genomes, noise, noise_key, -1)[0]


def trace_genome(
    platform: JyroPlatform, arena: Arena, genome: Genome, *, noise: float, noise_key: NoiseKey
) -> Trajectory:
    """Try one genome once and keep every step; arguments as in `try_genomes`."""
    batch, trace = _run(platform, arena, [genome], noise, noise_key, platform.steps)
    return Trajectory(
        STEP_S,
        trace.poses,
        trace.readings,
        trace.inputs,
        trace.commands,
        trace.stalled,
        float(batch.coverage_line[0]),
        float(batch.coverage_ends[0]),
        tuple(int(cell) for cell in batch.behavior(0)),
    )


def _check_sizes(genomes: Sequence[Genome]) -> None:
    if not genomes:
        raise ValueError("No genome to try, expected at least one.")
    for genome in genomes:
        given = genome.rules.n_inputs - (genome.rules.bias_input >= 0)
        if given != 3 or genome.rules.n_outputs != 2:
            raise ValueError(
                f"A genome has {given} inputs and {genome.rules.n_outputs} outputs, expected 3 inputs (largest "
                "reading, stall, time; a constant one is extra) and 2 outputs (move, turn)."
            )
    first = _kind(genomes[0])
    for k, genome in enumerate(genomes):
        for name, value in _kind(genome).items():
            if value != first[name]:
                raise ValueError(
                    f"Genome {k} has {name} {value}, genome 0 has {first[name]}: expected genomes of one kind. Try "
                    "those of each kind in a call of their own."
                )


def _kind(genome: Genome) -> dict[str, float]:
    """What all genomes of a call share: the kernels read it once."""
    names = ("n_inputs", "bias_input", "activation", "activation_slope", "recurrent", "node_bias")
    return {name: getattr(genome.rules, name) for name in names} | {"bias_value": genome.bias_value}
