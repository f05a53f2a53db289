"""The readings that a robot's sensors are expected to have along a wall, and what a table of them says by itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from realitygap.errors import finite_numbers
from realitygap.world import RobotModel

from ._range_response import numbers_in_file, wall_reading
from ._range_table import BearingFrom, MeasuredFrom, gaps_to_wall
from ._simulate import Floats

FARTHEST = 6
"""Places of the table between an unseen reading and those that it is looked up from, at most."""


def predict_range_table(
    sensor: ArrayLike,
    distance_m: ArrayLike,
    bearing_rad: ArrayLike,
    robot: RobotModel,
    *,
    measured_from: MeasuredFrom = "body",
    bearing_from: BearingFrom | None = None,
) -> Floats:
    """Return the expected readings of a robot along a long, straight wall, shape (n,), 0 to 1.

    Args:
        sensor: (n,) index of the range sensor in the robot's file.
        distance_m: (n,) shortest distance to the wall [m].
        bearing_rad: (n,) direction from the robot to the nearest point of the wall, positive to the left [rad].
        robot: The robot.
        measured_from, bearing_from: As in `fit_range_table`.
    """
    which = np.asarray(sensor, np.int64)
    distance, bearing = np.asarray(distance_m, np.float64), np.asarray(bearing_rad, np.float64)
    gap, bearing = gaps_to_wall(which, distance, bearing, robot, measured_from, bearing_from)
    readings = np.empty(len(which))
    for k in np.unique(which):
        at = which == k
        readings[at] = wall_reading(gap[at], bearing[at], numbers_in_file(robot, int(k)), robot.range[k])
    return readings


def look_up_readings(
    sensor: ArrayLike,
    distance_m: ArrayLike,
    bearing_rad: ArrayLike,
    readings: ArrayLike,
    seen: NDArray[np.bool_],
) -> Floats:
    """Return the mean of the nearest fitted readings of the same sensor for each place, shape (n,).

    Places are neighbors by the ranks of their distances and bearings. nan if no seen place is near.

    Args:
        sensor: (n,) index of the range sensor.
        distance_m: (n,) [m].
        bearing_rad: (n,) [rad].
        readings: (n,) 0 to 1.
        seen: (n,) True for the readings to look up.
    """
    which, values = np.asarray(sensor, np.int64), np.asarray(readings, np.float64)
    row, column = place_ranks(distance_m, bearing_rad)
    shape = (int(which.max()) + 1, int(row.max()) + 1 + 2 * FARTHEST, int(column.max()) + 1 + 2 * FARTHEST)
    total, count = np.zeros(shape), np.zeros(shape)
    at = which, row + FARTHEST, column + FARTHEST
    np.add.at(total, tuple(part[seen] for part in at), values[seen])
    np.add.at(count, tuple(part[seen] for part in at), 1.0)
    means = np.full(len(which), np.nan)
    for reach in range(1, FARTHEST + 1):
        steps = [
            (i, j)
            for i in range(-reach, reach + 1)
            for j in range(-reach, reach + 1)
            if 0 < abs(i) + abs(j) <= reach
        ]
        near = [(at[0], at[1] + i, at[2] + j) for i, j in steps]
        n = np.sum([count[place] for place in near], axis=0)
        mean = np.divide(
            np.sum([total[place] for place in near], axis=0), n, out=np.full(len(n), np.nan), where=n > 0
        )
        means = np.where(np.isnan(means), mean, means)
    return means


def place_ranks(distance_m: ArrayLike, bearing_rad: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the ranks of distances and bearings among all of a table, both (n,)."""
    ranks = [
        np.unique(np.round(finite_numbers(name, values), 6), return_inverse=True)[1].astype(np.int64)
        for name, values in (("distance_m", distance_m), ("bearing_rad", bearing_rad))
    ]
    return ranks[0], ranks[1]
