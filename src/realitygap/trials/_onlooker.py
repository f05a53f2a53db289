"""The onlooker of a simulated robot: the simulation itself."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import RobotError


class RobotOnlooker:
    """Sees of a simulated robot what its simulation knows: `pose`, `visited_cells` and, where it has them, `encoders`.

    Args:
        robot: Whom to look at.
    """

    def __init__(self, robot: Any) -> None:
        self._robot = robot
        self._poses: list[tuple[float, float, float]] = []

    def battery_v(self) -> float:
        """Not known, where the simulation has none [V]."""
        self._poses = []
        return float(getattr(self._robot, "battery_v", float("nan")))

    def wheels(self) -> tuple[float, float] | None:
        """What its encoders say [m]."""
        try:
            left, right = self._robot.encoders
        except (AttributeError, RobotError):
            return None
        return float(left), float(right)

    def look(self) -> None:
        """Remember its pose."""
        self._poses.append(tuple(self._robot.pose))

    def poses(self) -> NDArray[np.float64]:
        """(n, 3) at each look."""
        return np.array(self._poses, np.float64).reshape(-1, 3)

    def cells(self) -> tuple[int, ...]:
        """Those along its line."""
        return tuple(self._robot.visited_cells)
