"""A Gymnasium environment with one robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import gymnasium
import numpy as np
from numpy.typing import NDArray

from realitygap.trials import NoiseKey
from realitygap.world import ArenaSettings

from ._robots import GivenController, GivenPlatform, RealType, Robots, maze_robots, task_robots

Array = NDArray[np.floating]
RenderMode = Literal["rgb_array"] | None
RENDER_FPS = 10


class _OneRobot(gymnasium.Env[Array, Array]):
    """An environment with one robot."""

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": RENDER_FPS}  # noqa: RUF012 - as Gymnasium declares it

    def __init__(self, robots: Robots, render_mode: RenderMode) -> None:
        self._robots = robots
        self.render_mode = checked_render_mode(render_mode)
        if render_mode is not None:
            robots.keep_paths()
        self.metadata = {**self.metadata, "render_fps": fps_of(robots)}
        self.observation_space = robots.observation_space()
        self.action_space = robots.action_space()

    @property
    def noise_key(self) -> NoiseKey:
        """Key of the trial's random numbers; `trace_genome` with it gives the same trial."""
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
            seed: Seed of the keys of this trial and of all later trials.
            options: `noise_key`: the `NoiseKey` of this trial instead of a new one.

        Raises:
            ValueError: An unknown option, or a key whose numbers would repeat.
        """
        super().reset(seed=seed)
        observations = self._robots.start(options, self.np_random)
        return observations[0], self._info()

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Drive one command, (2,).

        Raises:
            ResetNeeded: No trial is under way.
            ValueError: Another shape, or a number that is infinite or NaN. The robot does not move.
        """
        given = np.asarray(action, np.float64)
        if given.shape != (2,):
            raise ValueError(f"action has shape {given.shape}, expected (2,).")
        observations, rewards = self._robots.drive(given[None])
        return observations[0], float(rewards[0]), False, self._robots.is_over, self._info()

    def render(self) -> NDArray[np.uint8] | None:
        """Return the arena with the robot, its path and its rays, (h, w, 3); None without a render mode."""
        return None if self.render_mode is None else self._robots.picture(0)

    def close(self) -> None:
        """Let go of the robot; safe to call twice, and `reset` takes it again."""
        self._robots.close()

    def _info(self) -> dict[str, Any]:
        facts = self._robots.facts()
        return {name: values[0] if values.ndim > 1 else float(values[0]) for name, values in facts.items()}


class RobotEnv(_OneRobot):
    """One robot at a task, one step at a time.

    | kind | reward of a step; the rewards of a trial add up to the task's fitness |
    |---|---|
    | coverage | share of the reachable cells visited for the first time; the start's cell is visited by then |
    | avoid | Floreano & Mondada's product after the step, divided by the number of steps |
    | light, goal | what the trial so far is worth, less what it was worth before the step |
    | wall | how far the step went along walls on the task's side [m] |

    | action | minimum | maximum | unit |
    |---|---|---|---|
    | move | -1 | 1 | 1: 0.1 m in a step, forward; on `sim` and twins the robot's full speed |
    | turn | -1 | 1 | 1: `platform.turn_per_step` in a step, to the left; on `sim` and twins both wheels at full speed |

    With `outputs` left and right, an action is the speeds of two wheels, each -1 to 1: move = (left + right) / 2, turn
    = (right - left) / 2.

    Observations are the inputs of the task's networks without the constant one. On `jyro` and twins these are obstacle
    (largest noisy reading), stall and time for every task, unless `controller` names others. A trial is truncated after
    `platform.steps` steps and never terminated. Actions beyond -1..1 are limited to it, as in a trial. An infinite or
    NaN action is an error.

    `info` has `pose` (3,) x [m], y [m], heading [rad, counter-clockwise from +x], `readings` (s,) [m] without noise (on
    a twin, distances that noisy readings tell), `coverage_line` and `coverage_ends` [0..1].

    Readings lie in 0..1, but on `jyro` noise adds to them, and those of a linear response on `sim` that is not clipped
    have no limits.

    Args:
        kind: coverage, avoid, light, wall or goal.
        task: Settings of the task, as `[task]` of a study has them: `{"cells": "ends"}`, `{"side": "left"}`.
        controller: Inputs and outputs, in the form of `[controller]` of a study: `{"inputs": ["range.0", "time"],
            "outputs": ["left", "right"]}`. By default, actions are move and turn.
        noise: Level a: each reading is moved by a * U(-1, 1); 0 to 10. 0.1 on `jyro` and none elsewhere when not given.
        platform: The robot: `jyro`, `sim`, `sim:FILE` or `twin:FILE`, a platform, or settings of the default one. That
            is `jyro` for coverage, and for other tasks the Khepera on `sim` of the study of that name.
        arena: Arena, or its settings. Default: the paper's for coverage, otherwise that of the study of the same name.
        dtype: Type of observations and actions. With float64 and a platform of double precision, a network in the
            environment gives the same trial, bit for bit.
        render_mode: None or rgb_array.

    Raises:
        TypeError: Something else than such settings.
        ValueError: A setting out of range, an unknown one, or a start at which the robot does not fit.
        TaskError: The arena lacks what the task needs.
    """

    def __init__(
        self,
        kind: str = "coverage",
        *,
        task: Mapping[str, Any] | None = None,
        controller: GivenController = None,
        noise: float | None = None,
        platform: GivenPlatform = None,
        arena: ArenaSettings | Mapping[str, Any] | None = None,
        dtype: RealType = "float32",
        render_mode: RenderMode = None,
    ) -> None:
        robots = task_robots(
            1,
            kind,
            task=task,
            controller=controller,
            noise=noise,
            platform=platform,
            arena=arena,
            dtype=dtype,
        )
        super().__init__(robots, render_mode)


class MazeEnv(_OneRobot):
    """The agent of Lehman & Stanley (2011) in one of their mazes.

    Observations are its six range finders, 0..1 with 1 for nothing within reach, and four pie slices, 1 if the exit is
    in that quarter. Actions are how its turning and its speed change, each -1..1. The reward is how much nearer to the
    exit a step came [m], the straight distance. A trial is truncated after 400 steps and never terminated; an agent at
    the exit stays there, and `info` has `arrived` 1. Nothing is random.

    Args:
        maze: maze-medium or maze-hard.
        dtype: Type of observations and actions.
        render_mode: None or rgb_array.

    Raises:
        ValueError: There is no such maze.
    """

    def __init__(
        self, maze: str = "maze-medium", *, dtype: RealType = "float32", render_mode: RenderMode = None
    ) -> None:
        super().__init__(maze_robots(1, maze, dtype), render_mode)


def checked_render_mode(mode: str | None) -> Any:
    """Return the mode.

    Raises:
        ValueError: There is no such mode.
    """
    if mode not in (None, "rgb_array"):
        raise ValueError(f"render_mode is {mode!r}, expected None or 'rgb_array'.")
    return mode


def fps_of(robots: Robots) -> int:
    """Return pictures per second at which a trial is shown as fast as it is."""
    return max(1, round(1 / robots.step_s))
