"""Robots of the platform `sim`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import NeatSettings
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.sim.lanes import make_sim_room
from realitygap.kernels.sim.trial import observe, start_sim, step_sim
from realitygap.trials import REAL, Draws, NoiseKey, counters_of, poses_of
from realitygap.world import Arena, check_drawn_starts

from .._fleet import Array, Outline, is_signed
from ._scene import sim_scene
from ._settings import SimSettings
from ._trials import sim_rules


class SimFleet:
    """A `Fleet` of a robot of a file, `LANES` robots in each call of the kernels.

    Raises:
        ValueError: The robot or the arena lacks an input, or the robot does not fit at the start.
    """

    def __init__(
        self, platform: SimSettings, arena: Arena, inputs: Sequence[str], noise: float, n: int
    ) -> None:
        self._scene = sim_scene(platform, arena, inputs, noise)
        check_drawn_starts(self._scene.arena, self._scene.robot)
        self.arena, self.n_steps = self._scene.arena, platform.steps
        self.step_s = platform.command_s
        self.outline = Outline.of_model(self._scene.robot)
        self._inputs = tuple(inputs)
        self._clip = platform.noisy_reading == "clip"
        self._n, self._n_range = n, len(self._scene.robot.range)
        self._rules = sim_rules(self._scene, 1.0)
        self._draws = Draws(self._scene.numbers)
        self._drawn: dict[str, Array] = {}
        real = REAL[platform.precision]
        # Networks are not asked here: of one without hidden nodes only the inputs are needed.
        neat = NeatSettings.named("default").rules(len(inputs), 2)
        self._blocks = [slice(first, min(first + LANES, n)) for first in range(0, n, LANES)]
        self._rooms = [make_sim_room(self._scene.shape, neat, 1, real) for _ in self._blocks]
        self._commands = np.zeros((2, LANES), real)
        self.cells = np.zeros((n, arena.grid.n_cells), np.uint8)
        self._step = 0

    @property
    def counts(self) -> NDArray[np.int32]:
        """See `Fleet.counts`."""
        line = self._gathered([room.lanes.n_line[None] for room in self._rooms])
        ends = self._gathered([np.bitwise_count(room.lanes.ends) for room in self._rooms])
        return np.stack([line[:, 0], ends.sum(axis=1)], axis=1).astype(np.int32)

    @property
    def stalled(self) -> NDArray[np.bool_]:
        """See `Fleet.stalled`."""
        return self._gathered([room.lanes.stalled[None] for room in self._rooms])[:, 0] > 0

    @property
    def ranges(self) -> Array:
        """See `Fleet.ranges`. Noise is included."""
        return self._gathered([room.lanes.readings[: self._n_range] for room in self._rooms])

    def number(self, name: str, value: float) -> Array:
        """See `Fleet.number`."""
        return self._drawn[name] if name in self._drawn else np.full(self._n, float(value))

    def bounds(self) -> NDArray[Any]:
        """See `Fleet.bounds`. A linear response with its offset has no limits unless the platform clips it."""
        linear = [not self._clip and sensor.response == "linear" for sensor in self._scene.robot.range]
        bounds = []
        for name in self._inputs:
            kind, _, index = name.partition(".")
            is_open = any(linear) if kind == "obstacle" else kind == "range" and linear[int(index)]
            low = -math.inf if is_open else -1.0 if is_signed(name) else 0.0
            bounds.append((low, math.inf if is_open else 1.0))
        return np.array(bounds).T

    def start(self, key: NoiseKey) -> None:
        """See `Fleet.start`."""
        self._key, self._step = np.uint64(key.key), 0
        counters = counters_of(key, self._n)
        drawn = self._draws.draw(key.key, counters)
        self._drawn = dict(zip(self._draws.names, drawn.T, strict=True))
        shape = self._scene.shape
        for block, room in zip(self._blocks, self._rooms, strict=True):
            values = {name: numbers[block] for name, numbers in self._drawn.items()}
            table = self._scene.table({**self._scene.fixed, **values})
            n = block.stop - block.start
            start_sim(shape, table, self._rules, self._key, counters[block], n, room, self.cells[block])

    def step(self, commands: Array) -> None:
        """See `Fleet.step`."""
        commands = np.clip(commands, -1.0, 1.0)
        for block, room in zip(self._blocks, self._rooms, strict=True):
            n = block.stop - block.start
            self._commands[:, :n] = commands[block].T
            step_sim(
                self._scene.shape, self._rules, self._key, n, room, self.cells[block], self._step, self._commands
            )  # fmt: skip
        self._step += 1

    def observe(self) -> Array:
        """See `Fleet.observe`."""
        for room in self._rooms:
            observe(self._scene.shape, self._rules, room.lanes, self._step)
        return self._gathered([room.lanes.values[: len(self._inputs)] for room in self._rooms])

    def facts(self) -> dict[str, Array]:
        """See `Fleet.facts`."""
        poses = [np.stack(room.lanes.pose[:3]) for room in self._rooms]
        near = [room.lanes.senses.near[: self._n_range] for room in self._rooms]
        return {"pose": poses_of(self._gathered(poses), self.arena.start), "readings": self._gathered(near)}

    def close(self) -> None:
        """See `Fleet.close`. There is nothing to close here."""

    def _gathered(self, blocks: list[NDArray[Any]]) -> Array:
        """Return numbers of each block, (m, LANES), as (n, m)."""
        return np.concatenate(blocks, axis=1)[:, : self._n].T.astype(np.float64)
