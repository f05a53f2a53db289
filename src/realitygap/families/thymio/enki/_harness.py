"""The Enki harness as a running program, and an arena as lines for it."""

from __future__ import annotations

import math
import subprocess
import weakref
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from realitygap.errors import RobotError
from realitygap.world import Arena, Obstacle, Pose, room_of, walls_within

from ._build import built_harness

CM = 100.0  # in a meter
WALL_CM = 0.2  # thickness of a wall inside the room
PIXEL_CM = 0.2  # of the floor, if there is something on it
MOST_PIXELS = 1_000  # across or up
N_PROX, N_GROUND = 7, 2


class State(NamedTuple):
    """An answer of the harness.

    Attributes:
        pose: The robot's pose [m], [rad].
        prox: (7,) infrared sensors, 0..4505.
        ground: (2,) ground sensors.
        wheels: Distance of the left and right wheel since the robot was put [m].
        touched: Whether the robot touched anything since the last answer.
    """

    pose: Pose
    prox: tuple[float, ...]
    ground: tuple[float, ...]
    wheels: tuple[float, float]
    touched: bool


class Harness:
    """A running harness with the robot in an arena.

    Args:
        arena: The walls, obstacles, and floor. Lights and a goal are left out.

    Raises:
        RobotError: The program is not built, or cannot be started.
        ValueError: Enki cannot have this arena.
    """

    def __init__(self, arena: Arena) -> None:
        lines = list(arena_lines(arena))
        self._x, self._y = _corner(arena)
        try:
            self._process = subprocess.Popen(
                [str(built_harness())], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
            )
        except OSError as error:
            raise RobotError(f"The Enki harness cannot be started ({error.strerror}).") from error
        self._end = weakref.finalize(self, _end, self._process)
        for line in lines:
            self._tell(line)

    def seed(self, number: int) -> None:
        """Choose the noise of all that follows."""
        self._tell(f"seed {number}")

    def put(self, pose: Pose) -> State:
        """Put the robot somewhere, at rest."""
        x, y = (pose.x - self._x) * CM, (pose.y - self._y) * CM
        return self._state(f"put {x!r} {y!r} {float(pose.heading)!r}")

    def drive(self, left: float, right: float, n: int, step_s: float) -> State:
        """Drive by wheel speeds [m/s] for n steps of Enki, each so long [s]."""
        return self._state(f"drive {left * CM!r} {right * CM!r} {n} {step_s!r}")

    def sense(self) -> State:
        """Read the sensors again, with new noise."""
        return self._state("sense")

    def close(self) -> None:
        """End the program; safe to call twice."""
        self._end()

    def _ask(self, line: str) -> str:
        pipes = self._process.stdin, self._process.stdout
        try:
            if pipes[0] is None or pipes[1] is None:
                raise BrokenPipeError
            pipes[0].write(line + "\n")
            pipes[0].flush()
            answer = pipes[1].readline()
        except (OSError, ValueError) as error:
            raise RobotError("The Enki harness has ended. Open the platform again.") from error
        if not answer:
            raise RobotError("The Enki harness has ended. Open the platform again.")
        return answer.strip()

    def _tell(self, line: str) -> None:
        answer = self._ask(line)
        if answer != "ok":
            raise RobotError(f"The Enki harness answers {answer!r} to {line[:60]!r}, expected 'ok'.")

    def _state(self, line: str) -> State:
        answer = self._ask(line)
        try:
            x, y, heading, *rest = map(float, answer.split())
            prox, ground = tuple(rest[:N_PROX]), tuple(rest[N_PROX : N_PROX + N_GROUND])
            left, right, touched = rest[N_PROX + N_GROUND :]
        except ValueError:
            raise RobotError(
                f"The Enki harness answers {answer!r} to {line[:60]!r}, expected numbers."
            ) from None
        pose = Pose(x / CM + self._x, y / CM + self._y, heading)
        return State(pose, prox, ground, (left / CM, right / CM), touched > 0)


def _end(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.wait()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            try:
                pipe.close()
            except OSError:  # what was not yet written to it
                continue


def check_arena(arena: Arena) -> None:
    """Raise an error if Enki cannot have an arena.

    Raises:
        ValueError: Numbers of it are drawn, or there is something on the floor and no rectangular room around it.
    """
    if arena.vary:
        raise ValueError(
            f"in arena {arena.name!r} {', '.join(arena.vary)} are drawn, expected plain numbers on platform 'enki'"
        )
    if _has_floor(arena) and room_of(arena) is None:
        raise ValueError(
            f"arena {arena.name!r} has something on its floor and no rectangle of walls around it, expected one on "
            "platform 'enki'"
        )


def arena_lines(arena: Arena) -> Iterator[str]:
    """Yield the lines that build an arena, in centimeters from its lower left corner.

    Raises:
        ValueError: As in `check_arena`.
    """
    check_arena(arena)
    room, (left, low) = room_of(arena), _corner(arena)
    yield "world" if room is None else _world(arena, room)
    for x1, y1, x2, y2 in walls_within(arena, room):
        length = math.hypot(x2 - x1, y2 - y1)
        x, y, angle = (x1 + x2) / 2 - left, (y1 + y2) / 2 - low, math.atan2(y2 - y1, x2 - x1)
        yield f"box {x * CM!r} {y * CM!r} {length * CM!r} {WALL_CM} {angle!r}"
    for obstacle in arena.obstacles:
        yield _obstacle(obstacle, left, low)


def _obstacle(obstacle: Obstacle, left: float, low: float) -> str:
    if len(obstacle.corners) == 1:
        ((x, y),) = obstacle.placed
        return f"disc {(x - left) * CM!r} {(y - low) * CM!r} {obstacle.radius * CM!r}"
    points = np.array(obstacle.outline())
    after = np.roll(points, -1, axis=0)
    twice = points[:, 0] * after[:, 1] - after[:, 0] * points[:, 1]
    middle = ((points + after) * twice[:, None]).sum(0) / (3 * twice.sum())
    corners = " ".join(repr(float(value)) for value in ((points - middle) * CM).ravel())
    x, y = ((middle - (left, low)) * CM).tolist()
    return f"polygon {x!r} {y!r} {len(points)} {corners}"


def _world(arena: Arena, room: tuple[float, float, float, float]) -> str:
    left, low, right, high = room
    text = f"world {(right - left) * CM!r} {(high - low) * CM!r}"
    if not _has_floor(arena):
        return text
    columns, rows = (min(MOST_PIXELS, math.ceil(size * CM / PIXEL_CM)) for size in (right - left, high - low))
    xs = left + (np.arange(columns) + 0.5) * (right - left) / columns
    ys = low + (np.arange(rows) + 0.5) * (high - low) / rows
    gray = (round(255 * arena.floor.brightness(x, y)) for y in ys.tolist() for x in xs.tolist())
    return f"{text} {columns} {rows} {' '.join(map(str, gray))}"


def _has_floor(arena: Arena) -> bool:
    return bool(arena.floor.tape) or arena.floor.image is not None


def _corner(arena: Arena) -> tuple[float, float]:
    """Return the point of the arena that is Enki's origin [m]."""
    room = room_of(arena)
    return (0.0, 0.0) if room is None else room[:2]
