"""Trials on the platform `jyro`: many networks tried in one call, or one trial kept step by step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import whole_number
from realitygap.evolution import Genome, decode_all
from realitygap.kernels._math import sin_cos
from realitygap.kernels._philox import MAX_GENERATIONS, MAX_INDIVIDUALS, MAX_REPEATS, PURPOSE_NOISE
from realitygap.kernels._trial import Trace, TrialRules, TrialScene, make_block, make_trace, run_trials
from realitygap.robots import STEP_S, JyroPlatform
from realitygap.world import Arena, Pose

REAL: dict[str, Any] = {"single": np.float32, "double": np.float64}

# How near to a border of cells [cells] is on it: beyond what rounding does to a position in a long trial.
SNAP = {"single": 1e-5, "double": 1e-9}


def _normals(walls: NDArray[np.float64]) -> NDArray[np.float64]:
    """(w, 3) unit normals towards the side of the start, which is the origin, and offsets of walls (w, 4)."""
    along = walls[:, 2:] - walls[:, :2]
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.hypot(along[:, 0], along[:, 1])[:, None]
    offsets = (normals * walls[:, :2]).sum(axis=1)
    outward = offsets > 0
    normals[outward] *= -1
    offsets[outward] *= -1
    return np.column_stack([normals, offsets])


def is_enclosed(platform: JyroPlatform, walls: NDArray[np.float64], heading: float) -> bool:
    """Whether a trial may take each wall for the whole line through it.

    So it is where the walls close a convex room around the robot at its start, every sensor is mounted
    inside the body's outline, and no step moves the center as far as twice its distance from the nearest edge of
    the body. Then the body cannot come to lie beyond a wall whole: its center is at least that distance
    inside before such a step and as far outside after it. So it is in touch with a wall wherever a
    corner of it is beyond one's line.

    Args:
        platform: Body, sensors and speed.
        walls: (w, 4) ends [m] as seen from the start.
        heading: Of the start.
    """
    ends = [tuple(end) for wall in walls for end in (wall[:2], wall[2:])]
    if (
        len(walls) < 3
        or any(ends.count(end) != 2 for end in ends)
        or (walls[:, :2] == walls[:, 2:]).all(1).any()
    ):
        return False
    normals = _normals(walls)
    gaps = normals[:, :2] @ walls.reshape(-1, 2).T - normals[:, 2:]
    if (normals[:, 2] == 0).any() or gaps.min() < -1e-9:
        return False
    sine, cosine = math.sin(heading), math.cos(heading)
    body = np.array(platform.body.corners)
    turned = body @ np.array([[cosine, sine], [-sine, cosine]])
    if (normals[:, :2] @ turned.T - normals[:, 2:]).min() <= 0:
        return False
    edges = np.column_stack([body, np.roll(body, -1, axis=0)])
    mounts = np.array([(forward, left) for forward, left, _ in platform.sensors.mounts])
    inside = _normals(edges)
    if (inside[:, :2] @ body.T - inside[:, 2:]).min() < -1e-9:
        return False
    if (inside[:, :2] @ mounts.T - inside[:, 2:]).min() < 0:
        return False
    return bool(platform.speed * STEP_S < 2 * -inside[:, 2].max())


def jyro_scene(platform: JyroPlatform, arena: Arena) -> TrialScene:
    """Arena, body and sensors in the form that kernels read.

    Raises:
        ValueError: More than 256 cells: a cell is kept as one byte.
    """
    if arena.grid.n_cells > 256:
        raise ValueError(f"The arena has {arena.grid.n_cells} reachable cells, expected at most 256.")
    real = REAL[platform.precision]
    start = arena.start
    walls = np.array(arena.walls, np.float64).reshape(-1, 4) - [start.x, start.y, start.x, start.y]
    sensors = np.empty((len(platform.sensors.mounts), 4))
    for k, (forward, left, direction) in enumerate(platform.sensors.mounts):
        sine, cosine = sin_cos(direction) if direction else (0.0, 1.0)
        sensors[k] = forward, left, cosine, sine
    grid = arena.grid
    in_cells = [(start.x - grid.x) / grid.cell, (start.y - grid.y) / grid.cell]
    cells = [round(place) if abs(place - round(place)) < SNAP["double"] else place for place in in_cells]
    return TrialScene(
        walls=walls.astype(real),
        normals=_normals(walls).astype(real),
        is_enclosed=is_enclosed(platform, walls, start.heading),
        body=np.array(platform.body.corners, real),
        sensors=sensors.astype(real),
        heading=np.array([start.heading / math.tau], real),
        grid=np.array([*cells, 1 / grid.cell, SNAP[platform.precision]], real),
        columns=grid.columns,
        rows=grid.rows,
    )


def jyro_rules(
    platform: JyroPlatform,
    *,
    noise: float,
    bias_input: bool,
    bias_value: float,
) -> TrialRules:
    """How a trial on `jyro` is run, in the form that kernels read.

    Raises:
        ValueError: The noise is not a finite number from 0 on.
    """
    if not (math.isfinite(noise) and noise >= 0):
        raise ValueError(f"noise is {noise}, expected a finite number, 0 or more.")
    real = REAL[platform.precision]
    return TrialRules(
        n_steps=platform.steps,
        clip=platform.noisy_reading == "clip",
        bias_input=bias_input,
        bias_value=float(bias_value),
        step_length=np.array([platform.speed * STEP_S], real),
        step_turn=np.array([platform.turn_rate * STEP_S / math.tau], real),
        noise=np.array([noise], real),
        sensor_range=np.array([platform.sensor_range], real),
    )


def poses_of(poses: NDArray[np.floating], start: Pose) -> NDArray[np.float64]:
    """(n, 3) x [m], y [m], heading [rad, 0 to 2 pi] of poses (n, >= 3) as kernels keep them."""
    seen = poses[:, :3].astype(np.float64) * [1.0, 1.0, math.tau] + [start.x, start.y, 0.0]
    seen[:, 2] %= math.tau
    return seen


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


def counters_of(key: NoiseKey, n: int = 1) -> NDArray[np.uint32]:
    """(n, 3) the fixed words of the random numbers of n individuals from that of the key on."""
    counters = np.empty((n, 3), np.uint32)
    counters[:, 0] = np.arange(key.individual, key.individual + n) << 8 | int(PURPOSE_NOISE)
    counters[:, 1] = key.generation << 12 | key.repeat
    counters[:, 2] = key.replicate
    return counters


def run_all(
    platform: JyroPlatform,
    arena: Arena,
    genomes: Sequence[Genome],
    rows: NDArray[np.int32],
    noise: float,
    key: int,
    counters: NDArray[np.uint32],
    kept_steps: int = -1,
) -> tuple[TrialBatch, Trace]:
    """Trial k is one of genome `rows[k]` with the random numbers of `counters[k]`; the trace is of the first."""
    _check_sizes(genomes)
    rules = genomes[0].rules
    scene = jyro_scene(platform, arena)
    trial = jyro_rules(
        platform,
        noise=noise,
        bias_input=rules.bias_input >= 0,
        bias_value=genomes[0].bias_value,
    )
    trace = make_trace(scene.heading, scene.sensors.shape[0], rules.n_inputs, kept_steps, 1)
    cells = np.zeros((len(rows), arena.grid.n_cells), np.uint8)
    counts = np.zeros((len(rows), 3), np.int32)
    if len(rows):
        networks = decode_all(genomes)
        lanes, wiring = make_block(scene, rules, networks.place.shape[1])
        run_trials(
            scene,
            trial,
            rules,
            networks,
            rows,
            np.uint64(key),
            counters,
            lanes,
            wiring,
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
    n = len(genomes)
    if noise_key.individual + len(genomes) > MAX_INDIVIDUALS:
        raise ValueError(
            f"The last of {len(genomes)} genomes from individual {noise_key.individual} on is beyond "
            f"{MAX_INDIVIDUALS - 1}: its numbers would repeat. Begin lower, or try fewer in a call."
        )
    rows, counters = np.arange(n, dtype=np.int32), counters_of(noise_key, n)
    return run_all(platform, arena, genomes, rows, noise, noise_key.key, counters)[0]


def trace_genome(
    platform: JyroPlatform,
    arena: Arena,
    genome: Genome,
    *,
    noise: float,
    noise_key: NoiseKey,
) -> Trajectory:
    """Try one genome once and keep every step; arguments as in `try_genomes`."""
    rows, counters = np.zeros(1, np.int32), counters_of(noise_key)
    batch, trace = run_all(platform, arena, [genome], rows, noise, noise_key.key, counters, platform.steps)
    return Trajectory(
        STEP_S,
        poses_of(trace.poses[:, :, 0], arena.start),
        trace.readings[:, :, 0].astype(np.float64) * platform.sensor_range,
        trace.inputs[:, :, 0].astype(np.float64),
        trace.commands[:, :, 0].astype(np.float64),
        trace.stalled[:, 0],
        float(batch.coverage_line[0]),
        float(batch.coverage_ends[0]),
        tuple(int(cell) for cell in batch.behavior(0)),
    )


def _check_sizes(genomes: Sequence[Genome]) -> None:
    if not genomes:
        raise ValueError("No genome to try, expected at least one.")
    first = _kind(genomes[0])
    # Genomes of one population share their rules: few kinds need a look.
    kinds = {(id(genome.rules), genome.bias_value): k for k, genome in reversed(list(enumerate(genomes)))}
    for k in sorted(kinds.values()):
        rules = genomes[k].rules
        given = rules.n_inputs - (rules.bias_input >= 0)
        if given != 3 or rules.n_outputs != 2:
            raise ValueError(
                f"A genome has {given} inputs and {rules.n_outputs} outputs, expected 3 inputs (largest "
                "reading, stall, time; a constant one is extra) and 2 outputs (move, turn)."
            )
    for k in sorted(kinds.values()):
        for name, value in _kind(genomes[k]).items():
            if value != first[name]:
                raise ValueError(
                    f"Genome {k} has {name} {value}, genome 0 has {first[name]}: expected genomes of one kind. Try "
                    "those of each kind in a call of their own."
                )


def _kind(genome: Genome) -> dict[str, float]:
    """What all genomes of a call share: the kernels read it once."""
    names = ("n_inputs", "bias_input", "activation", "activation_slope", "recurrent", "node_bias")
    return {name: getattr(genome.rules, name) for name in names} | {"bias_value": genome.bias_value}
