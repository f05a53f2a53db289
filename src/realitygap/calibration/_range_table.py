"""The fit of range sensors to a table of readings along a straight wall, by distance and bearing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from realitygap.world import Fitted, RobotModel

from ._held_out import HeldOut, HeldOutFit
from ._simulate import Bools, Floats, Ints

MeasuredFrom = Literal["body", "origin", "sensor"]

N_DRAWS = 200
ENDS = (0.05, 0.95)
LEAST_PLACES = 20
"""Readings of a sensor in the part that is fitted."""

BETWEEN = (0.03, 1.0)
"""Readings that are neither nothing nor full."""

IDENTIFIED = 0.5
"""A parameter is identified if its interval is narrower than this share of its prior's."""

NOISE = 0.05
"""Standard deviation of readings around the response that the prior is weighed against."""

STEP = 1e-4
"""Step of finite differences, in standard deviations of the prior."""

MOST_STEPS, MOST_DAMPING, ENOUGH = 200, 1e8, 1e-5
"""Limits of least squares. A step that gains less than the share `ENOUGH` is the last."""

LEAST_COSINE = 1e-3
"""Minimum cosine of the angle between a ray and the normal of a wall. A flatter ray meets no wall."""

METHOD = (
    "Least squares of readings between 0 and 1 with a normal prior, response as in `sim`; distances that were set "
    "together may be off together; intervals from the sandwich covariance, clustered by distance (White 1982)."
)


@dataclass(frozen=True)
class Number:
    """A number of a range sensor with its prior.

    Attributes:
        name: Name, the same as in the robot's file.
        kind: ratio: its logarithm is normal around `middle`; plus: it is normal around the robot's own.
        spread: Standard deviation of the prior.
        unit: Unit of its values.
        advice: Data to record if it is not identified.
    """

    name: str
    kind: Literal["ratio", "plus"]
    spread: float
    unit: str
    advice: str


NUMBERS = (
    Number("amplitude", "ratio", 3.0, "", "Record nearer to the wall."),
    Number("decay", "ratio", 1.0, "m", "Record at more distances at which readings are between 0 and 1."),
    Number("direction", "plus", 0.3, "rad", "Record at more bearings, to both sides of the sensor."),
    Number("cone", "ratio", 0.7, "rad", "Record at more bearings, to both sides of the sensor."),
    Number("incidence", "ratio", 1.5, "", "Record at more bearings, to both sides of the sensor."),
    Number(
        "compression", "ratio", 1.5, "", "Record at more distances at which readings are between 0.5 and 1."
    ),
)
"""Priors are wide: tables are made because little is known."""

LEAST = {"cone": 0.02, "incidence": 0.3, "compression": 0.3, "amplitude": 0.01, "decay": 1e-4}
"""The middle of a prior of ratios is at least this."""


@dataclass(frozen=True)
class RangeTableFit(HeldOutFit):
    """Range sensors fitted to a table; attributes as in `HeldOutFit`."""

    method: str = METHOD


def fit_range_table(
    sensor: ArrayLike,
    distance_m: ArrayLike,
    bearing_rad: ArrayLike,
    readings: ArrayLike,
    robot: RobotModel,
    *,
    measured_from: MeasuredFrom = "body",
    hold_out: bool = True,
    shared: Sequence[str] = ("compression",),
    distance_sd_m: float = 0.0005,
    seed: int = 0,
) -> RangeTableFit:
    """Fit range sensors to readings along a long, straight wall, and predict the places that the fit does not see.

    Args:
        sensor: (n,) index of the range sensor in the robot's file.
        distance_m: (n,) shortest distance to the wall [m].
        bearing_rad: (n,) direction from the robot to the nearest point of the wall, positive to the left of the
            heading [rad].
        readings: (n,) 0 to 1.
        robot: The robot with its nominal numbers; mounts, reach, rays and response stay.
        measured_from: The point that distances are measured from: the body's outline, its origin, or the sensor's
            mount. With "sensor", bearings count from the direction in which the sensor looks.
        hold_out: True to leave out every second place, like a chessboard over distances and bearings.
        shared: Numbers that have one value for all sensors; the others differ.
        distance_sd_m: Standard deviation of the error of each distance, which all places at that distance share [m]; 0
            to take distances as they are written.
        seed: Seed of the draws.

    Returns:
        The fit, with the root mean square error of nominal and fitted numbers at the places that the fit did not see,
        with distances as they are written. `held_out.more` also has the errors with distances as corrected.

    Raises:
        ValueError: The arrays do not fit together, a sensor is not in the robot's file, or its response is not `ir`.
    """
    table = _Table.of(sensor, distance_m, bearing_rad, readings, robot, measured_from, hold_out=hold_out)
    if not 0.0 <= distance_sd_m < 0.1:
        raise ValueError(f"distance_sd_m is {distance_sd_m:g}, expected 0 to 0.1 m.")
    problem = _Problem.of(table, robot, shared, distance_sd_m)
    best, spread = problem.solve()
    rng = np.random.default_rng(seed)
    draws = best + rng.standard_normal((N_DRAWS, len(best))) @ np.linalg.cholesky(spread).T
    numbers = problem.numbers(best)
    drawn = [problem.numbers(row) for row in draws]
    off = 1000 * problem.off_by(best)
    held_out = _compare(problem, best) if hold_out else None
    return RangeTableFit(
        tuple(problem.fitted(best, spread)),
        numbers,
        {name: tuple(each[name] for each in drawn) for name in numbers},
        held_out,
        held_out.recommended if held_out else "fitted",
        notes=(f"Distances are off by {np.sqrt(np.mean(off**2)):.2f} mm (root mean square).",)
        if len(off)
        else (),
        evidence={"distance_off_mm": np.round(off, 3).tolist()},
    )


@dataclass(frozen=True)
class _Table:
    """Places by sensor."""

    sensor: Ints
    gap: Floats  # from the sensor's mount to the wall [m]
    bearing: Floats  # of the wall, from the body's heading [rad]
    readings: Floats
    seen: Bools
    place: tuple[Ints, Ints]  # ranks of distance and bearing

    @classmethod
    def of(
        cls,
        sensor: ArrayLike,
        distance_m: ArrayLike,
        bearing_rad: ArrayLike,
        readings: ArrayLike,
        robot: RobotModel,
        measured_from: MeasuredFrom,
        *,
        hold_out: bool,
    ) -> _Table:
        which = np.asarray(sensor)
        columns = {"distance_m": distance_m, "bearing_rad": bearing_rad, "readings": readings}
        arrays = {name: np.asarray(values, np.float64) for name, values in columns.items()}
        if which.ndim != 1 or not len(which):
            raise ValueError(f"sensor has shape {which.shape}, expected (n,): one index for each reading.")
        for name, values in arrays.items():
            if values.shape != which.shape:
                raise ValueError(f"{name} has shape {values.shape}, expected {which.shape}, as sensor has.")
            if not np.isfinite(values).all():
                raise ValueError(
                    f"{name} has no number in row {int(np.flatnonzero(~np.isfinite(values))[0])}."
                )
        index = which.astype(np.int64)
        if np.any(index != which) or index.min() < 0 or index.max() >= len(robot.range):
            raise ValueError(
                f"sensor goes from {which.min()} to {which.max()}, expected whole numbers from 0 to "
                f"{len(robot.range) - 1}: the range sensors of robot {robot.name!r}."
            )
        if np.any(arrays["readings"] < 0) or np.any(arrays["readings"] > 1):
            worst = arrays["readings"].min() if arrays["readings"].min() < 0 else arrays["readings"].max()
            raise ValueError(
                f"A reading is {worst:g}, expected 0 (nothing) to 1 (full). Divide by the full scale."
            )
        if arrays["distance_m"].min() < 0:
            raise ValueError(f"A distance is {arrays['distance_m'].min():g} m, expected at least 0.")
        for k in np.unique(index):
            if robot.range[k].response != "ir":
                raise ValueError(f"range.{k} has the response {robot.range[k].response!r}, expected 'ir'.")
        gap, bearing = gaps_to_wall(index, arrays["distance_m"], arrays["bearing_rad"], robot, measured_from)
        ranks = tuple(
            np.unique(np.round(arrays[name], 6), return_inverse=True)[1]
            for name in ("distance_m", "bearing_rad")
        )
        seen = (ranks[0] + ranks[1]) % 2 == 0 if hold_out else np.ones(len(index), np.bool_)
        for k in np.unique(index):
            n = int((seen & (index == k)).sum())
            if n < LEAST_PLACES:
                raise ValueError(f"The fit sees {n} readings of range.{k}, expected at least {LEAST_PLACES}.")
        return cls(index, gap, bearing, arrays["readings"], seen, (ranks[0], ranks[1]))


def gaps_to_wall(
    sensor: Ints, distance: Floats, bearing: Floats, robot: RobotModel, measured_from: MeasuredFrom
) -> tuple[Floats, Floats]:
    """Return the distance from each sensor's mount to the wall [m], and the wall's bearing from the heading [rad]."""
    mounts = np.array([[s.x, s.y, s.direction] for s in robot.range])[sensor]
    if measured_from == "sensor":
        return distance, bearing + mounts[:, 2]
    if measured_from not in ("body", "origin"):
        raise ValueError(f"measured_from is {measured_from!r}, expected 'body', 'origin' or 'sensor'.")
    normal = np.stack([np.cos(bearing), np.sin(bearing)], axis=1)
    gap = distance - (normal * mounts[:, :2]).sum(axis=1)
    if measured_from == "body":
        reach = [(normal @ np.array(part.corners).T).max(axis=1) + part.radius for part in robot.body]
        gap = gap + np.max(reach, axis=0)
    return gap, bearing


@dataclass(frozen=True)
class _Problem:
    """A table, and the numbers that are fitted to it."""

    table: _Table
    robot: RobotModel
    free: tuple[tuple[Number, tuple[int, ...]], ...]  # a number, and the sensors that have it
    distance_sd: float

    @classmethod
    def of(cls, table: _Table, robot: RobotModel, shared: Sequence[str], distance_sd: float) -> _Problem:
        unknown = sorted(set(shared) - {number.name for number in NUMBERS})
        if unknown:
            expected = ", ".join(number.name for number in NUMBERS)
            raise ValueError(f"shared has {unknown[0]!r}, expected some of {expected}.")
        sensors = tuple(int(k) for k in np.unique(table.sensor))
        free: list[tuple[Number, tuple[int, ...]]] = []
        for number in NUMBERS:
            free += [(number, sensors)] if number.name in shared else [(number, (k,)) for k in sensors]
        return cls(table, robot, tuple(free), distance_sd)

    @property
    def n_rings(self) -> int:
        """Distances that may be off; none if they are taken as written."""
        return int(self.table.place[0].max()) + 1 if self.distance_sd else 0

    def off_by(self, point: Floats) -> Floats:
        """Return by how much each distance is larger than written, (r,) [m]."""
        return np.asarray(self.distance_sd * point[len(self.free) :])

    def middle(self, number: Number, sensors: Sequence[int]) -> float:
        """Return the center of the prior."""
        own = float(np.mean([plain_number(self.robot, k, number.name) for k in sensors]))
        return max(own, LEAST[number.name]) if number.kind == "ratio" else own

    def values(self, point: Floats) -> dict[str, Floats]:
        """Return (s,) numbers of all sensors of the robot at a point (p,) of the standard normal scale."""
        values = {
            n.name: np.array([plain_number(self.robot, k, n.name) for k in range(len(self.robot.range))])
            for n in NUMBERS
        }
        for (number, sensors), z in zip(self.free, point, strict=False):  # distances follow
            middle = self.middle(number, sensors)
            value = (
                middle * np.exp(number.spread * z) if number.kind == "ratio" else middle + number.spread * z
            )
            values[number.name][list(sensors)] = value
        values["cone"] = np.minimum(values["cone"], np.pi)
        return values

    def numbers(self, point: Floats) -> dict[str, float]:
        """Return the robot's numbers by dotted name."""
        values = self.values(point)
        sensors = np.unique(self.table.sensor)
        return {
            f"range.{k}.{number.name}": float(values[number.name][k]) for k in sensors for number in NUMBERS
        }

    def expected(self, values: Mapping[str, Floats], more: Floats | float = 0.0) -> Floats:
        """Return (n,) readings of all places, at gaps that are larger by `more` [m]."""
        table, readings = self.table, np.empty(len(self.table.sensor))
        gaps = table.gap + more
        for k in np.unique(table.sensor):
            at, sensor = table.sensor == k, self.robot.range[k]
            one = {name: float(each[k]) for name, each in values.items()}
            readings[at] = wall_reading(gaps[at], table.bearing[at], one, sensor.reach, sensor.rays)
        return readings

    def at(self, point: Floats) -> Floats:
        """Return (n,) readings of all places at a point of the standard scale."""
        more = self.off_by(point)[self.table.place[0]] if self.n_rings else 0.0
        return self.expected(self.values(point), more)

    def slopes(self, point: Floats) -> Floats:
        """Return (n, p) derivatives of the readings: numbers of different sensors change in one go."""
        table, here = self.table, self.at(point)
        slopes = np.zeros((len(here), len(point)))
        for number in NUMBERS:
            columns = [k for k, (each, _) in enumerate(self.free) if each.name == number.name]
            moved = point.copy()
            moved[columns] += STEP
            change = (self.at(moved) - here) / STEP
            for column in columns:
                rows = np.isin(table.sensor, self.free[column][1])
                slopes[rows, column] = change[rows]
        if self.n_rings:
            moved = point.copy()
            moved[len(self.free) :] += STEP
            slopes[np.arange(len(here)), len(self.free) + table.place[0]] = (self.at(moved) - here) / STEP
        return slopes

    def solve(self) -> tuple[Floats, Floats]:
        """Return the best point, (p,), and its covariance, (p, p): Levenberg-Marquardt."""
        table, seen = self.table, self.table.seen
        point, damping = np.zeros(len(self.free) + self.n_rings), 1e-2
        left = (self.at(point) - table.readings)[seen] / NOISE
        for _ in range(MOST_STEPS):
            slopes = self.slopes(point)[seen] / NOISE
            curvature = slopes.T @ slopes + np.eye(len(point))
            slope = slopes.T @ left + point
            gained = 0.0
            while damping < MOST_DAMPING:
                new = point - np.linalg.solve(curvature + damping * np.diag(np.diag(curvature)), slope)
                then = (self.at(new) - table.readings)[seen] / NOISE
                gained = left @ left + point @ point - then @ then - new @ new
                if gained > 0:
                    break
                damping *= 4.0
            if gained <= 0:
                break
            point, left, damping = new, then, max(damping / 8.0, 1e-9)
            if gained < ENOUGH * (left @ left):
                break
        slopes = self.slopes(point)[seen] / NOISE
        inverse = np.linalg.inv(slopes.T @ slopes + np.eye(len(point)))
        cluster = table.place[0][seen]
        pulls = np.array([slopes[cluster == k].T @ left[cluster == k] for k in np.unique(cluster)])
        spread = inverse @ (pulls.T @ pulls + np.eye(len(point))) @ inverse
        return point, (spread + spread.T) / 2 + 1e-12 * np.eye(len(point))

    def fitted(self, best: Floats, spread: Floats) -> list[Fitted]:
        """Return the parameters with intervals."""
        rows = []
        for k, (number, sensors) in enumerate(self.free):
            middle = self.middle(number, sensors)

            def of(z: float, number: Number = number, middle: float = middle) -> float:
                step = number.spread * z
                return float(middle * np.exp(step)) if number.kind == "ratio" else float(middle + step)

            wide = 1.645 * float(np.sqrt(spread[k, k]))
            identified = wide < IDENTIFIED * 1.645
            rows.append(
                Fitted(
                    name=f"range.{number.name}" if len(sensors) > 1 else f"range.{sensors[0]}.{number.name}",
                    estimate=of(float(best[k])),
                    low=of(float(best[k]) - wide),
                    high=of(float(best[k]) + wide),
                    prior_low=of(-1.645),
                    prior_high=of(1.645),
                    identified=identified,
                    unit=number.unit,
                    advice="" if identified else number.advice,
                )
            )
        return rows


def wall_reading(
    gap: Floats, bearing: Floats, numbers: Mapping[str, float], reach: float, rays: int
) -> Floats:
    """Return (n,) readings along a straight wall, as kernels/sim/ranges.py.

    Args:
        gap: (n,) distance from the mount to the wall [m].
        bearing: (n,) bearing of the wall from the body's heading [rad].
        numbers: Values of `NUMBERS`, by name.
        reach: [m].
        rays: Number of rays.
    """
    part = np.linspace(-1.0, 1.0, rays) if rays > 1 else np.zeros(1)
    weights = 1.0 - 0.5 * part**2
    cosine = np.cos(numbers["direction"] + numbers["cone"] * part - bearing[:, None])
    meets = cosine > LEAST_COSINE
    cosine = np.where(meets, cosine, 1.0)
    distance = np.maximum(gap[:, None], 0.0) / cosine
    back = np.exp(-distance / numbers["decay"]) * (meets & (distance < reach))
    back = back * cosine / (cosine + numbers["incidence"] * (1.0 - cosine))
    light = numbers["amplitude"] * (back @ (weights / weights.sum()))
    c = numbers["compression"]
    return np.asarray(np.clip(np.log1p(c * light) / c if c else light, 0.0, 1.0))


def plain_number(robot: RobotModel, k: int, name: str) -> float:
    value = getattr(robot.range[k], name)
    return float(value.center if hasattr(value, "center") else value)


def _compare(problem: _Problem, best: Floats) -> HeldOut:
    """Predict the places that the fit did not see."""
    table = problem.table
    own = {
        n.name: np.array([plain_number(problem.robot, k, n.name) for k in range(len(problem.robot.range))])
        for n in NUMBERS
    }
    predicted = {
        "own": problem.expected(own),
        "fitted": problem.expected(problem.values(best)),
        "at": problem.at(best),
    }
    left = {name: values - table.readings for name, values in predicted.items()}
    unseen = ~table.seen
    between = unseen & (table.readings > BETWEEN[0]) & (table.readings < BETWEEN[1])
    more = {}
    where = f"where {BETWEEN[0]:g} < reading < {BETWEEN[1]:g}"
    if between.any():
        more[where] = (_rms(left["own"][between]), _rms(left["fitted"][between]))
    if problem.n_rings:
        more["with corrected distances"] = (_rms(left["own"][unseen]), _rms(left["at"][unseen]))
        if between.any():
            more[f"with corrected distances, {where}"] = (
                _rms(left["own"][between]),
                _rms(left["at"][between]),
            )
    return HeldOut(
        "root mean square error of the readings at every second place",
        "",
        _rms(left["own"][unseen]),
        _rms(left["fitted"][unseen]),
        n=int(unseen.sum()),
        more=more,
        floor=_floor(table),
    )


def _floor(table: _Table) -> float | None:
    """Return the error of predicting each held-out reading by the mean of its fitted neighbors in the table."""
    rows, columns = table.place
    grid = np.full((table.sensor.max() + 1, rows.max() + 3, columns.max() + 3), np.nan)
    grid[table.sensor[table.seen], rows[table.seen] + 1, columns[table.seen] + 1] = table.readings[table.seen]
    s, i, j = table.sensor[~table.seen], rows[~table.seen] + 1, columns[~table.seen] + 1
    around = np.stack([grid[s, i - 1, j], grid[s, i + 1, j], grid[s, i, j - 1], grid[s, i, j + 1]])
    some = np.isfinite(around).any(axis=0)
    if not some.any():
        return None
    return _rms(np.nanmean(around[:, some], axis=0) - table.readings[~table.seen][some])


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
