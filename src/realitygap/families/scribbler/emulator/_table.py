"""The robot on its table: physics in fixed steps of time, driven by the motors, and the line that the pen draws."""

from __future__ import annotations

from array import array

from realitygap.emulator import SECOND
from realitygap.world import Arena, Pose, VisitedCells

from ._motors import STEP_NS, STEP_S, Battery, Motors
from ._simulated import RobotOfItsOwn, SimulatedRobot

MOST_POINTS = 1_000_000  # of the path that are kept: 80 minutes of driving; the oldest go first


class Table:
    """A simulated robot, its motors and its battery.

    Args:
        robot: Simulated robot.
        motors: Motors of its wheels.
        battery: Battery of the motors.
        arena: The cells that the pen may visit.
    """

    def __init__(self, robot: SimulatedRobot, motors: Motors, battery: Battery, arena: Arena) -> None:
        self.robot, self.motors, self.battery, self.arena = robot, motors, battery, arena
        self._own = robot if isinstance(robot, RobotOfItsOwn) else None
        self.time = 0  # up to where it has been computed [ns]
        self._begin_path()

    def place(self, pose: Pose, now: int) -> None:
        """Place the robot at a time with its motors off; the path and the steps of time restart."""
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
        """Pass the whole steps up to a time without motion, in one computation."""
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
        """True if the motors run but the robot is blocked."""
        return self.motors.turning and self.robot.stalled

    def _begin_path(self) -> None:
        self.points = array("d")  # time [s], x, y [m], heading [rad] of each point
        self._n_followed = 0  # points whose cells have been noted
        self._cells: VisitedCells | None = None
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
        """Return the cells of the grid along the line since the robot was placed, in order of first visits."""
        self._cells = self._cells or VisitedCells(self.arena.grid)
        points = self.points[4 * self._n_followed :]
        self._cells.follow(zip(points[1::4], points[2::4], strict=True))
        self._n_followed = len(self.points) // 4
        return self._cells.cells
