"""The file of a round robot whose sensors are placed by a table of their readings."""

from __future__ import annotations

import math

import numpy as np

from realitygap.errors import LogError
from realitygap.world import toml_table

from ._range_table import RangeTable

REACH = 1.5
"""Farthest distance of the table times this is the reach of the sensors."""
CONE_DEG = 30
AMPLITUDE = 2.0
DECAY = 0.25
"""Share of the farthest distance in which readings fall to 1/e, before the fit."""
SAME_DIRECTION = 0.98
"""Length of the mean of unit vectors from which on sensors look in one direction: all within about 0.2 rad."""
SPEED, TRACK = 0.1, 1.8
"""Speed [m/s], and track in radii: a table does not show them."""

_HEAD = "# A round robot, made from a table of readings. Its numbers are chosen: calibrate it.\n"


def round_robot(table: RangeTable, radius: float, name: str, *, clockwise: bool) -> str:
    """Return the TOML text of a robot file: a disc with infrared sensors on its rim.

    Each sensor looks where it reads most.

    Args:
        table: Readings at bearings all around.
        radius: Radius of the disc [m].
        name: Name of the robot.
        clockwise: True if the bearings of the table grow clockwise.

    Raises:
        LogError: A sensor reads nothing, or the bearings of the table do not place the sensors.
    """
    if not np.ptp(table.bearing):
        raise LogError(
            "The table has no bearings, which would place the sensors. Write a robot file, and name it with --base."
        )
    bearing = table.bearing_left(clockwise=clockwise)
    farthest = float(table.distance.max())
    sensors, angles = [], []
    for k in range(table.n_sensors):
        at = table.sensor == k
        pull = np.sum(table.readings[at] ** 2 * np.exp(1j * bearing[at])) if at.any() else 0j
        if not abs(pull):
            raise LogError(f"Sensor {k} of the table reads nothing anywhere. Leave it out of the mapping.")
        angle = float(np.angle(pull))
        angles.append(angle)
        sensors.append(
            {
                "x": radius * math.cos(angle), "y": radius * math.sin(angle), "direction": angle,
                "cone_deg": CONE_DEG, "rays": 5, "reach": REACH * farthest + radius, "response": "ir",
                "amplitude": AMPLITUDE, "decay": DECAY * farthest,
            }
        )  # fmt: skip
    if len(angles) > 1 and np.abs(np.mean(np.exp(1j * np.array(angles)))) > SAME_DIRECTION:
        raise LogError(
            f"All {len(angles)} sensors of the table read most at about the same bearing, so bearings seem to count "
            "from each sensor's own direction. Such a table does not show where the sensors are. Write a robot file "
            "with their mounts, and name it with --base."
        )
    values = {
        "name": name,
        "description": f"A disc with {table.n_sensors} infrared sensors, made from a table of their readings.",
        "sources": ["chosen until measured: all but the radius and the directions of the sensors"],
        "drive": {"speed": SPEED, "track": TRACK * radius},
    }
    parts = [_HEAD + toml_table(values), "[[body]]\n" + toml_table({"radius": radius})]
    parts += ["[[range]]\n" + toml_table(sensor) for sensor in sensors]
    return "\n\n".join(parts) + "\n"
