"""A trial that can be shown in motion, whatever platform it was on."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

import realitygap
from realitygap.drawing import ShownAsCard, widget_of
from realitygap.kernels.tasks.coverage import BORDER_SNAP, visit, visit_line
from realitygap.world import (
    Arena,
    Body,
    Grid,
    RangeSensors,
    RobotModel,
    extent_of,
)

Outline = tuple[tuple[float, float], ...]
"""Corners, forward and left of the robot's origin, (b, 2) [m]."""


class Driven(Protocol):
    """A platform's record of a trial step by step, such as a `Trajectory`; row 0 is the start."""

    @property
    def step_s(self) -> float:
        """Duration of a step [s]."""

    @property
    def poses(self) -> NDArray[np.float64]:
        """Poses x [m], y [m], heading [rad], (t + 1, 3)."""

    @property
    def readings(self) -> NDArray[np.float64]:
        """Distances that the range sensors measure, (t + 1, s) [m]."""

    @property
    def stalled(self) -> NDArray[np.bool_]:
        """True if the step was blocked, (t + 1,)."""


class Ranging(Protocol):
    """A robot's outline and range sensors, such as a `JyroPlatform`."""

    @property
    def body(self) -> Body:
        """Body that collides."""

    @property
    def sensors(self) -> RangeSensors:
        """Rays of the sensor."""


@dataclass(frozen=True)
class RobotShape:
    """The drawn shape of a robot.

    Attributes:
        outlines: Parts of the robot, each a polygon.
        mounts: (s, 3) mount of each range sensor: forward [m], left [m] and direction [rad, positive to the left].
        reach: (s,) reach of each of them [m].
    """

    outlines: tuple[Outline, ...]
    mounts: tuple[tuple[float, float, float], ...]
    reach: tuple[float, ...]

    @property
    def front(self) -> float:
        """Distance from the robot's origin to its front [m]."""
        return max(forward for outline in self.outlines for forward, _ in outline)

    @classmethod
    def of(cls, robot: Ranging | RobotModel) -> RobotShape:
        """Return the shape of a robot. With a robot file, it has all parts, and the reach of each sensor."""
        model: Any = getattr(robot, "model", None)
        if isinstance(robot, RobotModel) or isinstance(model, RobotModel):
            model = robot if isinstance(robot, RobotModel) else model
            parts = tuple(part.outline() for part in model.body)
            return cls(parts, model.mounts, tuple(sensor.reach for sensor in model.range))
        mounts = robot.sensors.mounts
        return cls((robot.body.corners,), mounts, (robot.sensors.max_range,) * len(mounts))


@dataclass(frozen=True)
class MovingTrial(ShownAsCard):
    """A robot's positions and readings, step by step; row 0 is the start.

    Attributes:
        title: Title of the trial.
        label: SIM, TWIN, EMULATED or REAL.
        arena: Arena of the trial.
        shape: Shape of the robot.
        step_s: Duration of a step [s].
        poses: (t + 1, 3) x [m], y [m], heading [rad].
        rays: (t + 1, s) length of each ray [m], which is the reading as a distance. NaN: unknown.
        stalled: (t + 1,) True if the step was blocked.
        cells: (n,) cells visited in order of first visit, columns * row + column.
        visited_at: (n,) the row by which each has been visited.
        parts: Number of rows per step; t = parts * the number of steps.
    """

    title: str
    label: str
    arena: Arena
    shape: RobotShape
    step_s: float
    poses: NDArray[np.float64]
    rays: NDArray[np.float64]
    stalled: NDArray[np.bool_]
    cells: tuple[int, ...]
    visited_at: tuple[int, ...]
    parts: int = 1

    @classmethod
    def of_rows(
        cls,
        title: str,
        label: str,
        arena: Arena,
        shape: RobotShape,
        step_s: float,
        poses: NDArray[np.float64],
        rays: NDArray[np.float64],
        stalled: NDArray[np.bool_],
        parts: int = 1,
    ) -> MovingTrial:
        """Return the trial with these rows, whose cells are found in its line; see the attributes."""
        cells, rows, _ = first_visits(poses, arena.grid)
        visited = tuple(cells.tolist()), tuple(rows.tolist())
        return cls(title, label, arena, shape, step_s, poses, rays, stalled, *visited, parts)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.title!r}, {self.label}, {self.n_steps} steps, {len(self.cells)} cells)"

    def _repr_mimebundle_(self, **options: Any) -> dict[str, Any]:
        widget = widget_of(self)
        bundle: Any = {} if widget is None else widget._repr_mimebundle_()
        data = bundle[0] if isinstance(bundle, tuple) else bundle  # with metadata, or without
        return {kind: content for kind, content in data.items() if kind.startswith("application/")}

    def save(self, path: str | Path, *, speed: float = 1.0) -> Path:
        """Write the trial as a film that ends in .gif or .mp4, and return its path.

        Args:
            path: File to write.
            speed: 1 is as fast as the trial was; 2 is twice as fast.
        """
        return realitygap.playback.save_movie(self, path, speed=speed)

    @property
    def n_steps(self) -> int:
        """Number of steps in the trial."""
        return (len(self.poses) - 1) // self.parts

    @property
    def duration_s(self) -> float:
        """Duration of the trial [s]."""
        return self.n_steps * self.step_s

    def at(self, time: float) -> Moment:
        """Return the state at a time since the start [s], interpolated between steps, and the last state afterwards."""
        last = len(self.poses) - 1
        exact_row = min(max(time / self.step_s * self.parts, 0.0), float(last))
        row = min(math.floor(exact_row + 1e-9), last)
        share, onward = max(exact_row - row, 0.0), min(row + 1, last)
        x, y, heading = self.poses[row].tolist()
        next_x, next_y, next_heading = self.poses[onward].tolist()
        turn = math.remainder(next_heading - heading, math.tau)
        pose = (x + share * (next_x - x), y + share * (next_y - y), heading + share * turn)
        rays = self.rays[row] + share * (self.rays[onward] - self.rays[row])
        n_cells = int(np.searchsorted(self.visited_at, row, "right"))
        return Moment(row, row // self.parts, pose, rays, bool(self.stalled[row]), n_cells)


@dataclass(frozen=True)
class Moment:
    """One moment of a trial.

    Attributes:
        row: Last row of the finished part of the trial.
        step: Number of finished steps.
        pose: x [m], y [m], heading [rad].
        rays: (s,) lengths [m].
        stalled: True if the last step was blocked.
        n_cells: Number of cells visited so far.
    """

    row: int
    step: int
    pose: tuple[float, float, float]
    rays: NDArray[np.float64]
    stalled: bool
    n_cells: int


def in_motion(
    trajectory: Driven,
    arena: Arena,
    robot: Ranging | RobotModel | RobotShape,
    *,
    title: str = "trial",
    label: str = "SIM",
) -> MovingTrial:
    """Return a trial made ready to be shown.

    Args:
        trajectory: Trial with every step.
        arena: Arena of the trial.
        robot: Robot whose outline and rays are drawn.
        title: Title of the trial.
        label: SIM, TWIN, EMULATED or REAL.

    Raises:
        ValueError: the trajectory has other readings than the robot has sensors.
    """
    shape = robot if isinstance(robot, RobotShape) else RobotShape.of(robot)
    rays = np.asarray(trajectory.readings, np.float64)
    if rays.shape != (len(trajectory.poses), len(shape.mounts)):
        raise ValueError(
            f"readings has shape {rays.shape}, expected ({len(trajectory.poses)}, {len(shape.mounts)}): a row for the "
            "start and one for each step, and a reading of each range sensor of the robot."
        )
    return MovingTrial.of_rows(
        title,
        label,
        arena,
        shape,
        float(trajectory.step_s),
        np.asarray(trajectory.poses, np.float64),
        rays,
        np.asarray(trajectory.stalled, np.bool_),
    )


def all_trials(trials: MovingTrial | Iterable[MovingTrial]) -> list[MovingTrial]:
    """Return the trials that are shown together.

    Raises:
        TypeError: one is something else.
        ValueError: there is none, or they are in different arenas.
    """
    listed = [trials] if isinstance(trials, MovingTrial) else list(trials)
    if not listed:
        raise ValueError("No trial to show, expected at least one.")
    for trial in listed:
        if not isinstance(trial, MovingTrial):
            raise TypeError(
                f"A trial to show is a {type(trial).__name__}, expected a MovingTrial: realitygap.playback.in_motion("
                "trajectory, arena, robot) makes one."
            )
    first = listed[0].arena
    for trial in listed[1:]:
        if (trial.arena.walls, trial.arena.grid) != (first.walls, first.grid):
            raise ValueError(
                f"{trial.title} is in the arena {trial.arena.name!r}, {listed[0].title} in {first.name!r}: trials "
                "that are shown together need one arena. Show them in pictures of their own."
            )
    return listed


def first_visits(
    poses: NDArray[np.float64], grid: Grid
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the step of the first visit of each cell, with the cells that the trial itself counts.

    Args:
        poses: (t + 1, 3) x [m], y [m], heading [rad]; row 0 is the start. Of r robots (r, t + 1, 3), which move one
            after the other in each step.
        grid: The reachable cells.

    Returns:
        (n,) cells along the line in order of first visit, columns * row + column; (n,) the step at whose end
        each has been visited, 0 for the start; (m,) the same of cells in which steps end.
    """
    shape = (grid.columns, grid.rows)
    along, at_ends = np.zeros((2, grid.n_cells), np.bool_)
    order, order_ends = np.zeros((2, grid.n_cells), np.uint8)
    # as `to_grid`, of all poses in one go: a report counts tens of thousands
    values = (np.reshape(poses, (-1, *poses.shape[-2:]))[:, :, :2] - [grid.x, grid.y]) / grid.cell
    borders = np.floor(values + 0.5)
    placed_at = np.where(np.abs(values - borders) < BORDER_SNAP, borders, values)
    cells_at = np.floor(placed_at).astype(np.int64).tolist()
    robots = list(zip(placed_at.tolist(), cells_at, strict=True))
    n, n_ends = [], []
    so_far = so_far_ends = 0
    for step in range(poses.shape[-2]):
        for at, cells in robots:
            (u, v), (column, row) = at[step], cells[step]
            if step == 0:
                so_far = visit(column, row, *shape, along, order, so_far)
            elif at[step] != at[step - 1]:
                before_u, before_v = at[step - 1]
                so_far = visit_line(before_u, before_v, u, v, *shape, along, order, so_far)
            if step == 0 or cells[step] != cells[step - 1]:
                so_far_ends = visit(column, row, *shape, at_ends, order_ends, so_far_ends)
        n.append(so_far)
        n_ends.append(so_far_ends)
    steps, end_steps = (np.searchsorted(counts, np.arange(1, counts[-1] + 1)) for counts in (n, n_ends))
    return order[: n[-1]].astype(np.int64), steps, end_steps


def extent(arena: Arena) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top of what is shown [m]."""
    left, bottom, right, top = extent_of(arena)
    margin = 0.012 * (right - left)
    return left - margin, right + margin, bottom - margin, top + margin


def placed(points: Sequence[tuple[float, float]], pose: tuple[float, float, float]) -> NDArray[np.float64]:
    """Return points of the robot, forward and left [m], as x and y in the arena, (n, 2) [m]."""
    x, y, heading = pose
    sine, cosine = math.sin(heading), math.cos(heading)
    turned: NDArray[np.float64] = np.asarray(points, np.float64) @ np.array([[cosine, sine], [-sine, cosine]])
    turned += (x, y)
    return turned


def ray_ends(shape: RobotShape, moment: Moment) -> NDArray[np.float64]:
    """Return the start and the end of each ray, (s, 2, 2) [m]."""
    x, y, heading = moment.pose
    ends: list[Any] = []
    starts = placed([(forward, left) for forward, left, _ in shape.mounts], (x, y, heading))
    for start, (_, _, direction), length in zip(starts, shape.mounts, moment.rays, strict=True):
        angle = heading + direction
        ends.append([start, start + length * np.array([math.cos(angle), math.sin(angle)])])
    return np.array(ends, np.float64).reshape(-1, 2, 2)


def nearness(shape: RobotShape, lengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the nearness of the objects that the sensors see, (s,): 0 nothing within reach, 1 touching."""
    reach = np.array(shape.reach, np.float64)
    return np.clip(1.0 - np.nan_to_num(lengths, nan=np.inf) / reach, 0.0, 1.0)
