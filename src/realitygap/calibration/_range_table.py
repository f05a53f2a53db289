"""The fit of range sensors to a table of readings along a straight wall, by distance and bearing."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from realitygap.errors import finite_numbers
from realitygap.world import Fitted, RobotModel

from ._fit import HeldOut, HeldOutFit
from ._one_thread import one_blas_thread
from ._prior import Deviation, is_identified
from ._range_response import NAMES, file_numbers, numbers_in_file, numbers_to_fit, wall_reading
from ._simulate import Bools, Floats, Ints
from ._wall_table import BearingFrom, MeasuredFrom, TableFrame, place_ranks

N_DRAWS = 200
LEAST_PLACES = 20
"""Readings of a sensor in the part that is fitted."""

BETWEEN = (0.03, 1.0)
"""Readings that are neither nothing nor full."""

NOISE = 0.05
"""Standard deviation of readings around the response that the priors are weighed against at first."""

LEAST_WEIGHT = 0.01
"""Smallest weight of the priors of numbers in a second fit: the square of a standard deviation of 0.1 `NOISE`."""

STEP, WIDE_STEP = 1e-4, 0.1
"""Steps of finite differences, in standard deviations of the prior; the wide one for readings that jump."""

JUMPS = ("lorentz", "table")
"""Responses that jump at the reach or in their table: the slope at a point does not show that."""

MOST_STEPS, MOST_DAMPING, ENOUGH = 200, 1e8, 1e-5
"""Limits of least squares. A step that gains less than the share `ENOUGH` is the last."""

N_TRIED, N_STARTS, FEW_STEPS = 150, 3, 30
"""Points of the prior that are tried for each sensor, those of them that a fit starts from, and its steps."""

MOST_ROWS = 400
"""Readings of a sensor that the search of a start uses."""

FRAME_SENSORS, FRAME_ROWS = 4, 150
"""Sensors, and readings of each, that decide about a frame. More take longer and decide the same."""
FRAME_TRIED, FRAME_STARTS = 60, 2
CLEARLY, MARGIN = 1.1, 4.0
"""A frame is taken instead of an earlier one if that leaves this factor more unexplained, and `MARGIN` squares more."""

METHOD = (
    "Least squares of readings between 0 and 1 with a normal prior from several starts, response as in `sim`; "
    "distances that were set together may be off together; "
    "intervals from the sandwich covariance, clustered by distance (White 1982)."
)


@one_blas_thread()
def fit_range_table(
    sensor: ArrayLike,
    distance_m: ArrayLike,
    bearing_rad: ArrayLike,
    readings: ArrayLike,
    robot: RobotModel,
    *,
    measured_from: MeasuredFrom = "body",
    bearing_from: BearingFrom | None = None,
    hold_out: bool = True,
    shared: Sequence[str] = ("compression",),
    distance_sd_m: float = 0.0005,
    seed: int = 0,
) -> HeldOutFit:
    """Fit range sensors to readings along a long, straight wall, and predict the places that the fit does not see.

    Args:
        sensor: (n,) index of the range sensor in the robot's file.
        distance_m: (n,) shortest distance to the wall [m].
        bearing_rad: (n,) direction from the robot to the nearest point of the wall, positive to the left of the
            heading [rad].
        readings: (n,) 0 to 1.
        robot: The robot with its nominal numbers; mounts, rays and response stay, and so does the reach unless the
            response is linear.
        measured_from: The point that distances are measured from: the body's outline, its origin, or the sensor's
            mount.
        bearing_from: The direction that bearings count from: the body's heading, or the direction in which the robot
            file has the sensor look. Default: as `measured_from`.
        hold_out: True to leave out every second place, like a chessboard over distances and bearings.
        shared: Numbers that have one value for all sensors; the others differ.
        distance_sd_m: Standard deviation of the error of each distance, which all places at that distance share [m]; 0
            to take distances as they are written.
        seed: Seed of the draws.

    Returns:
        The fit, with the root mean square error of nominal and fitted numbers at the places that the fit did not see,
        with distances as they are written. `held_out.more` also has the errors with distances as corrected.

    Raises:
        ValueError: The arrays do not fit together, or a sensor is not in the robot's file.
    """
    frame = TableFrame.of(measured_from, bearing_from)
    table = Readings.of(sensor, distance_m, bearing_rad, readings, robot, frame, hold_out=hold_out)
    if not 0.0 <= distance_sd_m < 0.1:
        raise ValueError(f"distance_sd_m is {distance_sd_m:g}, expected 0 to 0.1 m.")
    problem = RangeProblem.of(table, robot, shared, distance_sd_m)
    first = problem.descend(problem.start(seed))
    weight = float(np.mean(problem.left(first) ** 2))
    problem = replace(problem, prior_weight=min(max(weight, LEAST_WEIGHT), 1.0))
    best, spread = problem.solve(first)
    rng = np.random.default_rng(seed)
    draws = best + rng.standard_normal((N_DRAWS, len(best))) @ np.linalg.cholesky(spread).T
    numbers = problem.numbers(best)
    drawn = [problem.numbers(row) for row in draws]
    off = 1000 * problem.off_by(best)
    held_out = _compare(problem, best) if hold_out else None
    return HeldOutFit(
        tuple(problem.fitted(best, spread)),
        numbers,
        {name: tuple(each[name] for each in drawn) for name in numbers},
        METHOD,
        held_out=held_out,
        notes=(f"Distances are off by {np.sqrt(np.mean(off**2)):.2f} mm (root mean square).",)
        if len(off)
        else (),
        evidence={"distance_off_mm": np.round(off, 3).tolist()},
    )


@dataclass(frozen=True)
class Readings:
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
        frame: TableFrame,
        *,
        hold_out: bool,
    ) -> Readings:
        which = np.asarray(sensor)
        columns = {"distance_m": distance_m, "bearing_rad": bearing_rad, "readings": readings}
        arrays = {name: finite_numbers(name, values) for name, values in columns.items()}
        if which.ndim != 1 or not len(which):
            raise ValueError(f"sensor has shape {which.shape}, expected (n,): one index for each reading.")
        for name, values in arrays.items():
            if values.shape != which.shape:
                raise ValueError(f"{name} has shape {values.shape}, expected {which.shape}, as sensor has.")
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
        gap, bearing = frame.gaps(index, arrays["distance_m"], arrays["bearing_rad"], robot)
        ranks = place_ranks(distance_m, bearing_rad)
        seen = (ranks[0] + ranks[1]) % 2 == 0 if hold_out else np.ones(len(index), np.bool_)
        for k in np.unique(index):
            n = int((seen & (index == k)).sum())
            if n < LEAST_PLACES:
                raise ValueError(f"The fit sees {n} readings of range.{k}, expected at least {LEAST_PLACES}.")
        return cls(index, gap, bearing, arrays["readings"], seen, ranks)

    def of_sensor(self, k: int, most: int = MOST_ROWS) -> Readings:
        """Return the seen readings of one sensor; a random part of them if there are more than `most`."""
        rows = np.flatnonzero(self.seen & (self.sensor == k))
        if len(rows) > most:
            rows = np.sort(np.random.default_rng(0).choice(rows, most, replace=False))
        place = self.place[0][rows], self.place[1][rows]
        return Readings(
            self.sensor[rows], self.gap[rows], self.bearing[rows], self.readings[rows], self.seen[rows], place
        )


@dataclass(frozen=True)
class RangeProblem:
    """A table, and the numbers that are fitted to it."""

    table: Readings
    robot: RobotModel
    free: tuple[tuple[Deviation, tuple[int, ...]], ...]  # a number, and the sensors that have it
    distance_sd: float
    own: Mapping[int, dict[str, float]]  # numbers in the robot file, by sensor
    prior_weight: float = 1.0  # of the priors of numbers

    @classmethod
    def of(
        cls, table: Readings, robot: RobotModel, shared: Sequence[str], distance_sd: float
    ) -> RangeProblem:
        unknown = sorted(set(shared) - set(NAMES))
        if unknown:
            raise ValueError(f"shared has {unknown[0]!r}, expected some of {', '.join(NAMES)}.")
        sensors: dict[Deviation, list[int]] = {}
        for k in np.unique(table.sensor):
            for number in numbers_to_fit(robot.range[k]):
                sensors.setdefault(number, []).append(int(k))
        free: list[tuple[Deviation, tuple[int, ...]]] = []
        for number, which in sensors.items():
            free += [(number, tuple(which))] if number.name in shared else [(number, (k,)) for k in which]
        own = {int(k): numbers_in_file(robot, int(k)) for k in np.unique(table.sensor)}
        return cls(table, robot, tuple(free), distance_sd, own)

    @property
    def n_rings(self) -> int:
        """Distances that may be off; none if they are taken as written."""
        return int(self.table.place[0].max()) + 1 if self.distance_sd else 0

    def off_by(self, point: Floats) -> Floats:
        """Return by how much each distance is larger than written, (r,) [m]."""
        return np.asarray(self.distance_sd * point[len(self.free) :])

    def middle(self, number: Deviation, sensors: Sequence[int]) -> float:
        """Return the center of the prior."""
        own = float(np.mean([self.own[k][number.name] for k in sensors]))
        return max(own, number.least) if number.kind == "ratio" else own

    def fitted_values(self, point: Floats) -> dict[int, dict[str, float]]:
        """Return the fitted numbers of each sensor at a point (p,) of the standard normal scale."""
        values: dict[int, dict[str, float]] = {k: {} for k in self.own}
        for (number, sensors), z in zip(self.free, point, strict=False):  # distances follow
            value = number.limited(self.middle(number, sensors), float(z))
            for k in sensors:
                values[k][number.name] = value
        return values

    def numbers(self, point: Floats) -> dict[str, float]:
        """Return the robot's numbers by dotted name. Directions are at most half a turn from those of the file."""
        numbers = {}
        for k, values in self.fitted_values(point).items():
            turn = values["direction"] - self.own[k]["direction"]
            values["direction"] -= 2 * math.pi * round(turn / (2 * math.pi))
            for name, value in file_numbers(values, self.robot.range[k]).items():
                numbers[f"range.{k}.{name}"] = value
        return numbers

    def expected(self, values: Mapping[int, Mapping[str, float]], more: Floats | float = 0.0) -> Floats:
        """Return (n,) readings of all places, at gaps that are larger by `more` [m].

        Args:
            values: Numbers of each sensor that differ from those of the robot file.
            more: (n,) [m].
        """
        table, readings = self.table, np.empty(len(self.table.sensor))
        gaps = table.gap + more
        for k, own in self.own.items():
            at = table.sensor == k
            readings[at] = wall_reading(
                gaps[at], table.bearing[at], {**own, **values.get(k, {})}, self.robot.range[k]
            )
        return readings

    def at(self, point: Floats) -> Floats:
        """Return (n,) readings of all places at a point of the standard scale."""
        more = self.off_by(point)[self.table.place[0]] if self.n_rings else 0.0
        return self.expected(self.fitted_values(point), more)

    def slopes(self, point: Floats, step: float = STEP) -> Floats:
        """Return (n, p) derivatives of the readings: numbers of different sensors change in one go."""
        table, here = self.table, self.at(point)
        slopes = np.zeros((len(here), len(point)))
        for name in dict.fromkeys(number.name for number, _ in self.free):
            columns = [k for k, (each, _) in enumerate(self.free) if each.name == name]
            moved = point.copy()
            moved[columns] += step
            change = (self.at(moved) - here) / step
            for column in columns:
                rows = np.isin(table.sensor, self.free[column][1])
                slopes[rows, column] = change[rows]
        if self.n_rings:
            moved = point.copy()
            moved[len(self.free) :] += step
            slopes[np.arange(len(here)), len(self.free) + table.place[0]] = (self.at(moved) - here) / step
        return slopes

    @property
    def weights(self) -> Floats:
        """The weights of the priors of numbers and of errors of distances, (p,)."""
        return np.concatenate([np.full(len(self.free), self.prior_weight), np.ones(self.n_rings)])

    def cost(self, point: Floats) -> float:
        """Return the squares of what a point leaves unexplained, and of its distance from the prior's center."""
        left = self.left(point)
        return float(left @ left + self.weights @ point**2)

    def left(self, point: Floats) -> Floats:
        """Return what a point leaves unexplained of the seen readings, in multiples of `NOISE`."""
        return np.asarray((self.at(point) - self.table.readings)[self.table.seen] / NOISE)

    def descend(self, point: Floats, most_steps: int = MOST_STEPS) -> Floats:
        """Return the best point near another one, (p,)."""
        if any(self.robot.range[k].response in JUMPS for k in self.own):
            point = self._descend(point, most_steps, WIDE_STEP)
        return self._descend(point, most_steps, STEP)

    def _descend(self, point: Floats, most_steps: int, step: float) -> Floats:
        """Return the best point near another one by Levenberg-Marquardt, (p,).

        Differs from SciPy's method `lm`: normal equations. A table has thousands of rows, which take longer to
        decompose, and the minimum is the same.
        """
        seen, weights, damping = self.table.seen, self.weights, 1e-2
        left = self.left(point)
        for _ in range(most_steps):
            slopes = self.slopes(point, step)[seen] / NOISE
            curvature = slopes.T @ slopes + np.diag(weights)
            slope = slopes.T @ left + weights * point
            gained = 0.0
            while damping < MOST_DAMPING:
                new = point - np.linalg.solve(curvature + damping * np.diag(np.diag(curvature)), slope)
                then = self.left(new)
                gained = left @ left + weights @ point**2 - then @ then - weights @ new**2
                if gained > 0:
                    break
                damping *= 4.0
            if gained <= 0:
                break
            point, left, damping = new, then, max(damping / 8.0, 1e-9)
            if gained < ENOUGH * (left @ left):
                break
        return point

    def start(self, seed: int) -> Floats:
        """Return the point to start from: for each sensor alone, the best of fits from several places."""
        start = np.zeros(len(self.free) + self.n_rings)
        n_sensors = np.zeros(len(start))
        for k in self.own:
            alone = RangeProblem.of(self.table.of_sensor(k), self.robot, (), 0.0)
            best = alone.best_of_several(seed)
            for (number, _), z in zip(alone.free, best, strict=True):
                column = next(
                    j for j, (each, sensors) in enumerate(self.free) if each == number and k in sensors
                )
                start[column] += z
                n_sensors[column] += 1
        return start / np.maximum(n_sensors, 1)

    def best_of_several(self, seed: int, n_tried: int = N_TRIED, n_starts: int = N_STARTS) -> Floats:
        """Return the best point for one sensor, of fits from the robot file's numbers and from points of the prior.

        In half of the points, the sensor looks where it reads most, and has usual numbers: the robot file may be far
        off.

        Args:
            seed: Seed of the points.
            n_tried: Number of the points.
            n_starts: Number of the best points from which a fit starts.
        """
        (k,) = self.own
        rng = np.random.default_rng(seed)
        points = rng.standard_normal((n_tried, len(self.free)))
        column = next(j for j, (number, _) in enumerate(self.free) if number.name == "direction")
        pull = np.angle(np.sum(self.table.readings**2 * np.exp(1j * self.table.bearing)))
        turn = (pull - self.own[k]["direction"] + math.pi) % (2 * math.pi) - math.pi
        points[::2] = 0.5 * points[::2] + self._usual(float(self.table.gap.max()))
        points[::2, column] += turn / self.free[column][0].spread
        costs = [self.cost(point) for point in points]
        starts = [np.zeros(len(self.free)), *points[np.argsort(costs)[:n_starts]]]
        return min((self.descend(point, FEW_STEPS) for point in starts), key=self.cost)

    def _usual(self, farthest: float) -> Floats:
        """Return the point of usual numbers for readings up to a distance [m], (p,)."""
        point = np.zeros(len(self.free))
        for column, (number, sensors) in enumerate(self.free):
            if number.usual:
                usual = number.usual * (farthest if number.unit == "m" else 1.0)
                point[column] = math.log(usual / self.middle(number, sensors)) / number.spread
        return point

    def solve(self, start: Floats) -> tuple[Floats, Floats]:
        """Return the best point near a start, (p,), and its covariance, (p, p)."""
        table, seen = self.table, self.table.seen
        point = self.descend(start)
        left = self.left(point)
        slopes = self.slopes(point)[seen] / NOISE
        inverse = np.linalg.inv(slopes.T @ slopes + np.diag(self.weights))
        cluster = table.place[0][seen]
        pulls = np.array([slopes[cluster == k].T @ left[cluster == k] for k in np.unique(cluster)])
        spread = inverse @ (pulls.T @ pulls + np.diag(self.weights**2)) @ inverse
        return point, (spread + spread.T) / 2 + 1e-12 * np.eye(len(point))

    def fitted(self, best: Floats, spread: Floats) -> list[Fitted]:
        """Return the parameters with intervals."""
        rows = []
        for k, (number, sensors) in enumerate(self.free):
            middle = self.middle(number, sensors)

            def of(z: float, number: Deviation = number, middle: float = middle) -> float:
                return number.limited(middle, z)

            wide = 1.645 * float(np.sqrt(spread[k, k]))
            identified = is_identified(wide, 1.645)
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


@one_blas_thread()
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
    chosen = sensors[np.linspace(0, len(sensors) - 1, min(len(sensors), FRAME_SENSORS)).astype(int)]
    costs, errors = {}, {}
    for frame in frames:
        left = -bearing if frame.clockwise else bearing
        table = Readings.of(which, distance_m, left, readings, robot, frame, hold_out=False)
        cost, squares, n = 0.0, 0.0, 0
        for k in chosen:
            alone = RangeProblem.of(table.of_sensor(int(k), FRAME_ROWS), robot, (), 0.0)
            best = alone.best_of_several(seed, FRAME_TRIED, FRAME_STARTS)
            cost += alone.cost(best)
            squares += float(np.sum((alone.at(best) - alone.table.readings) ** 2))
            n += len(alone.table.readings)
        costs[frame], errors[frame] = cost, math.sqrt(squares / n)
    least = min(costs.values())
    return next(frame for frame in frames if costs[frame] <= CLEARLY * least + MARGIN), errors


def _compare(problem: RangeProblem, best: Floats) -> HeldOut:
    """Predict the places that the fit did not see."""
    table = problem.table
    predicted = {
        "own": problem.expected({}),
        "fitted": problem.expected(problem.fitted_values(best)),
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


def _floor(table: Readings) -> float | None:
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
