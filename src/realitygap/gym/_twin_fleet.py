"""Robots of the platform `twin`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import ControllerError
from realitygap.evolution import ControllerInterface, inputs_of_ranges
from realitygap.robots import TwinPlatform
from realitygap.trials import NoiseKey, TwinRobots, cell_at
from realitygap.world import Arena, check_start

from ._fleet import Array, Outline, limited


class TwinFleet:
    """A `Fleet` of a twin, which sees obstacle, stall, time and single range sensors; it lives in a separate process.

    Raises:
        ControllerError: The twin does not have such inputs.
        ValueError: The robot does not fit at the start.
        RealityGapError: The twin cannot be opened.
    """

    def __init__(self, platform: TwinPlatform, arena: Arena, inputs: tuple[str, ...], n: int) -> None:
        check_start(arena, platform.body)
        interface = ControllerInterface(inputs)
        self._sense = interface.bind(platform.steps)
        self._n_inputs = len(inputs)
        self.arena, self.n_steps = arena, platform.steps
        self.outline = Outline.of_body(platform.body, platform.sensors)
        self._reach = platform.sensors.max_range
        self._n = n
        self._robots = TwinRobots(platform, arena, n)
        try:
            interface.check(
                inputs_of_ranges(self._robots.n_sensors), "The environment", f"twin {platform.file}"
            )
        except ControllerError:
            self._robots.close()
            raise
        self.step_s = self._robots.step_s
        self.cells = np.zeros((n, arena.grid.n_cells), np.uint8)
        self.counts = np.zeros((n, 2), np.int32)

    @property
    def stalled(self) -> NDArray[np.bool_]:
        """As `Fleet.stalled`."""
        return self._robots.stalled

    @property
    def ranges(self) -> Array:
        """As `Fleet.ranges`, noise included."""
        return self._robots.readings

    def number(self, name: str, value: float) -> Array:
        """As `Fleet.number`: nothing is drawn that is known."""
        return np.full(self._n, float(value))

    def bounds(self) -> NDArray[Any]:
        """As `Fleet.bounds`."""
        return np.array([[0.0] * self._n_inputs, [1.0] * self._n_inputs])

    def start(self, key: NoiseKey) -> None:
        """As `Fleet.start`."""
        self._step = 0
        self._ends: list[set[int]] = [set() for _ in range(self._n)]
        self._robots.begin(key)
        self._count()

    def step(self, commands: Array) -> None:
        """As `Fleet.step`."""
        self._robots.drive(limited(commands))
        self._step += 1
        self._count()

    def _count(self) -> None:
        for k, (cells, (x, y, _)) in enumerate(zip(self._robots.cells, self._robots.poses, strict=True)):
            self.cells[k, : len(cells)] = cells
            end = cell_at(self.arena.grid, x, y)
            self._ends[k] |= set() if end is None else {end}
            self.counts[k] = len(cells), len(self._ends[k])

    def observe(self) -> Array:
        """As `Fleet.observe`."""
        seen = zip(self.ranges.tolist(), self.stalled.tolist(), strict=True)
        return np.array([self._sense(readings, stalled, self._step) for readings, stalled in seen])

    def facts(self) -> dict[str, Array]:
        """As `Fleet.facts`; distances are what readings tell of them."""
        return {"pose": self._robots.poses.copy(), "readings": self._reach * (1.0 - self.ranges)}

    def close(self) -> None:
        """As `Fleet.close`."""
        self._robots.close()
