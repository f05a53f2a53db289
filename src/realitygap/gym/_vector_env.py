"""Many robots for Gymnasium, all moved by one call of a kernel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from realitygap.trials import NoiseKey
from realitygap.world import ArenaSettings

from ._robots import Cells, Platform, Robots

Array = NDArray[np.float64]


class ScribblerCoverageVectorEnv(VectorEnv[Array, Array, NDArray[Any]]):
    """n robots, each alone in an arena of its own: `ScribblerCoverageEnv` n times, in one call a step.

    Robot k draws the random numbers of individual `noise_key.individual` + k, as `try_genomes` does. All trials have
    the same number of steps and end together; the step after it, whatever its actions, begins new ones with a new key
    (Gymnasium's autoreset mode "next step").

    Args:
        num_envs: How many, >= 1.
        noise, platform, arena, cells: As of `ScribblerCoverageEnv`.

    Raises:
        TypeError: Something else than such settings.
        ValueError: A setting out of range, an unknown one, or a start at which the robot does not fit.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 - as Gymnasium declares it

    def __init__(
        self,
        num_envs: int = 1,
        *,
        noise: float | None = None,
        platform: Platform = None,
        arena: ArenaSettings | Mapping[str, Any] | None = None,
        cells: Cells = "line",
    ) -> None:
        self._robots = Robots(num_envs, noise=noise, platform=platform, arena=arena, cells=cells)
        self.num_envs = num_envs
        self.single_observation_space = self._robots.observation_space()
        self.single_action_space = self._robots.action_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    @property
    def noise_key(self) -> NoiseKey:
        """Which random numbers robot 0 draws; robot k those of the individual k places on."""
        return self._robots.noise_key

    def visited_cells(self, k: int) -> tuple[int, ...]:
        """Cells that robot k visited along its line, in order of first visit, columns * row + column."""
        return self._robots.cells(k)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin all trials; arguments as of `ScribblerCoverageEnv.reset`. Returns (n, 3) observations and info."""
        super().reset(seed=seed)
        return self._robots.start(options, self.np_random), self._info()

    def step(self, actions: Array) -> tuple[Array, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Carry out one command of each robot, (n, 2) move and turn; after the last step, begin anew.

        Returns:
            (n, 3) observations, (n,) rewards, terminations, truncations, and info, whose arrays have a row a robot.

        Raises:
            ResetNeeded: `reset` was never called.
            ValueError: Another shape.
        """
        if self._robots.is_over:
            observations, rewards = self._robots.start(None, self.np_random), np.zeros(self.num_envs)
        else:
            observations, rewards = self._robots.drive(actions)
        over = np.full(self.num_envs, self._robots.is_over)
        return observations, rewards, np.zeros(self.num_envs, np.bool_), over, self._info()

    def _info(self) -> dict[str, Any]:
        """Each array with another that says which robots it is of: all."""
        facts = self._robots.facts()
        return {**facts, **{f"_{name}": np.ones(self.num_envs, np.bool_) for name in facts}}
