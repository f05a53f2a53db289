"""A simulated Scribbler behind an emulator in this process: what `initialize("sim")` opens."""

from __future__ import annotations

import math
from collections.abc import Sequence
from urllib.parse import parse_qsl, urlencode

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import RobotError
from realitygap.families.scribbler import Scribbler as Driver
from realitygap.world import NAMED_STARTS, Arena, Pose, is_inside

from ._mistakes import MyroError, choice, number, whole
from ._view import View, best_view, text_map

Option = str | float | Sequence[float] | None
"""Value of an option of a simulated robot, as a program or the name of a port gives it."""

_WORDS = ("sim", "simulator", "simulation")
_OPTIONS = ("seed", "start", "speed", "model", "fluke", "arena", "view")
_CLEARANCE = 0.12  # from the middle of the robot to its furthest corner, and a little more [m]
_TRIES = 10_000


def is_simulation(name: str) -> bool:
    """Return whether a port names a simulated robot: "sim", "simulator", "sim?seed=3"."""
    return name.partition("?")[0].lower() in _WORDS


def parse_simulation(name: str) -> dict[str, Option]:
    """Return the options behind the question mark of "sim?seed=3&speed=off".

    Raises:
        MyroError: One of them is not known.
    """
    options: dict[str, Option] = dict(parse_qsl(name.partition("?")[2], keep_blank_values=True))
    for key in options:
        choice('initialize("sim"): the option', key, dict.fromkeys(_OPTIONS))
    return options


class Simulation:
    """An open simulated Scribbler, and a witness that records its true motion; printed, it is a map.

    Args:
        seed: Seed of its sensors' noise, and of a random start.
        start: "corner" (of the paper's arena), "center", "left" or "random"; or (x, y, heading) [m, m, degrees], as
            text "0.5,0.3,90". The heading is that of the end that is ahead: the Fluke's.
        speed: 1 for real time, 10 for ten times as fast; "off" for as fast as can be: time passes only while the
            program waits, or speaks with the robot.
        model: "s1" or "s2".
        fluke: "none", 1 or 2.
        arena: Arena of the emulator: "paper", or a file.
        view: "notebook" shows the robot live below the cell, "off" shows nothing. Default: the one that fits.

    Attributes:
        driver: The robot's driver: it speaks with the emulator through the bytes of a real robot.
        arena: Arena of the robot.
        seed: Seed, as given.
    """

    def __init__(
        self,
        seed: Option = 0,
        start: Option = None,
        speed: Option = 1,
        model: Option = "s2",
        fluke: Option = 2,
        arena: Option = "paper",
        view: Option = None,
    ) -> None:
        self.seed = whole('initialize("sim"): the seed', _plain(seed), 0, 2**31 - 1)
        choice('initialize("sim"): the model', model, {"s1": "s1", "s2": "s2"})
        choice('initialize("sim"): the fluke', _plain(fluke), {"none": 0, 1: 1, 2: 2})
        self.speed = (
            None if speed in ("off", None) else number('initialize("sim"): the speed', _plain(speed), 0.01)
        )
        query = urlencode(
            {
                "fluke": fluke,
                "arena": arena,
                "seed": self.seed,
                "speed": "off" if self.speed is None else f"{self.speed:g}",
            }
        )
        self.driver = _opened(f"emulator://{model}?{query}")
        self.witness = self.driver.port.witness
        self.arena: Arena = self.driver.port.emulator.scene.arena
        self.witness.place(self._start(_plain(start)), self.seed)
        self._view: View | None = best_view(self, view)

    def __str__(self) -> str:
        return text_map(self)

    @property
    def is_timed(self) -> bool:
        """True if time passes automatically. Otherwise it passes only while a program waits or uses the robot."""
        return self.speed is not None

    def pose(self) -> Pose:
        """Return the position of the robot [m], and the direction of the end that is ahead [rad]."""
        return Pose(*self.witness.pose())

    def cells(self) -> tuple[int, ...]:
        """Return the cells of the arena's grid that the pen went through, in order of first visits."""
        return tuple(self.witness.cells())

    def coverage(self) -> float:
        """Return the share of the arena's cells that the pen went through, 0 to 1."""
        return len(self.cells()) / self.arena.grid.n_cells

    def path(self) -> NDArray[np.float64]:
        """Return time [s], x [m], y [m], heading [rad] along the path, (t, 4)."""
        return np.asarray(self.witness.path(), dtype=np.float64).reshape(-1, 4)

    def look(self) -> None:
        """Show the robot at its present pose, if it is shown at all and not too often."""
        if self._view is not None:
            self._view.look()

    def catch_up(self) -> None:
        """Let a robot that moves in real time move on to the present."""
        self.driver.clock.now()

    def close(self) -> None:
        """Show the robot once more and stop showing it."""
        if self._view is not None:
            self._view.close()
            self._view = None

    def _start(self, start: object) -> Pose:
        if start is None:
            return self.arena.start
        if start == "random":
            return _random_pose(self.arena, self.seed)
        if isinstance(start, str) and "," not in start:
            return choice('initialize("sim"): the start', start, {**NAMED_STARTS, "random": self.arena.start})
        parts = start.split(",") if isinstance(start, str) else start
        if not isinstance(parts, Sequence) or len(parts) != 3:
            raise MyroError(
                f'initialize("sim"): the start is {start!r}, expected three numbers: x and y [m], heading [degrees].'
            )
        x, y, heading = (number('initialize("sim"): a part of the start', _plain(part)) for part in parts)
        if not is_inside(self.arena, x, y):
            raise MyroError(f'initialize("sim"): the start ({x:g}, {y:g}) is not inside the arena.')
        return Pose(x, y, math.radians(heading))


def _opened(url: str) -> Driver:
    try:
        return Driver(url)
    except RobotError as error:
        raise MyroError(f'initialize("sim"): {error}') from error


def _plain(value: object) -> object:
    """Return a number from the text of an option after a question mark. Other values are returned unchanged."""
    if isinstance(value, str):
        try:
            return int(value)
        except ValueError:
            try:
                return float(value)
            except ValueError:
                return value
    return value


def _random_pose(arena: Arena, seed: int) -> Pose:
    """Return a pose by chance at which the robot touches neither wall nor obstacle."""
    draw = np.random.default_rng(seed)
    walls = np.array(arena.walls)
    xs, ys = walls[:, [0, 2]], walls[:, [1, 3]]
    for _ in range(_TRIES):
        x, y = draw.uniform(xs.min(), xs.max()), draw.uniform(ys.min(), ys.max())
        heading = draw.uniform(-math.pi, math.pi)
        is_clear = all(obstacle.distance(x, y) > _CLEARANCE for obstacle in arena.obstacles)
        if is_clear and is_inside(arena, x, y) and _nearest(walls, x, y) > _CLEARANCE:
            return Pose(float(x), float(y), float(heading))
    raise MyroError(f"The arena {arena.name} has no place where the robot fits.")


def _nearest(walls: NDArray[np.float64], x: float, y: float) -> float:
    start, along = walls[:, :2], walls[:, 2:] - walls[:, :2]
    to = np.array([x, y]) - start
    share = np.clip((to * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-12), 0, 1)
    return float(np.linalg.norm(to - share[:, None] * along, axis=1).min())
