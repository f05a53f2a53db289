"""The fit of one range sensor: its parameters with intervals, draws, and what speaks against it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from realitygap.calibration._posterior import level_ends, sample_posterior
from realitygap.world import Fitted, RangeSensor, RobotModel

from .._one_thread import one_blas_thread
from .._posterior import N_DRAWS
from .._prior import ENDS, Parameter, is_identified
from .._range_response import file_numbers
from ._checks import Independence, independence, predictive_check
from ._mixture import LorentzReadings, MixtureReadings, NearestReadings
from ._parameters import BATTERY
from ._pulses import PulseReadings
from ._readings import Array, Placement

LEAST_PLACEMENTS = 3
"""Minimum number of placements with which the correlation of readings is distinguished from their placement."""

MOST = 1 / 3
"""Share of the width of its prior that an identified parameter may have."""

NO_WALL = "{} never had a wall in view. Place the robot so that this sensor faces one."
"""The advice for a sensor that looked away from the wall in all placements."""

CURVE = 60
"""Distances of the fitted curve in a figure."""

SensorModel = PulseReadings | MixtureReadings


@dataclass(frozen=True)
class SensorFit:
    """The fit to the readings of a sensor.

    Attributes:
        name: Name of the sensor, such as range.0.
        fitted: Parameters of the sensor.
        numbers: The estimate by dotted name.
        draws: (n,) draws of each parameter, by dotted name.
        independence: Test of the independence of its readings.
        p: P value of the posterior predictive check.
        misfit: Share of the readings that differ from the fit, beyond chance.
        curve: Distances to a wall ahead along the nearest ray [m], mean, and ends of the 90 % band of readings.
    """

    name: str
    fitted: tuple[Fitted, ...]
    numbers: Mapping[str, float]
    draws: Mapping[str, Array]
    independence: Independence
    p: float
    misfit: float
    curve: Mapping[str, Array]


@one_blas_thread()
def fit_sensor(
    robot: RobotModel,
    number: int,
    placements: list[Placement],
    rng: np.random.Generator,
) -> SensorFit:
    """Fit a sensor to its readings at placements of the robot.

    Args:
        robot: Robot with the numbers that are not fitted: response, reach, cone, and pulses.
        number: Number of its range sensor.
        placements: Placements with readings, at least one.
        rng: Random numbers.

    Raises:
        ValueError: There are no readings.
    """
    sensor = robot.range[number]
    placements = [placement for placement in placements if len(placement.readings)]
    if not placements:
        raise ValueError(
            f"There are no readings of range.{number}: expected readings of a robot that does not move."
        )
    apart = independence(placements, rng)
    model = _model(robot, number, placements, apart.weight)

    def log_likelihood(places: Array) -> Array:
        return model.log_likelihood(_values(model, places))

    places = sample_posterior(log_likelihood, len(model.parameters), rng)
    ends = _ends(places, level_ends(log_likelihood, places, rng))
    values = _values(model, places)
    chosen = rng.choice(len(values), N_DRAWS, replace=len(values) < N_DRAWS)
    name = f"range.{number}"
    centers = {
        parameter.name: _center(parameter, values[:, k]) for k, parameter in enumerate(model.parameters)
    }
    advice = "" if np.any(model.places.near < sensor.reach) else NO_WALL.format(name)
    fitted = tuple(
        _fitted(name, parameter, ends[:, k], values[:, k], advice)
        for k, parameter in enumerate(model.parameters)
    )
    # what a sensor that saw no wall does not tell stays as the robot's file has it, and not in the middle of its prior
    is_own = {
        parameter.name: parameter.name != BATTERY.name and (row.identified or not advice)
        for parameter, row in zip(model.parameters, fitted, strict=True)
    }
    numbers = {key: value for key, value in centers.items() if is_own[key]}
    draws = {
        parameter.name: values[chosen, k]
        for k, parameter in enumerate(model.parameters)
        if is_own[parameter.name]
    }
    return SensorFit(
        name,
        fitted + ((_unknown_battery(name),) if _may_sag(sensor) and not model.places.battery_varied else ()),
        {f"{name}.{key}": value for key, value in file_numbers(numbers, sensor).items()},
        {f"{name}.{key}": drawn for key, drawn in file_numbers(draws, sensor).items()},
        apart,
        *predictive_check(model.probabilities(values[chosen]), model.counts, rng),
        _curve(model, sensor.cone, sensor.rays, sensor.direction, values[chosen]),
    )


def _model(robot: RobotModel, number: int, placements: list[Placement], weight: float) -> SensorModel:
    sensor = robot.range[number]
    if sensor.response == "pulses":
        return PulseReadings(placements, sensor.reach, sensor.pulses, weight, sensor)
    if sensor.response == "lorentz":
        return LorentzReadings(placements, sensor, weight)
    if sensor.response in ("linear", "table"):
        return NearestReadings(placements, sensor, weight)
    return MixtureReadings(placements, sensor.reach, weight, sensor)


def _may_sag(sensor: RangeSensor) -> bool:
    """Return whether readings may change with the battery: those of light that comes back do."""
    return sensor.response in ("ir", "pulses")


def _values(model: SensorModel, places: Array) -> Array:
    """Return parameters at places (m, d) in the unit cube, (m, d)."""
    return np.stack(
        [parameter.prior.of(places[:, k]) for k, parameter in enumerate(model.parameters)], axis=1
    )


def _ends(places: Array, level: Array) -> Array:
    """Return the ends of the 90 % intervals, (2, d) places: of the posterior, and beyond it what is not refuted."""
    low, high = np.quantile(places, ENDS, axis=0)
    return np.stack([np.minimum(low, level[0]), np.maximum(high, level[1])])


def _center(parameter: Parameter, values: Array) -> float:
    """Return the center of samples.

    A decay is averaged as 1 / L: with log A it makes the readings' logarithms straight lines, so that the average
    of draws that agree with what was read agrees with it, too.
    """
    if parameter.name == "decay":
        return float(1 / np.mean(1 / values))
    return float(np.exp(np.mean(np.log(values)))) if parameter.is_ratio else float(np.mean(values))


def _fitted(name: str, parameter: Parameter, ends: Array, values: Array, advice: str = "") -> Fitted:
    low, high = parameter.prior.of(ends)
    identified = is_identified(float(np.ptp(ends)), ENDS[1] - ENDS[0], MOST)
    return Fitted(
        name=f"{name}.{parameter.name}",
        estimate=_center(parameter, values),
        low=float(low),
        high=float(high),
        prior_low=parameter.prior.lowest,
        prior_high=parameter.prior.highest,
        identified=identified,
        unit=parameter.unit,
        advice="" if identified else advice or parameter.advice,
    )


def _unknown_battery(name: str) -> Fitted:
    """Return the battery's effect as unidentified, because the battery did not vary."""
    return Fitted(
        name=f"{name}.{BATTERY.name}",
        estimate=0.0,
        low=BATTERY.prior.lowest,
        high=BATTERY.prior.highest,
        prior_low=BATTERY.prior.lowest,
        prior_high=BATTERY.prior.highest,
        identified=False,
        unit=BATTERY.unit,
        advice=BATTERY.advice,
    )


def _curve(model: SensorModel, cone: float, rays: int, direction: float, values: Array) -> dict[str, Array]:
    """Return the reading of the fit before a wall: one that the robot faces, or turns its back to for a rear sensor."""
    if math.cos(direction) < 0:
        direction += math.pi
    near = np.linspace(0.0, 1.1 * max(model.places.near.max(), 0.1), CURVE)
    angles = direction + (np.linspace(-cone, cone, rays) if rays > 1 else np.zeros(1))
    cosines = np.maximum(np.cos(angles), 1e-3)
    distances = np.minimum(near[:, None] * cosines.max() / cosines, model.places.reach)
    mean, (low, high) = model.quantiles(
        values, distances, np.broadcast_to(cosines, distances.shape), np.array(ENDS)
    )
    return {"distances_m": near, "mean": mean, "low": low, "high": high}
