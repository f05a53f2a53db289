"""A table of readings along a straight wall: how its places count, and what is expected to be read there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from realitygap.errors import finite_numbers
from realitygap.world import Distribution, RobotModel

from ._range_response import numbers_in_file, wall_reading
from ._simulate import Floats, Ints

MeasuredFrom = Literal["body", "origin", "sensor"]
BearingFrom = Literal["body", "sensor"]

FARTHEST = 6
"""Places of the table between an unseen reading and those that it is looked up from, at most."""


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

    @classmethod
    def of(cls, measured_from: MeasuredFrom, bearing_from: BearingFrom | None = None) -> Self:
        """Return a checked frame. Default of bearings: as distances.

        Raises:
            ValueError: There is no such point, or no such direction.
        """
        if measured_from not in ("body", "origin", "sensor"):
            raise ValueError(f"measured_from is {measured_from!r}, expected 'body', 'origin' or 'sensor'.")
        bearing_from = bearing_from or ("sensor" if measured_from == "sensor" else "body")
        if bearing_from not in ("body", "sensor"):
            raise ValueError(f"bearing_from is {bearing_from!r}, expected 'body' or 'sensor'.")
        return cls(measured_from, bearing_from)

    def bearings(self, sensor: Ints, bearing: Floats, robot: RobotModel) -> Floats:
        """Return the bearing of the wall from the body's heading, (n,) [rad], for bearings that grow to the left."""
        if self.bearing_from == "body":
            return bearing
        return np.asarray(bearing + np.array([_center(device.direction) for device in robot.range])[sensor])

    def gaps(
        self, sensor: Ints, distance: Floats, bearing: Floats, robot: RobotModel
    ) -> tuple[Floats, Floats]:
        """Return distances from the sensors' mounts to the wall [m], and the wall's bearings from the heading [rad]."""
        bearing = self.bearings(sensor, bearing, robot)
        if self.measured_from == "sensor":
            return distance, bearing
        mounts = np.array([[_center(device.x), _center(device.y)] for device in robot.range])[sensor]
        normal = np.stack([np.cos(bearing), np.sin(bearing)], axis=1)
        gap = distance - (normal * mounts).sum(axis=1)
        if self.measured_from == "body":
            reach = [(normal @ np.array(part.corners).T).max(axis=1) + part.radius for part in robot.body]
            gap = gap + np.max(reach, axis=0)
        return gap, bearing


def _center(value: float | Distribution) -> float:
    return value.center if isinstance(value, Distribution) else value


def place_ranks(distance_m: ArrayLike, bearing_rad: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the ranks of distances and bearings among all of a table, both (n,)."""
    ranks = [
        np.unique(np.round(finite_numbers(name, values), 6), return_inverse=True)[1].astype(np.int64)
        for name, values in (("distance_m", distance_m), ("bearing_rad", bearing_rad))
    ]
    return ranks[0], ranks[1]


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
    gap, bearing = TableFrame.of(measured_from, bearing_from).gaps(which, distance, bearing, robot)
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
