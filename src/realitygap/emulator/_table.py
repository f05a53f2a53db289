"""The robot on its table: physics in fixed steps of time, driven by the motors, and the line that the pen draws."""

from __future__ import annotations

import math
from array import array

import numpy as np

from realitygap.kernels._coverage import to_grid, visit, visit_line
from realitygap.world import Arena, Grid, Pose

from ._motors import STEP_NS, STEP_S, Motors
from ._power import Battery
from ._simulated import SimulatedRobot
from ._time import SECOND

MOST_POINTS = 1_000_000  # of the path that are kept: 80 minutes of driving; the oldest go first


class Table:
    """A simulated robot, its motors and its battery.

    Args:
        robot: What moves.
        motors: What turns its wheels.
        battery: What feeds them.
        arena: The cells that the pen may visit.
    """

    def __init__(self, robot: SimulatedRobot, motors: Motors, battery: Battery, arena: Arena) -> None:
        self.robot, self.motors, self.battery, self.arena = robot, motors, battery, arena
        self.time = 0  # up to where it has been computed [ns]
        self.wheels = (0.0, 0.0)  # how fast they turned in the last step [m/s]
        self._begin_path()

    def place(self, pose: Pose, now: int) -> None:
        """Put the robot somewhere at a time, motors off, and begin path and steps of time anew."""
        self.motors.stop()
        self.robot.place(pose)
        self.time = now
        self.wheels = (0.0, 0.0)
        self._begin_path()

    def advance_to(self, now: int) -> None:
        """Compute all steps that end by a time [ns]."""
        if now - self.time < STEP_NS:
            return
        if not self.motors.turning:
            self._stand(now)
            return
        while now - self.time >= STEP_NS:
            self._step()
            if not self.motors.turning:
                self._stand(now)
                return

    def _stand(self, now: int) -> None:
        """Nothing moves: as many steps as there are at once."""
        whole = (now - self.time) // STEP_NS * STEP_NS
        self.battery.drain(0.0, whole)
        self.time += whole
        self.wheels = (0.0, 0.0)

    def _step(self) -> None:
        left, right = self.motors.speeds()
        rolled = self.robot.advance(left, right, STEP_S)
        self.battery.drain(self.motors.load, STEP_NS)
        self.time += STEP_NS
        self.motors.rolled(self.time, *rolled)
        self.wheels = (rolled[0] / STEP_S, rolled[1] / STEP_S)
        if rolled[0] or rolled[1]:
            self._draw()

    @property
    def stalled(self) -> bool:
        """Whether the motors work in vain."""
        return self.motors.turning and self.robot.stalled

    def _begin_path(self) -> None:
        grid = self.arena.grid
        self.points = array("d")
        self._visited = np.zeros(grid.n_cells, dtype=np.bool_)
        self._order = np.zeros(grid.n_cells, dtype=np.int64)
        self._at = self._in_grid()
        self._n_visited = int(
            visit(
                math.floor(self._at[0]),
                math.floor(self._at[1]),
                grid.columns,
                grid.rows,
                self._visited,
                self._order,
                0,
            )
        )
        self._note()

    def _in_grid(self) -> tuple[float, float]:
        grid: Grid = self.arena.grid
        x, y, _ = self.robot.pose
        return to_grid(x, grid.x, grid.cell), to_grid(y, grid.y, grid.cell)

    def _draw(self) -> None:
        """The pen follows; only a line into another cell needs to be looked at."""
        grid = self.arena.grid
        before, self._at = self._at, self._in_grid()
        if (math.floor(before[0]), math.floor(before[1])) != (
            math.floor(self._at[0]),
            math.floor(self._at[1]),
        ):
            self._n_visited = int(
                visit_line(
                    *before, *self._at, grid.columns, grid.rows, self._visited, self._order, self._n_visited
                )
            )
        self._note()

    def _note(self) -> None:
        self.points.extend((self.time / SECOND, *self.robot.pose))
        if len(self.points) > 4 * MOST_POINTS:
            del self.points[: len(self.points) // 16 * 4]

    def cells(self) -> tuple[int, ...]:
        """The cells of the grid along the line since the robot was placed, in order of first visits."""
        return tuple(self._order[: self._n_visited].tolist())
