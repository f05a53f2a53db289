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

from ._env import RENDER_FPS, Array, RenderMode, checked_render_mode, fps_of
from ._robots import GivenController, GivenPlatform, RealType, Robots, maze_robots, task_robots


class _ManyRobots(VectorEnv[Array, Array, NDArray[Any]]):
    """n robots, each alone in a separate arena.

    Robot k draws the random numbers of individual `noise_key.individual` + k, as `try_genomes` does. All trials have
    the same number of steps and end together; the step after it, whatever its actions, begins new ones with a new key
    (Gymnasium's autoreset mode "next step").
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - as Gymnasium declares it
        "render_modes": ["rgb_array"],
        "render_fps": RENDER_FPS,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(self, robots: Robots, render_mode: RenderMode) -> None:
        self._robots = robots
        self.num_envs = robots.n
        self.render_mode = checked_render_mode(render_mode)
        if render_mode is not None:
            robots.keep_paths()
        self.metadata = {**self.metadata, "render_fps": fps_of(robots)}
        self.single_observation_space = robots.observation_space()
        self.single_action_space = robots.action_space()
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    @property
    def noise_key(self) -> NoiseKey:
        """Key of the random numbers of robot 0. Robot k has those of the individual k numbers later."""
        return self._robots.noise_key

    def visited_cells(self, k: int) -> tuple[int, ...]:
        """Return cells that robot k visited along its line, in order of first visit, columns * row + column."""
        return self._robots.cells(k)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin all trials; arguments as of `RobotEnv.reset`. Returns (n, i) observations and info."""
        super().reset(seed=seed)
        return self._robots.start(options, self.np_random), self._info()

    def step(self, actions: Array) -> tuple[Array, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Drive one command of each robot, (n, 2); after the last step, start the next trials instead.

        Returns:
            (n, i) observations, (n,) rewards, terminations, truncations, and info, whose arrays have a row a robot.

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

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Return a picture (h, w, 3) of each robot; None without a render mode."""
        if self.render_mode is None:
            return None
        return tuple(self._robots.picture(k) for k in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        """Let go of the robots, if it got any: Gymnasium 1.1 closes one that was never made."""
        if hasattr(self, "_robots"):
            self._robots.close()

    def _info(self) -> dict[str, Any]:
        """Return each array with a second one that marks the robots with a value, which are all of them."""
        facts = self._robots.facts()
        return {**facts, **{f"_{name}": np.ones(self.num_envs, np.bool_) for name in facts}}


class RobotVectorEnv(_ManyRobots):
    """`RobotEnv` n times, each robot alone in its own arena, in one call a step.

    Robot k draws the random numbers of individual `noise_key.individual` + k, as `try_genomes` does. All trials have
    the same number of steps and end together; the step after it, whatever its actions, begins new ones with a new key
    (Gymnasium's autoreset mode "next step").

    Args:
        num_envs: Number of robots, >= 1.
        kind, task, controller, noise, platform, arena, dtype, render_mode: Arguments of `RobotEnv`.

    Raises:
        TypeError: Something else than such settings.
        ValueError: A setting out of range, an unknown one, or a start at which the robot does not fit.
        TaskError: The arena lacks what the task needs.
    """

    def __init__(
        self,
        num_envs: int = 1,
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
            num_envs,
            kind,
            task=task,
            controller=controller,
            noise=noise,
            platform=platform,
            arena=arena,
            dtype=dtype,
        )
        super().__init__(robots, render_mode)


class MazeVectorEnv(_ManyRobots):
    """`MazeEnv` n times, each agent alone in a separate maze, in one call a step.

    Args:
        num_envs: Number of agents, >= 1.
        maze, dtype, render_mode: Arguments of `MazeEnv`.

    Raises:
        ValueError: There is no such maze.
    """

    def __init__(
        self,
        num_envs: int = 1,
        maze: str = "maze-medium",
        *,
        dtype: RealType = "float32",
        render_mode: RenderMode = None,
    ) -> None:
        super().__init__(maze_robots(num_envs, maze, dtype), render_mode)
