"""What every device of a robot has in common; a device of your own begins here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from realitygap.drawing import Shape

if TYPE_CHECKING:
    from ._robot import SceneRobot

Edge = tuple[float, float, float, float]
"""Forward and left of one end, then of the other, on a robot [m]."""
Mount = tuple[float, float, float]
"""Forward [m], left [m], direction [rad, positive to the left], on a robot."""


class Device:
    """Something that a robot carries and that is read, or moves, once in each step.

    A device of your own overrides what it needs of `read`, `move`, `edges`, `shapes` and `reset`:

        class Compass(Device):
            kind = "compass"

            def read(self):
                self.heading = self.robot.pose.heading

    Attributes:
        kind: What `robot[kind]` finds it by; the last added of a kind is found.
        active: Whether it is read; an inactive one keeps its readings. It still moves and is in the way.
        robot: Which robot carries it; known once it has been added.
    """

    kind = "device"
    robot: SceneRobot

    def __init__(self) -> None:
        self.active = True

    def read(self) -> None:
        """Refresh the readings; at the end of each step, when all robots have moved."""

    def move(self) -> None:
        """Advance by one step; right after the robot moved, and not when it was blocked."""

    def reset(self) -> None:
        """Back to what it was at first."""

    def edges(self, *, ahead: bool) -> Sequence[Edge]:
        """Edges that it adds to the robot's body, always as many.

        Args:
            ahead: Whether as they will be after the next `move`; else as they are.
        """
        return ()

    def rays(self) -> list[Shape]:
        """What it sees, drawn below the robot, in the world's coordinates [m]."""
        return []

    def shapes(self) -> list[Shape]:
        """What it looks like, drawn above the robot, in the world's coordinates [m]."""
        return []

    def to_dict(self) -> dict[str, Any]:
        """Kind, whether it is active, and readings, as plain values."""
        return {"kind": self.kind, "active": self.active}
