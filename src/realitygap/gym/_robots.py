"""n robots that take a command each, step by step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, TypeVar

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike, NDArray

from realitygap.errors import did_you_mean, real_number, whole_number
from realitygap.kernels._philox import MAX_INDIVIDUALS
from realitygap.robots import JyroPlatform, SimPlatform
from realitygap.trials import NoiseKey
from realitygap.world import ArenaSettings

from ._fleet import Fleet
from ._jyro_fleet import JyroFleet
from ._sim_fleet import SimFleet

Cells = Literal["line", "ends"]
Platform = JyroPlatform | SimPlatform | str | Mapping[str, Any] | None
T = TypeVar("T")

PAPERS_NOISE = 0.1
"""The paper's a on `jyro`, whose sensors are without noise otherwise."""


class Robots:
    """n robots of one platform in one arena, all at the same step of their trials.

    Args:
        n: How many, >= 1.
        noise: Level a: each reading is moved by a * U(-1, 1); 0 to 10. 0.1 on `jyro` and none on `sim` when None.
        platform: The robot as simulated: `jyro`, `sim` or `sim:FILE`, or settings; the paper's when not given.
        arena: Where, or its settings; the paper's when not given.
        cells: What rewards count: cells along the line driven, or those in which steps end.

    Raises:
        TypeError: Something else than such settings.
        ValueError: A setting out of range, an unknown one, or a start at which the robot does not fit.
    """

    def __init__(
        self,
        n: int,
        *,
        noise: float | None,
        platform: Platform,
        arena: ArenaSettings | Mapping[str, Any] | None,
        cells: Cells,
    ) -> None:
        self.platform = _platform(platform)
        if noise is None:
            noise = PAPERS_NOISE if isinstance(self.platform, JyroPlatform) else 0.0
        noise = real_number("noise", noise, 0, 10)
        if cells not in ("line", "ends"):
            raise ValueError(f"cells is {cells!r}, expected 'line' or 'ends'.")
        self.n = whole_number("num_envs", n, 1, MAX_INDIVIDUALS)
        place = _made("arena", ArenaSettings, arena).arena()
        self._fleet: Fleet
        if isinstance(self.platform, SimPlatform):
            self._fleet = SimFleet(self.platform, place, noise, self.n)
        else:
            self._fleet = JyroFleet(self.platform, place, noise, self.n)
        self.arena = self._fleet.arena
        self._column = 0 if cells == "line" else 1
        self._step: int | None = None
        self.noise_key = NoiseKey(0)

    @property
    def is_over(self) -> bool:
        """Whether all steps are done."""
        return self._step == self.platform.steps

    def observation_space(self) -> Any:
        """The Box of what one robot's controller sees: obstacle (largest noisy reading), stall, time."""
        low, high = self._fleet.bounds()
        return spaces.Box(np.array([low, 0.0, 0.0]), np.array([high, 1.0, 1.0]), dtype=np.float64)

    def action_space(self) -> Any:
        """The Box of what it answers: move and turn."""
        return spaces.Box(-1.0, 1.0, (2,), np.float64)

    def start(self, options: Mapping[str, Any] | None, np_random: np.random.Generator) -> NDArray[np.float64]:
        """Put all robots at the start; returns (n, 3) observations.

        Args:
            options: `noise_key`: which random numbers; robot k draws those of individual `noise_key.individual` + k.
            np_random: A key is drawn from it when none is given.

        Raises:
            TypeError: The key is none.
            ValueError: An unknown option, or a key whose numbers would repeat.
        """
        options = options or {}
        for name in options.keys() - {"noise_key"}:
            raise ValueError(f"Unknown option {name!r}. {did_you_mean(name, ['noise_key'])}")
        given = options.get("noise_key")
        if given is None:
            given = NoiseKey(int(np_random.integers(1 << 64, dtype=np.uint64)))
        key = _made("noise_key", NoiseKey, given)
        if key.individual + self.n > MAX_INDIVIDUALS:
            raise ValueError(
                f"noise_key.individual is {key.individual} for {self.n} robots, expected at most "
                f"{MAX_INDIVIDUALS - self.n}: beyond it numbers would repeat."
            )
        self.noise_key = key
        self._fleet.start(key)
        self._step = 0
        return self._fleet.observe()

    def drive(self, commands: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Carry out one command of each robot.

        Args:
            commands: (n, 2) move and turn; limited to -1..1, and 0 where they are no number, as in a trial.

        Returns:
            (n, 3) observations, and (n,) the share of the reachable cells that each robot visited for the first time.

        Raises:
            ResetNeeded: No trial is under way.
            ValueError: Another shape.
        """
        if self._step is None or self.is_over:
            raise ResetNeeded("No trial is under way: call reset() first, and again when all steps are done.")
        given = np.ascontiguousarray(commands, np.float64)
        if given.shape != (self.n, 2):
            raise ValueError(f"actions has shape {given.shape}, expected ({self.n}, 2): move and turn.")
        before = self._fleet.counts[:, self._column].copy()
        self._fleet.step(given)
        self._step += 1
        visited = self._fleet.counts[:, self._column] - before
        return self._fleet.observe(), visited / self.arena.grid.n_cells

    def facts(self) -> dict[str, NDArray[np.float64]]:
        """What is so, whatever the controller sees: pose (n, 3), readings (n, s), both coverages (n,)."""
        counts = self._fleet.counts / self.arena.grid.n_cells
        return {**self._fleet.facts(), "coverage_line": counts[:, 0], "coverage_ends": counts[:, 1]}

    def cells(self, k: int) -> tuple[int, ...]:
        """The cells that robot k visited along its line, in order of first visit, columns * row + column."""
        return tuple(self._fleet.cells[k, : self._fleet.counts[k, 0]].tolist())


def _platform(given: Platform) -> JyroPlatform | SimPlatform:
    """The platform that was given, or that a name stands for; settings without a name are those of `jyro`."""
    if isinstance(given, SimPlatform):
        return given
    if not isinstance(given, str):
        return _made("platform", JyroPlatform, given)
    name, colon, file = given.partition(":")
    if name == "sim" and bool(colon) == bool(file):
        return SimPlatform(**({"robot": file} if file else {}))
    if given == "jyro":
        return JyroPlatform()
    raise ValueError(f"platform is {given!r}. {did_you_mean(given, ['jyro', 'sim', 'sim:FILE'])}")


def _made(name: str, kind: type[T], given: T | Mapping[str, Any] | None) -> T:
    """What was given, made of its settings where it is a mapping."""
    if isinstance(given, kind):
        return given
    if not isinstance(given, Mapping | None):
        raise TypeError(f"{name} is {given!r}, expected {kind.__name__}, or a mapping of what it is made of.")
    return kind(**(given or {}))
