"""A gripper: two paddles that open and close, and two beams between them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from realitygap.drawing import Ink, Line, Shape
from realitygap.world import Pose

from ._robot import Device, Edge, SceneRobot

LENGTH = 0.2  # of the paddles [m]
MOUNT = 0.225  # where they begin, ahead of the robot's center [m]
OPEN = 0.12  # half of the opening when open [m]
SPEED = 0.01  # by which half of the opening changes in a step [m]
BEAMS = (MOUNT + 0.07, MOUNT + 0.14)  # ahead of the center [m]
STORED = Pose(-1000.0, -1000.0, 1.5707963267948966)
"""Pose of stored robots, far outside the world."""

State = Literal["open", "close", "store", "deploy", "stop"]


class Gripper(Device):
    """Two paddles ahead of the robot, and two light beams between them.

    The paddles are part of the body: they collide, and other robots see them. `close` on something with a body
    stalls the whole robot while it tries to close, because the paddles cannot move into it. So use `store` for a robot
    between the open paddles.

    Attributes:
        state: The last command.
        opening: Half of the opening between the paddles, 0 to 0.12 [m].
        storage: Robots that are stored, in order.

    Source: Jyro 0.3.2. Differs: in Jyro a stored robot never returns, `store` fails while a beam meets the paddle of
    another gripper, and a reset changes neither paddles nor storage.
    """

    kind = "gripper"

    def __init__(self) -> None:
        super().__init__()
        self.storage: list[SceneRobot] = []
        self.reset()

    def reset(self) -> None:
        """Open the gripper, and empty its storage."""
        self.state: State = "open"
        self.opening = OPEN
        self.beams = (False, False)
        self.storage.clear()
        self._speed = 0.0
        self._between: list[SceneRobot] = []

    def open(self) -> None:
        """Begin to open."""
        self.state, self._speed = "open", SPEED

    def close(self) -> None:
        """Begin to close."""
        self.state, self._speed = "close", -SPEED

    def stop(self) -> None:
        """Stop the paddles where they are."""
        self.state, self._speed = "stop", 0.0

    def store(self) -> None:
        """Store the robots between the paddles, and begin to close."""
        self.state, self._speed = "store", -SPEED
        for robot in self._between:
            robot.place(STORED)
            if robot not in self.storage:
                self.storage.append(robot)

    def deploy(self) -> None:
        """Begin to open; once open, put the robot that was stored last between the paddles."""
        self.state, self._speed = "deploy", SPEED

    @property
    def is_open(self) -> bool:
        """True if the paddles rest at their maximum opening."""
        return self._speed == 0.0 and self.opening == OPEN

    @property
    def is_closed(self) -> bool:
        """True if the paddles rest and touch each other."""
        return self._speed == 0.0 and self.opening == 0.0

    @property
    def is_moving(self) -> bool:
        """True if the paddles move or are blocked on the way."""
        return self._speed != 0.0

    @property
    def readings(self) -> NDArray[np.float64]:
        """First and second beam broken, closed, open, moving, each 0 or 1, (5,)."""
        return np.array([*self.beams, self.is_closed, self.is_open, self.is_moving], np.float64)

    def read(self) -> None:
        """Check the beams, from the left paddle to the right."""
        mounts = np.array([(ahead, self.opening, -np.pi / 2) for ahead in BEAMS])
        _, hits = self.robot.world.look(self.robot, mounts, 2 * self.opening)
        owners = [self.robot.world.what(hit)[1] if hit >= 0 else None for hit in hits.tolist()]
        self.beams = (bool(hits[0] >= 0), bool(hits[1] >= 0))
        self._between = [owner for owner in owners if owner is not None]

    def move(self) -> None:
        """Advance the paddles by one step."""
        self.opening, self._speed = self._next()
        if self.state == "deploy" and self.is_open and self.storage:
            x, y = self.robot.point(sum(BEAMS) / 2, 0.0)
            self.storage.pop().place(Pose(x, y, self.robot.pose.heading))
            self.state = "open"

    def _next(self) -> tuple[float, float]:
        opening = self.opening + self._speed
        if self._speed > 0 and opening >= OPEN:
            return OPEN, 0.0
        if self._speed < 0 and opening <= 0.0:
            return 0.0, 0.0
        return opening, self._speed

    def edges(self, *, ahead: bool) -> Sequence[Edge]:
        """Return the two paddles."""
        half = self._next()[0] if ahead else self.opening
        return (MOUNT, half, MOUNT + LENGTH, half), (MOUNT, -half, MOUNT + LENGTH, -half)

    def shapes(self) -> list[Shape]:
        """Return the paddles, and the beams: solid where broken."""
        at, robot = self.opening, self.robot
        base = Line((robot.point(MOUNT, OPEN), robot.point(MOUNT, -OPEN)), Ink.TEXT, 1.0)
        shapes: list[Shape] = [base]
        for ahead, is_broken in zip(BEAMS, self.beams, strict=True):
            ends = (robot.point(ahead, at), robot.point(ahead, -at))
            shapes.append(Line(ends, Ink.REACH, 0.8, () if is_broken else (1.5, 1.5)))
        for left in (at, -at):
            near, far, low, high = MOUNT, MOUNT + LENGTH, left - 0.01, left + 0.01
            corners = ((near, high), (far, high), (far, low), (near, low))
            shapes.append(
                Line(tuple(robot.point(*corner) for corner in corners), None, closed=True, fill=Ink.TEXT)
            )
        return shapes

    def to_dict(self) -> dict[str, Any]:
        """Return the state, opening, beams and names of the stored robots, as plain values."""
        return super().to_dict() | {
            "state": self.state,
            "opening": self.opening,
            "readings": self.readings.tolist(),
            "storage": [robot.name for robot in self.storage],
        }
