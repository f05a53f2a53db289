"""n robots that take a command each, step by step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, TypeVar

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike, NDArray

from realitygap.errors import StudyError, did_you_mean, real_number, whole_number
from realitygap.evolution import PAPER_INPUTS, ControllerInterface
from realitygap.kernels.math.philox import MAX_INDIVIDUALS
from realitygap.platforms import Fleet, JyroPlatform, Platform, SimPlatform, class_of, platform_of
from realitygap.tasks import MAZE_TASKS, PYTHON, TASKS, ControllerSettings
from realitygap.trials import NoiseKey
from realitygap.world import ArenaSettings

from ._maze_fleet import MAZE_ACTIONS, MazeFleet
from ._picture import draw_robot
from ._rewards import ExitReward, Reward, reward_of

GivenPlatform = Platform | str | Mapping[str, Any] | None
GivenController = ControllerSettings | Mapping[str, Any] | None
RealType = Literal["float32", "float64"]
T = TypeVar("T")

_KHEPERA_RANGES = tuple(f"range.{k}" for k in range(8))
INPUTS: Mapping[str, tuple[str, ...]] = {
    "avoid": _KHEPERA_RANGES,
    "light": (*(f"light.{k}" for k in range(8)), *_KHEPERA_RANGES),
    "wall": _KHEPERA_RANGES,
    "goal": (*_KHEPERA_RANGES, *(f"goal_sector.{k}" for k in range(4))),
}
"""Inputs of a Khepera by default, as in the study of the same name, without the constant."""

KHEPERA: Mapping[str, Mapping[str, Any]] = {
    "avoid": {"steps": 400},
    "light": {"steps": 200, "set": {"arena.start.heading": {"uniform": [-3.14159, 3.14159]}}},
    "wall": {"steps": 800},
    "goal": {"steps": 800},
}
"""Settings of the platform by default, as in the study of the same name."""

ARENAS: Mapping[str, str] = {"goal": "maze-medium"}
"""Arenas by default, as in the study of the same name; otherwise the one named like the task."""

WITHIN: Mapping[str, Mapping[str, Any]] = {"wall": {"within": 0.1}}
"""Settings of the task by default, as in the study of the same name."""


class Robots:
    """n robots at one task, all at the same step of their trials.

    Attributes:
        n: Number of robots.
        noise_key: Key of the random numbers of robot 0.
        step_s: Duration of a command [s].
    """

    def __init__(
        self,
        fleet: Fleet,
        reward: Reward,
        n: int,
        dtype: RealType,
        interface: ControllerInterface | None = None,
    ) -> None:
        if dtype not in ("float32", "float64"):
            raise ValueError(f"dtype is {dtype!r}, expected 'float32' or 'float64'.")
        self.n = n
        self._fleet, self._reward, self._interface = fleet, reward, interface
        self._dtype: Any = np.dtype(dtype)
        self._actions = interface.outputs if interface is not None else MAZE_ACTIONS
        self._step: int | None = None
        self._paths: list[NDArray[np.float64]] | None = None
        self.noise_key = NoiseKey(0)
        self.step_s = fleet.step_s

    @property
    def n_driven(self) -> int:
        """Number of steps of this trial that are done."""
        return self._step or 0

    @property
    def is_over(self) -> bool:
        """True if all steps are done."""
        return self._step == self._fleet.n_steps

    def observation_space(self) -> Any:
        """Return the Box of what one robot's controller sees."""
        low, high = self._fleet.bounds().astype(self._dtype)
        return spaces.Box(low, high, dtype=self._dtype.type)

    def action_space(self) -> Any:
        """Return the Box of what it answers: move and turn, or two wheel speeds."""
        return spaces.Box(-1.0, 1.0, (2,), self._dtype.type)

    def keep_paths(self) -> None:
        """Keep the poses of each trial from the next one on, for pictures."""
        self._paths = []

    def start(self, options: Mapping[str, Any] | None, np_random: np.random.Generator) -> NDArray[Any]:
        """Put all robots at the start; returns (n, i) observations.

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
        self._reward.start(self._fleet)
        self._step = 0
        if self._paths is not None:
            self._paths = [self._fleet.facts()["pose"]]
        return self._observe()

    def drive(self, actions: ArrayLike) -> tuple[NDArray[Any], NDArray[np.float64]]:
        """Drive one command of each robot.

        Args:
            actions: (n, 2) outputs of controllers. They are limited to -1..1, as in a trial.

        Returns:
            (n, i) observations and (n,) rewards.

        Raises:
            ResetNeeded: No trial is under way.
            ValueError: Another shape, or a number that is infinite or NaN. No robot moves.
        """
        if self._step is None or self.is_over:
            raise ResetNeeded("No trial is under way: call reset() first, and again when all steps are done.")
        given = np.ascontiguousarray(actions, np.float64)
        if given.shape != (self.n, 2):
            raise ValueError(f"actions has shape {given.shape}, expected ({self.n}, 2).")
        is_finite = np.isfinite(given)
        if not is_finite.all():
            k, part = np.argwhere(~is_finite)[0].tolist()
            of_robot = "" if self.n == 1 else f" of robot {k}"
            raise ValueError(
                f"{self._actions[part]}{of_robot} is {given[k, part]}, expected a number from -1 to 1. No robot moved."
            )
        if self._interface is not None and self._interface.drives_wheels:
            given = self._interface.commands(given)
        self._fleet.step(given)
        self._step += 1
        rewards = self._reward.step(self._fleet, given)
        if self._paths is not None:
            self._paths.append(self._fleet.facts()["pose"])
        return self._observe(), rewards

    def _observe(self) -> NDArray[Any]:
        return self._fleet.observe().astype(self._dtype)

    def facts(self) -> dict[str, NDArray[np.float64]]:
        """Return the true state, not the observed one: pose (n, 3), readings (n, s), and both coverages (n,)."""
        facts, n_cells = self._fleet.facts(), self._fleet.cells.shape[1]
        if not n_cells:
            return facts
        counts = self._fleet.counts / n_cells
        return {**facts, "coverage_line": counts[:, 0], "coverage_ends": counts[:, 1]}

    def cells(self, k: int) -> tuple[int, ...]:
        """Return the cells that robot k visited along its line, in order of first visit, columns * row + column."""
        return tuple(self._fleet.cells[k, : self._fleet.counts[k, 0]].tolist())

    def picture(self, k: int) -> NDArray[np.uint8]:
        """Return robot k in its arena, (h, w, 3).

        Raises:
            ResetNeeded: No trial was begun.
        """
        if not self._paths:
            raise ResetNeeded("There is nothing to show yet: call reset() first.")
        path = np.array([poses[k] for poses in self._paths])
        cells = self._fleet.cells[k, : self._fleet.counts[k, 0]]
        return draw_robot(
            self._fleet.arena, self._fleet.outline, path, self._fleet.facts()["readings"][k], cells
        )

    def close(self) -> None:
        """Let go of the robots; safe to call twice."""
        self._fleet.close()


def task_robots(
    n: int,
    kind: str,
    *,
    task: Mapping[str, Any] | None,
    controller: GivenController,
    noise: float | None,
    platform: GivenPlatform,
    arena: ArenaSettings | Mapping[str, Any] | None,
    dtype: RealType,
) -> Robots:
    """Return n robots at a task; arguments and errors as of `RobotEnv`."""
    n = whole_number("num_envs", n, 1, MAX_INDIVIDUALS)
    settings = dict(task or {})
    own = _task(kind, settings)
    made = _platform(platform, kind)
    if noise is None:
        noise = made.default_noise
    noise = real_number("noise", noise, 0, 10)
    preset = ARENAS.get(kind, kind)
    if arena is None and kind != "coverage":
        arena = {"preset": preset}
    place = _made("arena", ArenaSettings, arena).arena()
    if place.others:
        raise ValueError(f"arena.robots is {place.n_robots}, expected 1: an environment has one robot.")
    declared = _made("controller", ControllerSettings, controller)
    if declared.inputs and "inputs" in settings:
        raise ValueError("task.inputs and controller.inputs both define the inputs. Leave task.inputs out.")
    names: tuple[str, ...] = PAPER_INPUTS
    if declared.inputs:
        names = declared.inputs
    elif kind != "coverage":
        default = (
            INPUTS[kind] if platform is None else PAPER_INPUTS if made.robot_model is None else own.inputs
        )
        names = tuple(settings.get("inputs", default))
    interface = ControllerInterface(names, declared.outputs)
    fleet = made.fleet(place, interface.sensed, noise, n)
    try:
        reward = reward_of(own, fleet)
    except BaseException:
        fleet.close()
        raise
    return Robots(fleet, reward, n, dtype, interface)


def maze_robots(n: int, maze: str, dtype: RealType) -> Robots:
    """Return n of the published agents in a published maze.

    Raises:
        ValueError: There is no such maze.
    """
    n = whole_number("num_envs", n, 1, MAX_INDIVIDUALS)
    if maze not in MAZE_TASKS:
        raise ValueError(f"maze is {maze!r}. {did_you_mean(str(maze), MAZE_TASKS)}")
    return Robots(MazeFleet(ArenaSettings(preset=maze).arena(), n), ExitReward(), n, dtype)


def _task(kind: str, settings: Mapping[str, Any]) -> Any:
    if isinstance(kind, str) and kind.startswith(PYTHON):
        raise ValueError(
            f"kind is {kind!r}, expected one of {', '.join(TASKS)}: a Python task scores whole trials. Use it in a "
            "study."
        )
    if kind not in TASKS:
        raise ValueError(f"kind is {kind!r}. {did_you_mean(str(kind), TASKS)}")
    return _made("task", TASKS[kind], {**WITHIN.get(kind, {}), **settings})


def _platform(given: GivenPlatform, kind: str) -> Platform:
    """Return the given platform, or that of a name. Settings without a name are those of the default."""
    if isinstance(given, Platform):
        return given
    if not isinstance(given, str):
        if kind == "coverage":
            return _made("platform", JyroPlatform, given)
        base = {"robot": "khepera", **KHEPERA[kind]}
        return _made(
            "platform", SimPlatform, {**base, **given} if isinstance(given, Mapping) else given or base
        )
    try:
        model = class_of(given)
        platform = platform_of(given)
        if platform.needs_person or not model.is_for_studies:
            raise ValueError(
                f"platform is {given!r}, expected a simulated robot, a twin, or an emulated robot in this program: "
                "Gymnasium cannot place a robot on the floor. `realitygap drive` leads a person through its trials."
            )
        return platform
    except StudyError as error:
        raise ValueError(f"platform: {error}") from None


def _made(name: str, kind: type[T], given: T | Mapping[str, Any] | None) -> T:
    """Return the given object, built from its settings if it is a mapping."""
    if isinstance(given, kind):
        return given
    if not isinstance(given, Mapping | None):
        raise TypeError(f"{name} is {given!r}, expected {kind.__name__}, or a mapping of what it is made of.")
    return kind(**(given or {}))
