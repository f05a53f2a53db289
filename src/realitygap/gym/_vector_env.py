"""Many robots for Gymnasium, all moved by one call of a kernel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from realitygap.errors import whole_number
from realitygap.trials import NoiseKey
from realitygap.world import ArenaSettings

from ._env import RENDER_FPS, Array, RenderMode, checked_render_mode, fps_of
from ._robots import GivenController, GivenPlatform, RealType, Robots, maze_robots, task_robots


class _ManyRobots(VectorEnv[Array, Array, NDArray[Any]]):
    """n robots, each alone in a separate arena. All trials have the same number of steps and end together.

    Robot k draws the random numbers of individual `noise_key.individual` + k, as `try_genomes` does.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - as Gymnasium declares it
        "render_modes": ["rgb_array"],
        "render_fps": RENDER_FPS,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        robots: Robots,
        render_mode: RenderMode,
        autoreset_mode: AutoresetMode | str,
        max_episode_steps: int | None,
    ) -> None:
        self._robots = robots
        self.num_envs = robots.n
        self.render_mode = checked_render_mode(render_mode)
        if render_mode is not None:
            robots.keep_paths()
        self._autoreset = _autoreset_mode(autoreset_mode)
        # Gymnasium's own time limit takes -1 as none.
        self._limit = (
            None
            if max_episode_steps in (None, -1)
            else whole_number("max_episode_steps", max_episode_steps, 1)
        )
        self.metadata = {
            **self.metadata,
            "render_fps": fps_of(robots),
            "autoreset_mode": self._autoreset,
        }
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
        """Begin all trials.

        Args:
            seed: Seed of the keys of these trials and of all later trials.
            options: `noise_key`, as of `RobotEnv.reset`. `reset_mask`: (n,) Booleans, all True, because all trials
                begin together.

        Returns:
            (n, i) observations and info.

        Raises:
            TypeError: The mask is not an array of Booleans.
            ValueError: An unknown option, a key whose numbers would repeat, or a mask that leaves robots out.
        """
        options = dict(options or {})
        if "reset_mask" in options:
            _check_mask(options.pop("reset_mask"), self.num_envs)
        super().reset(seed=seed)
        return self._robots.start(options, self.np_random), self._info()

    def step(self, actions: Array) -> tuple[Array, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Drive one command of each robot, (n, 2). After the end of trials, mode NEXT_STEP starts new ones instead.

        Returns:
            (n, i) observations, (n,) rewards, terminations, truncations, and info, whose arrays have a row a robot. At
            the end of trials in mode SAME_STEP, the observations are the first ones of the next trials. Info then has
            the last ones as `final_obs`, and its own last values as `final_info`.

        Raises:
            ResetNeeded: `reset` was never called, or the trials have ended in mode DISABLED.
            ValueError: Another shape, or a number that is infinite or NaN. No robot moves.
        """
        if self._is_over and self._autoreset is AutoresetMode.DISABLED:
            raise ResetNeeded("All trials have ended: call reset(), because autoreset_mode is DISABLED.")
        if self._is_over:
            observations, rewards = self._robots.start(None, self.np_random), np.zeros(self.num_envs)
        else:
            observations, rewards = self._robots.drive(actions)
        over = np.full(self.num_envs, self._is_over)
        info = self._info()
        if self._is_over and self._autoreset is AutoresetMode.SAME_STEP:
            final_obs = np.empty(self.num_envs, object)  # Gymnasium wants an array of arrays
            for k, row in enumerate(observations):
                final_obs[k] = row
            final = self._marked({"final_obs": final_obs, "final_info": info})
            observations = self._robots.start(None, self.np_random)
            info = {**self._info(), **final}
        return observations, rewards, np.zeros(self.num_envs, np.bool_), over, info

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Return a picture (h, w, 3) of each robot; None without a render mode."""
        if self.render_mode is None:
            return None
        return tuple(self._robots.picture(k) for k in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        """Let go of the robots, if it got any: Gymnasium 1.1 closes one that was never made."""
        if hasattr(self, "_robots"):
            self._robots.close()

    @property
    def _is_over(self) -> bool:
        """True if the trials have ended."""
        return self._robots.is_over or self._robots.n_driven == self._limit

    def _info(self) -> dict[str, Any]:
        return self._marked(self._robots.facts())

    def _marked(self, values: dict[str, Any]) -> dict[str, Any]:
        """Return each value with an array that marks the robots that have it, which are all of them."""
        return {**values, **{f"_{name}": np.ones(self.num_envs, np.bool_) for name in values}}


def _autoreset_mode(given: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(given)
    except ValueError:
        modes = ", ".join(mode.value for mode in AutoresetMode)
        raise ValueError(f"autoreset_mode is {given!r}, expected one of {modes}.") from None


def _check_mask(mask: object, n: int) -> None:
    """Raise an error if a mask of robots to reset is none, or leaves robots out."""
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        raise TypeError(f"reset_mask is {mask!r}, expected an array of Booleans.")
    if mask.shape != (n,):
        raise ValueError(f"reset_mask has shape {mask.shape}, expected ({n},).")
    if not mask.all():
        raise ValueError(
            f"reset_mask leaves {n - int(mask.sum())} of {n} robots out, expected all: they begin and end together. "
            'Use vectorization_mode="sync" for robots that begin one by one.'
        )


class RobotVectorEnv(_ManyRobots):
    """`RobotEnv` n times, each robot alone in its own arena, in one call a step.

    Robot k draws the random numbers of individual `noise_key.individual` + k, as `try_genomes` does. All trials have
    the same number of steps and end together.

    Args:
        num_envs: Number of robots, >= 1.
        kind, task, controller, noise, platform, arena, dtype, render_mode: Arguments of `RobotEnv`.
        autoreset_mode: Gymnasium's mode. NEXT_STEP: the step after the end ignores its actions and begins new trials
            with a new key. SAME_STEP: the last step begins them itself. DISABLED: `reset` begins them.
        max_episode_steps: Number of steps after which trials are truncated, if they are longer.

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
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
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
        super().__init__(robots, render_mode, autoreset_mode, max_episode_steps)


class MazeVectorEnv(_ManyRobots):
    """`MazeEnv` n times, each agent alone in a separate maze, in one call a step.

    Args:
        num_envs: Number of agents, >= 1.
        maze, dtype, render_mode: Arguments of `MazeEnv`.
        autoreset_mode, max_episode_steps: Arguments of `RobotVectorEnv`.

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
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
    ) -> None:
        super().__init__(maze_robots(num_envs, maze, dtype), render_mode, autoreset_mode, max_episode_steps)
