"""The robot on its table: physics in fixed steps of time, driven by the motors, and the line that the pen draws."""

from __future__ import annotations

import math
from array import array

import numpy as np

from realitygap.world import Arena, Grid, Pose

from ._motors import STEP_NS, STEP_S, Motors
from ._power import Battery
from ._simulated import RobotOfItsOwn, SimulatedRobot
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
        self._own = robot if isinstance(robot, RobotOfItsOwn) else None
        self.time = 0  # up to where it has been computed [ns]
        self._begin_path()

    def place(self, pose: Pose, now: int) -> None:
        """Put the robot somewhere at a time, motors off, and begin path and steps of time anew."""
        self.motors.stop()
        self.robot.place(pose)
        self.time = now
        self._begin_path()

    def advance_to(self, now: int) -> None:
        """Compute all steps that end by a time [ns]."""
        if now - self.time < STEP_NS:
            return
        while now - self.time >= STEP_NS:
            if not self._moves:
                self._stand(now)
                return
            self._step()

    @property
    def _moves(self) -> bool:
        return self.motors.turning or (self._own is not None and self._own.rolls)

    def _stand(self, now: int) -> None:
        """Nothing moves: as many steps as there are at once."""
        whole = (now - self.time) // STEP_NS * STEP_NS
        self.battery.drain(0.0, whole)
        self.time += whole

    def _step(self) -> None:
        left, right = self.motors.speeds()
        turned = self.robot.advance(left, right, STEP_S)
        self.battery.drain(self.motors.load, STEP_NS)
        began = self.time / SECOND
        self.time += STEP_NS
        self.motors.turned(self.time, *turned, slipping=self.robot.stalled)
        if not self.robot.stalled or self.robot.pose != self._noted:
            if self.points[-4] < began:  # it stood until now
                self.points.extend((began, *self._noted))
            self._note()

    @property
    def stalled(self) -> bool:
        """Whether the motors work in vain."""
        return self.motors.turning and self.robot.stalled

    def _begin_path(self) -> None:
        self.points = array("d")  # time [s], x, y [m], heading [rad] of each point
        self._n_followed = 0  # points whose cells have been noted
        self._cells: CellsOnLine | None = None
        self._note()

    def _note(self) -> None:
        self._noted = self.robot.pose
        self.points.extend((self.time / SECOND, *self._noted))
        if len(self.points) > 4 * MOST_POINTS:
            self.cells()
            gone = len(self.points) // 16
            del self.points[: 4 * gone]
            self._n_followed -= gone

    def cells(self) -> tuple[int, ...]:
        """The cells of the grid along the line since the robot was placed, in order of first visits."""
        self._cells = self._cells or CellsOnLine(self.arena.grid)
        self._cells.follow(self.points[4 * self._n_followed :])
        self._n_followed = len(self.points) // 4
        return self._cells.visited


class CellsOnLine:
    """The cells that a line visits, which comes piece by piece.

    Args:
        grid: Of cells.
    """

    def __init__(self, grid: Grid) -> None:
        self._grid = grid
        self._found = np.zeros(grid.n_cells, dtype=np.bool_)
        self._order = np.zeros(grid.n_cells, dtype=np.int64)
        self._n = 0
        self._at: tuple[float, float] | None = None

    def follow(self, points: array[float]) -> None:
        """Go on along points of time, x, y and heading each."""
        from realitygap.kernels.tasks.coverage import (  # compiled code takes a while to import
            to_grid,
            visit,
            visit_line,
        )

        grid = self._grid
        size = (grid.columns, grid.rows)
        for k in range(0, len(points), 4):
            at = to_grid(points[k + 1], grid.x, grid.cell), to_grid(points[k + 2], grid.y, grid.cell)
            cell = (math.floor(at[0]), math.floor(at[1]))
            if self._at is None:
                self._n = int(visit(*cell, *size, self._found, self._order, self._n))
            elif cell != (math.floor(self._at[0]), math.floor(self._at[1])):
                self._n = int(visit_line(*self._at, *at, *size, self._found, self._order, self._n))
            self._at = at

    @property
    def visited(self) -> tuple[int, ...]:
        """In order of first visits."""
        return tuple(self._order[: self._n].tolist())
