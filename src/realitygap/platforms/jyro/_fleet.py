"""Robots of the platform `jyro`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import PAPER_INPUTS
from realitygap.kernels.jyro.fleet import make_fleet, observe_robots, read_robots, start_robots, step_robots
from realitygap.kernels.math.lanes import LANES
from realitygap.trials import NoiseKey, counters_of, poses_of
from realitygap.world import Arena, check_start

from .._fleet import Array, Outline
from ._settings import STEP_S, JyroSettings
from ._trials import jyro_rules, jyro_scene


class JyroFleet:
    """A `Fleet` of the paper's simulation, which sees obstacle, stall, time and single range sensors.

    Raises:
        ValueError: The robot does not fit at the start, or the arena is not of straight walls.
    """

    step_s = STEP_S

    def __init__(
        self, platform: JyroSettings, arena: Arena, inputs: Sequence[str], noise: float, n: int
    ) -> None:
        self._scene = jyro_scene(platform, arena)
        check_start(arena, platform.body)
        self.platform, self.arena, self.n_steps = platform, arena, platform.steps
        self.outline = Outline.of_body(platform.body, platform.sensors)
        self._n, self._inputs = n, tuple(inputs)
        self._rules = jyro_rules(platform, noise=noise, bias_input=False, bias_value=1.0)
        self._fleet = make_fleet(self._scene, n)
        self.cells = np.zeros((n, arena.grid.n_cells), np.uint8)
        self.counts = np.zeros((n, 3), np.int32)
        self._step = 0

    @property
    def stalled(self) -> NDArray[np.bool_]:
        """See `Fleet.stalled`."""
        return _by_robot(self._fleet.stalled[:, None], self._n)[:, 0] > 0

    @property
    def ranges(self) -> Array:
        """See `Fleet.ranges`. Noise is not included."""
        return 1.0 - _by_robot(self._fleet.fractions, self._n)

    def number(self, name: str, value: float) -> Array:
        """See `Fleet.number`. No number is drawn here."""
        return np.full(self._n, float(value))

    def bounds(self) -> NDArray[Any]:
        """See `Fleet.bounds`."""
        noise = self._rules.noise[0] * (not self._rules.clip)
        bounds: NDArray[Any] = np.nextafter(
            [-noise, 1 + noise], [-np.inf, np.inf], dtype=noise.dtype
        )  # sums are rounded
        shares = np.array([0, 1], noise.dtype)
        return np.stack([shares if name in ("stall", "time") else bounds for name in self._inputs], axis=1)

    def start(self, key: NoiseKey) -> None:
        """See `Fleet.start`."""
        self._key = np.uint64(key.key)
        counters = counters_of(key, self._n)
        start_robots(self._scene, self._rules, self._fleet, counters, self.cells, self.counts)
        self._step = 0

    def step(self, commands: Array) -> None:
        """See `Fleet.step`."""
        step_robots(self._scene, self._fleet, commands, self.cells, self.counts)
        self._step += 1

    def observe(self) -> Array:
        """See `Fleet.observe`."""
        if self._inputs == PAPER_INPUTS:
            observations = np.empty((self._n, 3))
            observe_robots(self._rules, self._fleet, self._key, self._step, observations)
            return observations
        readings = np.empty((self._n, len(self.platform.sensors.mounts)))
        read_robots(self._rules, self._fleet, self._key, self._step, readings)
        real = self._rules.noise.dtype.type
        values = {f"range.{k}": column for k, column in enumerate(readings.T)}
        values |= {"obstacle": readings.max(axis=1), "stall": self.stalled.astype(np.float64)}
        values["time"] = np.full(self._n, float(real(self._step) / real(self.n_steps)))
        return np.stack([values[name] for name in self._inputs], axis=1)

    def facts(self) -> dict[str, Array]:
        """See `Fleet.facts`."""
        return {
            "pose": poses_of(_by_robot(self._fleet.poses, self._n), self.arena.start),
            "readings": _by_robot(self._fleet.fractions, self._n) * self.platform.sensor_range,
        }

    def close(self) -> None:
        """See `Fleet.close`. There is nothing to close here."""


def _by_robot(blocks: NDArray[Any], n: int) -> Array:
    """Return numbers of blocks (b, m, LANES) as (n, m)."""
    return np.moveaxis(blocks, 1, 2).reshape(-1, blocks.shape[1])[:n].astype(np.float64)


def noisy_readings(
    platform: JyroSettings,
    arena: Arena,
    fractions: NDArray[np.floating],
    counters: NDArray[np.uint32],
    key: int,
    noise: float,
) -> NDArray[np.float64]:
    """Return what the sensors read in n trials, noise and all.

    Args:
        platform: Settings of the platform.
        arena: Arena of the robots.
        fractions: (t + 1, s, n) distances in units of the sensors' range.
        counters: (n, 3) counters of the random numbers.
        key: Key of the random numbers.
        noise: Level a.

    Returns:
        (t + 1, s, n).
    """
    n_looks, n_sensors, n = fractions.shape
    scene = jyro_scene(platform, arena)
    rules = jyro_rules(platform, noise=noise, bias_input=False, bias_value=1.0)
    fleet = make_fleet(scene, n)
    cells, counts = np.zeros((n, arena.grid.n_cells), np.uint8), np.zeros((n, 3), np.int32)
    start_robots(scene, rules, fleet, counters, cells, counts)
    seen = np.empty((n_looks, n, n_sensors))
    for step in range(n_looks):
        for block in range(len(fleet.fractions)):
            part = fractions[step, :, block * LANES : (block + 1) * LANES]
            fleet.fractions[block, :, : part.shape[1]] = part
        read_robots(rules, fleet, np.uint64(key), step, seen[step])
    return seen.transpose(0, 2, 1)
