"""A robot that meets the contract with nothing behind it but a point in the paper's arena; and its witness."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable

import numpy as np

from realitygap.errors import RobotError
from realitygap.robots import Command, Observation, check_command
from realitygap.world import Arena, Pose, paper_arena

SPEED = 0.14  # [m/s]
TURN_RATE = 1.8  # [rad/s]
MARGIN = 0.09  # how near its center comes to a wall [m]


class FakeClock:
    """Time that passes when it is told to."""

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        return self._now

    def sleep(self, seconds: float) -> None:
        self._now += seconds


class FakeRobot:
    """Moves at once; its readings are noisy, and a function of the seed it was placed with."""

    label = "EMULATED"
    n_sensors = 3

    def __init__(
        self, step_s: float = 0.5, *, name: str = "Fake", fault: Callable[[str], None] | None = None
    ) -> None:
        self.step_s = step_s
        self.name = name
        self.reading_max = 1700.0
        self.clock = FakeClock()
        self.motors = (0.0, 0.0)
        self.is_open = True
        self.is_linked = True
        self.cell_v = 7.2
        self._fault = fault or (lambda what: None)
        self.place(paper_arena().start, 0)

    # the contract

    def reset(self, pose: Pose | None = None) -> None:
        self._say("reset")
        self.motors = (0.0, 0.0)

    def observe(self) -> Observation:
        self._say("observe")
        ahead = 0.3 - self._distance_ahead()
        raw = tuple(max(0.0, round(7000 * ahead + self._random.uniform(-300, 300))) for _ in range(3))
        return Observation(tuple(min(1.0, value / 1700) for value in raw), self._stalled, raw)

    def drive(self, command: Command) -> None:
        check_command(command)
        self._say("drive")
        self.motors = tuple(command)
        for _ in range(10):
            self._move(self.step_s / 10)

    def stop(self) -> None:
        self._say("stop")
        self.motors = (0.0, 0.0)

    def close(self) -> None:
        if self.is_linked:
            self.motors = (0.0, 0.0)
        self.is_open = False

    def __enter__(self) -> FakeRobot:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    least_battery_v = 6.15

    def volts(self) -> float:
        return self.cell_v

    # the witness

    @property
    def witness(self) -> FakeRobot:
        return self

    def place(self, pose: Pose, seed: int) -> None:
        self._random = random.Random(seed)
        self._pose = pose
        self._stalled = False
        self.motors = (0.0, 0.0)
        self._line = [(self.clock.now(), pose)]

    def now(self) -> float:
        return self.clock.now()

    def identity(self) -> str:
        return "fake"

    def arena(self) -> Arena:
        return paper_arena()

    def path(self) -> np.ndarray:
        return np.array([(time, *pose) for time, pose in self._line])

    def cells(self) -> tuple[int, ...]:
        return cells_of(pose for _, pose in self._line)

    def cells_at(self, times) -> tuple[int, ...]:
        return cells_of([pose for at, pose in self._line if at <= time + 1e-9][-1] for time in times)

    # inside

    def _say(self, what: str) -> None:
        if not self.is_linked:
            raise RobotError("The link is gone.")
        self._fault(what)

    def _distance_ahead(self) -> float:
        for k in range(1, 31):
            x = self._pose.x + 0.01 * k * math.cos(self._pose.heading)
            y = self._pose.y + 0.01 * k * math.sin(self._pose.heading)
            if not (0 < x < 1.0668 and 0 < y < 0.6096):
                return 0.01 * k
        return 0.3

    def _move(self, seconds: float) -> None:
        move, turn = self.motors
        heading = self._pose.heading + turn * TURN_RATE * seconds
        x = self._pose.x + move * SPEED * seconds * math.cos(heading)
        y = self._pose.y + move * SPEED * seconds * math.sin(heading)
        self._stalled = not (MARGIN < x < 1.0668 - MARGIN and MARGIN < y < 0.6096 - MARGIN)
        self._pose = Pose(self._pose.x, self._pose.y, heading) if self._stalled else Pose(x, y, heading)
        self.clock.sleep(seconds)
        self._line.append((self.clock.now(), self._pose))


def cells_of(poses: Iterable[Pose]) -> tuple[int, ...]:
    found = [paper_arena().grid.cell_at(pose.x, pose.y) for pose in poses]
    return tuple(dict.fromkeys(cell for cell in found if cell is not None))
