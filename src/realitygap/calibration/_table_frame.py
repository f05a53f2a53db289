"""The point and the direction that the distances and bearings of a table of readings count from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from realitygap.world import RobotModel

from ._range_table import BearingFrom, MeasuredFrom, RangeProblem, Readings
from ._simulate import Floats, Ints

MOST_SENSORS, MOST_ROWS = 4, 150
"""Sensors, and readings of each, that decide. More take longer and decide the same."""
N_TRIED, N_STARTS = 60, 2
CLEAR, MARGIN = 1.1, 4.0
"""A frame is taken instead of an earlier one if that leaves this factor more unexplained, and `MARGIN` squares more."""


@dataclass(frozen=True)
class TableFrame:
    """A way to read the distances and bearings of a table.

    Attributes:
        measured_from: The point that distances are measured from.
        bearing_from: The direction that bearings count from.
        clockwise: True if bearings grow clockwise.
    """

    measured_from: MeasuredFrom = "body"
    bearing_from: BearingFrom = "body"
    clockwise: bool = False

    def __str__(self) -> str:
        points = {"body": "the body's outline", "origin": "the body's origin", "sensor": "each sensor"}
        axes = {"body": "the robot's heading", "sensor": "each sensor's own direction"}
        way = "clockwise" if self.clockwise else "counterclockwise"
        return f"bearings {way} from {axes[self.bearing_from]}, distances from {points[self.measured_from]}"


def choose_frame(
    sensor: ArrayLike,
    distance_m: ArrayLike,
    bearing_rad: ArrayLike,
    readings: ArrayLike,
    robot: RobotModel,
    frames: Sequence[TableFrame],
    seed: int = 0,
) -> tuple[TableFrame, dict[TableFrame, float]]:
    """Return the frame in which the sensors of a robot fit a table best, and the error of a first fit in each frame.

    Each sensor is fitted alone, to a part of its readings and from several starts. An earlier frame is preferred if a
    later one fits hardly better.

    Args:
        sensor, distance_m, bearing_rad, readings: (n,) as in `fit_range_table`; bearings in the sign of the table.
        robot: The robot with its nominal numbers.
        frames: The frames to try, the usual ones first.
        seed: Seed of the starts.

    Raises:
        ValueError: As in `fit_range_table`.
    """
    which: Ints = np.asarray(sensor, np.int64)
    bearing: Floats = np.asarray(bearing_rad, np.float64)
    sensors = np.unique(which)
    chosen = sensors[np.linspace(0, len(sensors) - 1, min(len(sensors), MOST_SENSORS)).astype(int)]
    costs, errors = {}, {}
    for frame in frames:
        table = Readings.of(
            which, distance_m, -bearing if frame.clockwise else bearing, readings, robot, frame.measured_from,
            frame.bearing_from, hold_out=False,
        )  # fmt: skip
        cost, squares, n = 0.0, 0.0, 0
        for k in chosen:
            alone = RangeProblem.of(table.of_sensor(int(k), MOST_ROWS), robot, (), 0.0)
            best = alone.best_of_several(seed, N_TRIED, N_STARTS)
            cost += alone.cost(best)
            squares += float(np.sum((alone.at(best) - alone.table.readings) ** 2))
            n += len(alone.table.readings)
        costs[frame], errors[frame] = cost, math.sqrt(squares / n)
    least = min(costs.values())
    return next(frame for frame in frames if costs[frame] <= CLEAR * least + MARGIN), errors
