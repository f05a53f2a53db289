"""One robot for Gymnasium."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from realitygap.trials import NoiseKey
from realitygap.world import ArenaSettings

from ._robots import Cells, Platform, Robots

Array = NDArray[np.float64]


class ScribblerCoverageEnv(gymnasium.Env[Array, Array]):
    """Visit as many cells of the arena as possible: the task of Rosenzweig & Remy, one robot and step at a time.

    | observation | least | most | unit |
    |---|---|---|---|
    | obstacle: largest of the noisy readings | -noise | 1 + noise | 1: touching, 0: nothing within range |
    | stall: whether a wall blocked the last step | 0 | 1 | |
    | time: step / steps | 0 | 1 | |

    | action | least | most | unit |
    |---|---|---|---|
    | move | -1 | 1 | 1: 0.1 m in a step, forward; on `sim` the robot's full speed |
    | turn | -1 | 1 | 1: `platform.turn_per_step` in a step, to the left; on `sim` both wheels at full speed |

    The reward of a step is the share of the reachable cells that it visits for the first time. The cell of the start
    is visited by then, so that the rewards of a trial add up to its coverage less that cell. A trial is truncated after
    `platform.steps` steps and never terminated. Actions beyond -1..1 are limited to it, and what is no number counts as
    0, as in a trial.

    `info` has `pose` (3,) x [m], y [m], heading [rad, counter-clockwise from +x], `readings` (s,) [m] without noise,
    `coverage_line` and `coverage_ends` [0..1].

    On `sim` readings lie in 0..1, but for those of a linear response that is not clipped, which have no limits.

    Version 0: the first one.

    Args:
        noise: Level a: each reading is moved by a * U(-1, 1); 0 to 10. 0.1 on `jyro` and none on `sim`, whose robot has
            noise of its own, when not given.
        platform: The robot as simulated: `jyro`, `sim` or `sim:FILE`, a `SimPlatform`, or settings of `jyro`; the
            paper's when not given.
        arena: Where, or its settings; the paper's when not given.
        cells: What rewards count: cells along the line driven, or those in which steps end.

    Raises:
        TypeError: Something else than such settings.
        ValueError: A setting out of range, an unknown one, or a start at which the robot does not fit.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium declares it

    def __init__(
        self,
        *,
        noise: float | None = None,
        platform: Platform = None,
        arena: ArenaSettings | Mapping[str, Any] | None = None,
        cells: Cells = "line",
    ) -> None:
        self._robots = Robots(1, noise=noise, platform=platform, arena=arena, cells=cells)
        self.observation_space = self._robots.observation_space()
        self.action_space = self._robots.action_space()

    @property
    def noise_key(self) -> NoiseKey:
        """Which random numbers the trial draws; `trace_genome` with it gives the same trial."""
        return self._robots.noise_key

    @property
    def visited_cells(self) -> tuple[int, ...]:
        """Cells visited along the line, in order of first visit, columns * row + column."""
        return self._robots.cells(0)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin a trial.

        Args:
            seed: Of the keys of this trial's and all later trials' random numbers.
            options: `noise_key`: the `NoiseKey` of this trial in place of a new one.

        Raises:
            ValueError: An unknown option, or a key whose numbers would repeat.
        """
        super().reset(seed=seed)
        observations = self._robots.start(options, self.np_random)
        return observations[0], self._info()

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Carry out one command, (2,) move and turn.

        Raises:
            ResetNeeded: No trial is under way.
            ValueError: Another shape.
        """
        given = np.asarray(action, np.float64)
        if given.shape != (2,):
            raise ValueError(f"action has shape {given.shape}, expected (2,): move and turn.")
        observations, rewards = self._robots.drive(given[None])
        return observations[0], float(rewards[0]), False, self._robots.is_over, self._info()

    def _info(self) -> dict[str, Any]:
        facts = self._robots.facts()
        return {name: values[0] if values.ndim > 1 else float(values[0]) for name, values in facts.items()}
