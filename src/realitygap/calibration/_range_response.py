"""The mean readings of range sensors along a straight wall, and the numbers that are fitted, for each response."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np

from realitygap.world import RangeSensor, RobotModel

from ._prior import Deviation
from ._simulate import Bools, Floats

Value = TypeVar("Value", float, Floats)

LEAST_COSINE = 1e-3
"""Minimum cosine of the angle between a ray and the normal of a wall. A flatter ray meets no wall."""

WIDEST_LORENTZ = math.pi / 2 - 1e-3
"""Maximum half angle of a cone with the response `lorentz` [rad]."""

TABLE_DISTANCE = "table_distance"
"""The factor of all distances in the table of a sensor with the response `table`; 1 as in the robot file."""


NEARER = "Record nearer to the wall."
DISTANCES = "Record at more distances at which readings are between 0 and 1."
BEARINGS = "Record at more bearings, to both sides of the sensor."
FARTHER = "Record at more distances at which readings begin to fail, and beyond them."

AMPLITUDE = Deviation("amplitude", "ratio", 3.0, "", NEARER, least=0.01, usual=2.0)
DECAY = Deviation("decay", "ratio", 1.0, "m", DISTANCES, least=1e-4, usual=0.25)
DIRECTION = Deviation("direction", "plus", 0.3, "rad", BEARINGS)
CONE = Deviation("cone", "ratio", 0.7, "rad", BEARINGS, least=0.02, limits=(0.0, math.pi), usual=0.2)
INCIDENCE = Deviation("incidence", "ratio", 1.5, "", BEARINGS, least=0.3, usual=1.0)
COMPRESSION = Deviation(
    "compression",
    "ratio",
    1.5,
    "",
    "Record at more distances at which readings are between 0.5 and 1.",
    least=0.3,
    usual=0.3,
)
HALF_WIDTH = Deviation("half_width", "ratio", 0.7, "m", DISTANCES, least=1e-3)
REACH = Deviation("reach", "ratio", 0.5, "m", DISTANCES, least=1e-3)
DROP = (
    Deviation("drop_most", "plus", 0.3, "", FARTHER, limits=(0.0, 1.0)),
    Deviation("drop_at", "ratio", 1.0, "m", FARTHER, least=1e-3),
    Deviation("drop_width", "ratio", 1.0, "m", FARTHER, least=1e-4),
)
OUTLIER = tuple(replace(each, name=each.name.replace("drop", "outlier")) for each in DROP)
SCALE = Deviation(TABLE_DISTANCE, "ratio", 0.3, "", DISTANCES)

OF_RESPONSE = {
    "ir": (AMPLITUDE, DECAY, DIRECTION, CONE, INCIDENCE, COMPRESSION),
    "pulses": (AMPLITUDE, DECAY, DIRECTION, CONE, INCIDENCE),
    "lorentz": (AMPLITUDE, HALF_WIDTH, DIRECTION, CONE),
    "linear": (REACH, DIRECTION, CONE),
    "table": (SCALE, DIRECTION, CONE),
}
"""Numbers that decide the mean reading. Priors are wide: tables are made because little is known."""

NAMES = tuple(dict.fromkeys(number.name for numbers in OF_RESPONSE.values() for number in numbers))


def numbers_to_fit(sensor: RangeSensor) -> tuple[Deviation, ...]:
    """Return the numbers of a sensor that decide its mean readings. A sensor of one ray has no cone."""
    numbers = [number for number in OF_RESPONSE[sensor.response] if number is not CONE or sensor.rays > 1]
    if sensor.response == "lorentz":
        peak = abs(float(getattr(sensor.peak, "center", sensor.peak)))
        limits = {CONE: (0.0, WIDEST_LORENTZ), HALF_WIDTH: (1.01 * peak, math.inf)}
        numbers = [replace(number, limits=limits.get(number, number.limits)) for number in numbers]
    numbers += [
        Deviation(f"table.{k}.reading", "plus", 0.3, "", DISTANCES, limits=(0.0, 1.0))
        for k in range(len(sensor.table))
    ]
    numbers += DROP if _is_above_0(sensor.drop_most) else ()
    numbers += OUTLIER if _is_above_0(sensor.outlier_most) and sensor.response != "pulses" else ()
    return tuple(numbers)


def _is_above_0(value: float) -> bool:
    return float(getattr(value, "center", value)) > 0


def numbers_in_file(robot: RobotModel, k: int) -> dict[str, float]:
    """Return all numbers of a range sensor by name, the centers of distributions, and `TABLE_DISTANCE`."""
    start = f"range.{k}."
    own = {
        name.removeprefix(start): value for name, value in robot.centers().items() if name.startswith(start)
    }
    return own | {TABLE_DISTANCE: 1.0}


def file_numbers(values: Mapping[str, Value], sensor: RangeSensor) -> dict[str, Value]:
    """Return values of `numbers_to_fit`, or arrays of them, by the names of the robot file."""
    own = dict(values)
    scale = own.pop(TABLE_DISTANCE, None)
    if scale is not None:
        own |= {f"table.{k}.distance": scale * each.distance for k, each in enumerate(sensor.table)}
    return own


def wall_reading(gap: Floats, bearing: Floats, numbers: Mapping[str, float], sensor: RangeSensor) -> Floats:
    """Return the (n,) mean readings along a straight wall, as kernels/sim/ranges.py and kernels/sim/noise.py.

    Differs: Pulses are not rounded, and noise of gain is not cut off at 0 and 1.

    Args:
        gap: (n,) distance from the mount to the wall [m].
        bearing: (n,) bearing of the wall from the body's heading [rad].
        numbers: All numbers of the sensor by name, as `numbers_in_file` has them.
        sensor: The sensor, which has the response and the number of rays.
    """
    reach = numbers["reach"]
    part = np.linspace(-1.0, 1.0, sensor.rays) if sensor.rays > 1 else np.zeros(1)
    cosine = np.cos(numbers["direction"] + numbers["cone"] * part - bearing[:, None])
    meets = cosine > LEAST_COSINE
    cosine = np.where(meets, cosine, 1.0)
    distance = np.maximum(gap[:, None], 0.0) / cosine
    meets &= distance < reach
    distance = np.where(meets, distance, reach)
    near = distance.min(axis=1)
    dim = near
    if sensor.response == "linear":
        reading = (reach - near) / reach
    elif sensor.response == "table":
        at = [numbers[f"table.{k}.distance"] for k in range(len(sensor.table))]
        reading = np.interp(
            near / numbers[TABLE_DISTANCE], at, [numbers[f"table.{k}.reading"] for k in range(len(at))]
        )
    elif sensor.response == "lorentz":
        reading = _lorentz(distance, near, numbers, sensor)
    else:
        reading, dim = _light(distance, cosine, meets, near, numbers, part)
        c = numbers["compression"]
        if c and sensor.response == "ir":
            reading = np.log1p(c * reading) / c
    reading = np.clip(reading, 0.0, 1.0)
    missed = _logistic(dim, numbers, "drop")
    if sensor.response == "pulses":
        return np.asarray(reading * (1.0 - missed))
    outlier = _logistic(dim, numbers, "outlier")
    return np.asarray(reading * (1.0 - missed - outlier) + 0.5 * outlier)


def _light(
    distance: Floats, cosine: Floats, meets: Bools, near: Floats, numbers: Mapping[str, float], part: Floats
) -> tuple[Floats, Floats]:
    """Return the light of all rays, and the distance that decides whether a reading is missed."""
    weights = 1.0 - 0.5 * part**2
    faced = np.exp(-distance / numbers["decay"]) * meets * (weights / weights.sum())
    slanted = faced * cosine / (cosine + numbers["incidence"] * (1.0 - cosine))
    all_of_it, back = faced.sum(axis=1), slanted.sum(axis=1)
    is_some = back > 0
    ratio = np.where(is_some, all_of_it, 1.0) / np.where(is_some, back, 1.0)
    return numbers["amplitude"] * back, near + numbers["decay"] * np.log(ratio)


def _lorentz(distance: Floats, near: Floats, numbers: Mapping[str, float], sensor: RangeSensor) -> Floats:
    reach, half_width, peak = numbers["reach"], numbers["half_width"], numbers["peak"]
    width = max(half_width**2 - peak**2, 1e-12)

    def uncut(d: Floats | float) -> Floats:
        past = np.maximum(np.asarray(d) - peak, 0.0)
        return np.asarray(numbers["amplitude"] * width / (past**2 + width))

    def response(d: Floats) -> Floats:
        return np.where(d < reach, uncut(d), 0.0)

    back = response(distance).sum(axis=1)
    if sensor.rays > 1:
        back = back - 2 * response(distance[:, sensor.rays // 2] / math.cos(numbers["cone"]))
    if sensor.keeps_edge:
        lost = np.where(near < reach, (distance >= reach).sum(axis=1), 0)
        back = back + lost * uncut(reach)
    return np.asarray(back)


def _logistic(far: Floats, numbers: Mapping[str, float], kind: str) -> Floats:
    """Return a probability that rises with distance, (n,)."""
    most = numbers[f"{kind}_most"]
    if not most:
        return np.zeros(len(far))
    steps = np.clip((far - numbers[f"{kind}_at"]) / numbers[f"{kind}_width"], -50.0, 50.0)
    return np.asarray(most / (1.0 + np.exp(-steps)))
