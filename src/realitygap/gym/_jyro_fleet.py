"""Robots of the platform `jyro`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels._fleet import make_fleet, observe_robots, start_robots, step_robots
from realitygap.robots import STEP_S, JyroPlatform
from realitygap.trials import NoiseKey, counters_of, jyro_rules, jyro_scene, poses_of
from realitygap.world import Arena, check_start

from ._fleet import Array, Outline


class JyroFleet:
    """A `Fleet` of the paper's simulation, which sees obstacle, stall and time.

    Raises:
        ValueError: The robot does not fit at the start, or the arena is not of straight walls.
    """

    step_s = STEP_S

    def __init__(self, platform: JyroPlatform, arena: Arena, noise: float, n: int) -> None:
        self._scene = jyro_scene(platform, arena)
        check_start(arena, platform.body)
        self.platform, self.arena, self.n_steps = platform, arena, platform.steps
        self.outline = Outline.of_body(platform.body, platform.sensors)
        self._n = n
        self._rules = jyro_rules(platform, noise=noise, bias_input=False, bias_value=1.0)
        self._fleet = make_fleet(self._scene, n)
        self.cells = np.zeros((n, arena.grid.n_cells), np.uint8)
        self.counts = np.zeros((n, 3), np.int32)
        self._step = 0

    @property
    def stalled(self) -> NDArray[np.bool_]:
        """As `Fleet.stalled`."""
        return _by_robot(self._fleet.stalled[:, None], self._n)[:, 0] > 0

    @property
    def ranges(self) -> Array:
        """As `Fleet.ranges`, without noise."""
        return 1.0 - _by_robot(self._fleet.fractions, self._n)

    def number(self, name: str, value: float) -> Array:
        """As `Fleet.number`: nothing is drawn."""
        return np.full(self._n, float(value))

    def bounds(self) -> NDArray[Any]:
        """As `Fleet.bounds`."""
        noise = self._rules.noise[0] * (not self._rules.clip)
        bounds: NDArray[Any] = np.nextafter(
            [-noise, 1 + noise], [-np.inf, np.inf], dtype=noise.dtype
        )  # sums are rounded
        return np.stack([bounds, [0, 1], [0, 1]], axis=1)

    def start(self, key: NoiseKey) -> None:
        """As `Fleet.start`."""
        self._key = np.uint64(key.key)
        counters = counters_of(key, self._n)
        start_robots(self._scene, self._rules, self._fleet, counters, self.cells, self.counts)
        self._step = 0

    def step(self, commands: Array) -> None:
        """As `Fleet.step`."""
        step_robots(self._scene, self._fleet, commands, self.cells, self.counts)
        self._step += 1

    def observe(self) -> Array:
        """As `Fleet.observe`."""
        observations = np.empty((self._n, 3))
        observe_robots(self._rules, self._fleet, self._key, self._step, observations)
        return observations

    def facts(self) -> dict[str, Array]:
        """As `Fleet.facts`."""
        return {
            "pose": poses_of(_by_robot(self._fleet.poses, self._n), self.arena.start),
            "readings": _by_robot(self._fleet.fractions, self._n) * self.platform.sensor_range,
        }

    def close(self) -> None:
        """As `Fleet.close`: nothing is held."""


def _by_robot(blocks: NDArray[Any], n: int) -> Array:
    """(b, m, LANES) numbers of blocks as (n, m)."""
    return np.moveaxis(blocks, 1, 2).reshape(-1, blocks.shape[1])[:n].astype(np.float64)
