"""Trials on the platform `sim`: many networks tried in one call, each with what was drawn for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.neat.genome import NeatRules
from realitygap.kernels.neat.network import Networks
from realitygap.kernels.sim.lanes import SimRules, SimTrace, make_sim_room, make_sim_trace
from realitygap.kernels.sim.shape import SENSOR_NUMBERS, SimShape
from realitygap.kernels.sim.trial import run_sim_trials
from realitygap.tasks import TraceArrays
from realitygap.trials import REAL, Draws, ResultsRoom, Tried
from realitygap.world import Arena

from ..jyro._trials import SNAP
from ._scene import SimScene, sim_scene
from ._settings import SimSettings


class SimTrials:
    """The platform `sim` in an arena, ready to try networks of one kind; a `PlatformTrials`.

    Args:
        platform: The robot as simulated.
        arena: Arena of the trials.
        rules: NEAT's, of which only the network's kind counts.
        inputs: Names of what networks see, in order.
        noise: The paper's a, on top of the robot's own noise.
        bias_value: Value of the constant input.
    """

    distance_unit = 1.0

    def __init__(
        self,
        platform: SimSettings,
        arena: Arena,
        rules: NeatRules,
        *,
        inputs: Sequence[str],
        noise: float,
        bias_value: float,
    ) -> None:
        self.scene = sim_scene(platform, arena, inputs, noise)
        self.arena = self.scene.arena
        self.n_steps = platform.steps
        self.step_s = platform.command_s
        self.sensors = sensor_names(self.scene.shape)
        self._draws = Draws(self.scene.numbers)
        self.drawn_names = self._draws.names
        self._rules = rules
        self._sim_rules = sim_rules(self.scene, bias_value)
        self._hidden_room = -1
        self._fixed = self.scene.table(self.scene.fixed)
        self._rows = np.array([self.scene.rows[name] for name in self.drawn_names], np.int64)
        self._table = self._fixed
        self._no_trace = self._kept = self._make_trace(-1, 1)

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
        n, dtype = len(which), REAL[self.scene.platform.precision]
        drawn = self._draws.draw(key, counters)
        hidden_room = networks.place.shape[1]
        if hidden_room != self._hidden_room:
            self._hidden_room = hidden_room
            self._room = make_sim_room(self.scene.shape, self._rules, hidden_room, dtype)
        steps = self._trace(n) if trace else self._no_trace
        results = ResultsRoom.of(n, self.arena.grid.n_cells, ends=ends)
        run_sim_trials(
            self.scene.shape,
            self._table_of(drawn),
            self._sim_rules,
            self._rules,
            networks,
            which,
            np.uint64(key),
            counters,
            self._room,
            *results,
            steps,
        )
        batch = results.batch(drawn, self.drawn_names)
        return Tried(batch, results.end_cells, results.ended, _as_arrays(steps), steps.distances)

    def _make_trace(self, n_steps: int, n_kept: int) -> SimTrace:
        dtype = REAL[self.scene.platform.precision]
        trace: SimTrace = make_sim_trace(self.scene.shape, self._rules.n_inputs, n_steps, n_kept, dtype)
        return trace

    def _trace(self, n: int) -> SimTrace:
        """Return memory for every step of n trials, the same as in the previous call with as many trials."""
        if self._kept.stalled.shape != (self.n_steps + 1, n):
            self._kept = self._make_trace(self.n_steps, n)
        return self._kept

    def _table_of(self, drawn: NDArray[np.float64]) -> NDArray[np.floating]:
        """Return the numbers of n trials, (p, n), or (p, 1) if none is sampled; only sampled ones are rewritten."""
        n = len(drawn)
        if not self.drawn_names:
            return self._fixed
        if self._table.shape != (len(self._fixed), n):
            self._table = np.repeat(self._fixed, n, axis=1)
        values = dict(zip(self.drawn_names, drawn.T, strict=True))
        self._table[self._rows] = self.scene.rows_of(values)
        return self._table


def sim_rules(scene: SimScene, bias_value: float) -> SimRules:
    """Return the rules of a trial, in the form that kernels read."""
    platform, grid, start = scene.platform, scene.arena.grid, scene.arena.start
    in_cells = [(start.x - grid.x) / grid.cell, (start.y - grid.y) / grid.cell]
    cells = [round(place) if abs(place - round(place)) < SNAP["double"] else place for place in in_cells]
    return SimRules(
        n_steps=platform.steps,
        step_s=float(platform.command_s),
        clip=platform.noisy_reading == "clip",
        bias_value=float(bias_value),
        grid=np.array([*cells, 1 / grid.cell, SNAP[platform.precision]], REAL[platform.precision]),
    )


def sensor_names(shape: SimShape) -> tuple[str, ...]:
    """Return names of the readings in a trace, in order."""
    counts = zip(SENSOR_NUMBERS, np.diff(shape.first_reading).tolist(), strict=True)
    return tuple(f"{kind}.{k}" for kind, n in counts for k in range(n))


def _as_arrays(trace: SimTrace) -> TraceArrays:
    return TraceArrays(trace.poses, trace.readings, trace.inputs, trace.commands, trace.stalled, trace.wheels)
