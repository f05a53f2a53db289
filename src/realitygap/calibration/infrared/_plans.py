"""The placements for the calibration of range sensors, and their readings.

Source: Rosenzweig & Remy, section 2.3: fifty readings at each distance, 3 in apart. Differs: at least three placements
at each distance, in rounds, so that a battery that drains is not taken for distance, nor a crooked placement for the
sensor. A sensor that sees less than 18 in far is placed relative to its reach, as its readings fall off nearby.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from realitygap.calibration._rays import rays_of
from realitygap.records import TrialRecord
from realitygap.trials import TrialPlan
from realitygap.world import INCH, Arena, Pose, RobotModel

from ._readings import Placement, refuse_response

READINGS = 50
"""At each placement."""

SPACING = 3 * INCH
"""Between distances [m]."""

FEWEST_SPACINGS = 6
"""Spacings within the reach below which distances are parts of the reach."""

PARTS = tuple(2.0 ** (-k / 2) for k in range(10, 0, -1))
"""Of the reach: from 1/32 of it on, each the root of 2 of the one before."""

PLACEMENTS = 3
"""At each distance, where no budget says otherwise."""

SENSORS = "sensors"
"""The purpose of these trials."""


def sensor_distances(robot: RobotModel) -> list[float]:
    """Return distances from the wall to the foremost range sensor within its reach [m]: multiples of 3 in, or parts.

    Raises:
        ValueError: The robot has no range sensor.
    """
    reach = max((sensor.reach for sensor in robot.range), default=0.0)
    if not reach:
        raise ValueError(f"Robot {robot.name!r} has no range sensor: there is nothing to fit.")
    n = math.floor(reach / SPACING)
    if n >= FEWEST_SPACINGS:
        return [k * SPACING for k in range(1, n + 1)]
    rim = max(x for part in robot.body for x, _ in part.outline())
    recess = max(
        rim - max(sensor.x for sensor in robot.range), 0.0
    )  # nearer, the wall would push the body back
    return [recess + part * (reach - recess) for part in PARTS]


def sensor_plans(arena: Arena, robot: RobotModel, n: int | None = None) -> list[TrialPlan]:
    """Placements before the arena's right wall, in rounds over the distances.

    Args:
        arena: With a wall at the greatest x.
        robot: Whose foremost range sensor is at these distances from it.
        n: Placements in all; three at each distance when not given.

    Raises:
        ValueError: The arena or the robot does not allow it.
    """
    for k, sensor in enumerate(robot.range):
        refuse_response(robot, k, sensor.response)
    distances = sensor_distances(robot)
    if not arena.walls:
        raise ValueError(f"Arena {arena.name!r} has no wall to face.")
    xs = [x for wall in arena.walls for x in wall[::2]]
    ys = [y for wall in arena.walls for y in wall[1::2]]
    front = max(sensor.x for sensor in robot.range)
    room = max(xs) - min(xs) - front - robot.radius
    distances = [distance for distance in distances if distance <= room]
    if not distances:
        raise ValueError(
            f"Arena {arena.name!r} is too short to place a robot {sensor_distances(robot)[0]:.3g} m from a "
            "wall."
        )
    n = PLACEMENTS * len(distances) if n is None else n
    middle = (min(ys) + max(ys)) / 2
    return [
        TrialPlan(
            start=Pose(max(xs) - front - distances[k % len(distances)], middle, 0.0),
            commands=np.zeros((READINGS, 2)),
            number=k,
            purpose=SENSORS,
        )
        for k in range(n)
    ]


def distance_of(plan: TrialPlan, arena: Arena, robot: RobotModel) -> float:
    """From the foremost range sensor to the wall, in a plan of `sensor_plans` [m]."""
    start = plan.start or arena.start
    right = max(x for wall in arena.walls for x in wall[::2])
    return right - start.x - max(sensor.x for sensor in robot.range)


def placements_of(trials: Sequence[TrialRecord], robot: RobotModel, arena: Arena) -> list[list[Placement]]:
    """(s,) the placements of each range sensor, of all trials in which the robot stood."""
    placements: list[list[Placement]] = [[] for _ in robot.range]
    for trial in trials:
        if not len(trial.readings) or np.any(trial.commands != 0):
            continue
        pose = np.array([trial.poses[0] if len(trial.poses) else trial.start], np.float64)
        for k, sensor in enumerate(robot.range):
            (distances,), (cosines,) = rays_of(sensor, pose, arena)
            readings = trial.readings[:, k]
            placements[k].append(
                Placement(distances, readings, trial.battery_v, cosines, place=tuple(trial.start))
            )
    return placements
