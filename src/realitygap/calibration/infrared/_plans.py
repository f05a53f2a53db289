"""The placements for the calibration of range sensors, and their readings.

Source: Rosenzweig & Remy, section 2.3: fifty readings at each distance, 3 in apart. Differs: each distance gets at
least three placements, in rounds, so that the fit does not mistake a falling battery for distance, or a crooked
placement for the sensor. A sensor with a reach below 18 in is placed relative to its reach, because its readings fall
off nearby. A robot with sensors at its back also stands with its back to the wall.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from realitygap.calibration.infrared._readings import rays_of
from realitygap.records import TrialRecord
from realitygap.trials import TrialPlan
from realitygap.world import INCH, Arena, Pose, RobotModel

from ._parameters import FARTHEST
from ._readings import Placement

READINGS = 50
"""Readings at each placement."""

SPACING = 3 * INCH
"""Distance between placements [m]."""

FEWEST_SPACINGS = 6
"""Spacings within the reach below which distances are parts of the reach."""

PARTS = tuple(2.0 ** (-k / 2) for k in range(10, 0, -1))
"""Parts of the reach: 1/32 first, each larger than the one before by the root of 2."""

PLACEMENTS = 3
"""Placements at each distance and heading, if there is no budget."""

SENSORS = "sensors"
"""The purpose of these trials."""

FACING, TURNED = 0.0, math.pi
"""Headings of a robot that faces the right wall, and of one that turns its back to it [rad]."""


def sensor_headings(robot: RobotModel) -> list[float]:
    """Return the headings at which a robot is placed [rad]: facing the wall, and turned if a sensor looks back."""
    looks_back = any(math.cos(sensor.direction) < 0 for sensor in robot.range)
    return [FACING, TURNED] if looks_back else [FACING]


def sensor_distances(robot: RobotModel, heading: float = FACING) -> list[float]:
    """Return distances from the wall to the nearest range sensor within its reach [m]: multiples of 3 in, or parts.

    Args:
        robot: The robot.
        heading: `FACING` or `TURNED`.

    Raises:
        ValueError: The robot has no range sensor.
    """
    reach = robot.reach
    if not reach:
        raise ValueError(f"Robot {robot.name!r} has no range sensor: there is nothing to fit.")
    n = math.floor(reach / SPACING)
    if n >= FEWEST_SPACINGS:
        return [k * SPACING for k in range(1, n + 1)]
    way = math.cos(heading)
    rim = max(way * x for part in robot.body for x, _ in part.outline())
    recess = max(rim - _foremost(robot, heading), 0.0)  # nearer, the wall would push the body back
    return [recess + part * (reach - recess) for part in PARTS]


def sensor_plans(arena: Arena, robot: RobotModel, n: int | None = None) -> list[TrialPlan]:
    """Return placements before the arena's right wall, in rounds over the distances and headings.

    Args:
        arena: An arena with a wall at the greatest x.
        robot: The robot whose foremost range sensor is at these distances from the wall. If one of its sensors looks
            back, the robot is also placed with its back to the wall, its rearmost sensor at these distances.
        n: Total number of placements. Default: three at each distance and heading.

    Raises:
        ValueError: The arena or the robot does not allow it.
    """
    nearest = sensor_distances(robot)[0]
    if not arena.walls:
        raise ValueError(f"Arena {arena.name!r} has no wall to face.")
    xs = [x for wall in arena.walls for x in wall[::2]]
    ys = [y for wall in arena.walls for y in wall[1::2]]
    middle = (min(ys) + max(ys)) / 2
    headings = sensor_headings(robot)
    starts = []
    for distances in zip(*(sensor_distances(robot, heading) for heading in headings), strict=True):
        for distance, heading in zip(distances, headings, strict=True):
            front = _foremost(robot, heading)
            rim = max(math.cos(heading) * x for part in robot.body for x, _ in part.outline())
            if rim - front < distance <= max(xs) - min(xs) - front - robot.radius:
                starts.append(Pose(max(xs) - front - distance, middle, heading))
    if not starts:
        raise ValueError(f"Arena {arena.name!r} is too short to place a robot {nearest:.3g} m from a wall.")
    n = PLACEMENTS * len(starts) if n is None else n
    return [
        TrialPlan(
            start=starts[k % len(starts)],
            commands=np.zeros((READINGS, 2)),
            number=k,
            purpose=SENSORS,
        )
        for k in range(n)
    ]


def distance_of(plan: TrialPlan, arena: Arena, robot: RobotModel) -> float:
    """Return the distance from the nearest range sensor to the wall, in a plan of `sensor_plans` [m]."""
    start = plan.start or arena.start
    right = max(x for wall in arena.walls for x in wall[::2])
    return right - start.x - _foremost(robot, start.heading)


def _foremost(robot: RobotModel, heading: float) -> float:
    """Return the distance of the sensor nearest to the right wall from the body's origin, toward the wall [m]."""
    return max(math.cos(heading) * sensor.x for sensor in robot.range)


def placements_of(trials: Sequence[TrialRecord], robot: RobotModel, arena: Arena) -> list[list[Placement]]:
    """Return the placements of each range sensor, shape (s,), from all trials in which the robot stood."""
    placements: list[list[Placement]] = [[] for _ in robot.range]
    for trial in trials:
        if not len(trial.readings) or np.any(trial.commands != 0):
            continue
        pose = np.array([trial.poses[0] if len(trial.poses) else trial.start], np.float64)
        for k, sensor in enumerate(robot.range):
            if sensor.response == "linear":  # its own reach is fitted, and may be farther
                sensor = sensor.model_copy(update={"reach": FARTHEST * sensor.reach})
            (distances,), (cosines,) = rays_of(sensor, pose, arena)
            readings = trial.readings[:, k]
            placements[k].append(
                Placement(distances, readings, trial.battery_v, cosines, place=tuple(trial.start))
            )
    return placements
