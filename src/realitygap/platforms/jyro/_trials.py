"""Trials on the platform `jyro`: what its kernels read, and many networks tried in one call."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import paper_interface
from realitygap.kernels.jyro.trial import (
    INPUTS,
    Trace,
    TrialRules,
    TrialScene,
    make_block,
    make_trace,
    run_trials,
)
from realitygap.kernels.math.elementary import sin_cos
from realitygap.kernels.neat.genome import NeatRules
from realitygap.kernels.neat.network import Networks
from realitygap.tasks import TraceArrays
from realitygap.trials import REAL, ResultsRoom, Tried
from realitygap.world import Arena

from ._settings import STEP_S, JyroSettings

# How near to a border of cells [cells] is on it: beyond what rounding does to a position in a long trial.
SNAP = {"single": 1e-5, "double": 1e-9}


def _normals(walls: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return unit normals towards the start, which is the origin, and offsets of walls (w, 4), (w, 3)."""
    along = walls[:, 2:] - walls[:, :2]
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.hypot(along[:, 0], along[:, 1])[:, None]
    offsets = (normals * walls[:, :2]).sum(axis=1)
    outward = offsets > 0
    normals[outward] *= -1
    offsets[outward] *= -1
    return np.column_stack([normals, offsets])


def is_enclosed(platform: JyroSettings, walls: NDArray[np.float64], heading: float) -> bool:
    """Return whether a trial may treat each wall as the whole line through it.

    So it is where the walls close a convex room around the robot at its start, every sensor is mounted
    inside the body's outline, and no step moves the center as far as twice its distance from the nearest edge of
    the body. Then the body cannot come to lie beyond a wall whole: its center is at least that distance
    inside before such a step and as far outside after it. So it is in touch with a wall wherever a
    corner of it is beyond one's line.

    Args:
        platform: Body, sensors and speed.
        walls: (w, 4) ends, in the frame of the start [m].
        heading: Heading of the start.
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


@functools.lru_cache(maxsize=16)  # a report repeats a thousand single trials
def jyro_scene(platform: JyroSettings, arena: Arena) -> TrialScene:
    """Return arena, body and sensors in the form that kernels read, which nobody may change.

    Raises:
        ValueError: More than 256 cells: a cell is kept as one byte; or the arena is not of straight walls.
    """
    if arena.grid.n_cells > 256:
        raise ValueError(f"The arena has {arena.grid.n_cells} reachable cells, expected at most 256.")
    real = REAL[platform.precision]
    start = arena.start
    walls = np.array(arena.straight_walls(), np.float64).reshape(-1, 4) - [start.x, start.y, start.x, start.y]
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
    platform: JyroSettings,
    *,
    noise: float,
    bias_input: bool,
    bias_value: float,
    inputs: Sequence[str] = (),
) -> TrialRules:
    """Return the rules of a trial on `jyro`, in the form that kernels read.

    Args:
        platform: Settings of the platform.
        noise: Level a.
        bias_input: True if networks have the constant input.
        bias_value: Value of the constant input.
        inputs: Names of all inputs of networks, in order; the paper's when not given.

    Raises:
        ValueError: The noise is not a finite number from 0 on.
    """
    if not (math.isfinite(noise) and noise >= 0):
        raise ValueError(f"noise is {noise}, expected a finite number, 0 or more.")
    real = REAL[platform.precision]
    is_paper = tuple(inputs) == paper_interface(constant=bias_input).inputs
    parts = [] if is_paper else [name.partition(".") for name in inputs]
    return TrialRules(
        n_steps=platform.steps,
        clip=platform.noisy_reading == "clip",
        bias_input=bias_input,
        bias_value=float(bias_value),
        step_length=np.array([platform.speed * STEP_S], real),
        step_turn=np.array([platform.turn_rate * STEP_S / math.tau], real),
        noise=np.array([noise], real),
        sensor_range=np.array([platform.sensor_range], real),
        inputs=np.array([(INPUTS[kind], int(k or 0)) for kind, _, k in parts], np.int32).reshape(-1, 2),
    )


class JyroTrials:
    """The platform `jyro` in an arena, ready to try networks of one kind; a `PlatformTrials`.

    Args:
        platform: The robot as simulated.
        arena: Arena of the trials.
        rules: NEAT's, of which only the network's kind counts.
        inputs: Names of the inputs of networks, in order.
        noise: Level a: each reading is moved by a * U(-1, 1).
        bias_value: Value of the constant input.
    """

    step_s = STEP_S
    drawn_names: tuple[str, ...] = ()

    def __init__(
        self,
        platform: JyroSettings,
        arena: Arena,
        rules: NeatRules,
        *,
        inputs: Sequence[str],
        noise: float,
        bias_value: float,
    ) -> None:
        self.arena = arena
        self.n_steps = platform.steps
        self.sensors = tuple(f"range.{k}" for k in range(len(platform.sensors.mounts)))
        self.distance_unit = platform.sensor_range
        self._rules = rules
        self._hidden_room = -1
        self._scene = jyro_scene(platform, arena)
        self._trial = jyro_rules(
            platform, noise=noise, bias_input=rules.bias_input >= 0, bias_value=bias_value, inputs=inputs
        )

    def carry_out(
        self,
        networks: Networks,
        which: NDArray[np.int32],
        key: int,
        counters: NDArray[np.uint32],
        *,
        ends: bool = False,
        trace: bool = False,
    ) -> Tried:
        """See `PlatformTrials.carry_out`."""
        scene, n = self._scene, len(which)
        steps = make_trace(
            scene.heading,
            scene.sensors.shape[0],
            self._rules.n_inputs,
            self.n_steps if trace else -1,
            n if trace else 1,
        )
        results = ResultsRoom.of(n, self.arena.grid.n_cells, ends=ends)
        hidden_room = networks.place.shape[1]
        if hidden_room != self._hidden_room:
            self._hidden_room = hidden_room
            self._block = make_block(scene, self._rules, hidden_room)
        lanes, wiring = self._block
        run_trials(
            scene,
            self._trial,
            self._rules,
            networks,
            which,
            np.uint64(key),
            counters,
            lanes,
            wiring,
            *results,
            steps,
        )
        return Tried(results.batch(), results.end_cells, results.ended, _as_arrays(steps), steps.readings)


def _as_arrays(trace: Trace) -> TraceArrays:
    """Return readings turned so that 1 is near; there are no wheels."""
    nothing = np.zeros((0, 2, trace.stalled.shape[1]), trace.poses.dtype)
    near = 1 - trace.readings
    return TraceArrays(trace.poses, near, trace.inputs, trace.commands, trace.stalled, nothing)
