"""Predictions of the unseen part of a log: of the fit, of the robot's own numbers, and of simpler methods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from realitygap._wording import fixed

from ._log_model import MotionLog
from ._prior import ENDS
from ._simulate import Floats, Ints

HORIZONS_S = (1.0, 5.0, 30.0)
"""Times after which predictions are compared [s]."""
MOST_WINDOWS, FEWEST_WINDOWS = 60, 8
"""Starts of a horizon's predictions; if there are fewer apart from each other, they overlap."""
FEWEST_APART = 3
"""Windows apart from each other from which on their mean error has an interval."""
RESAMPLES = 1000
BEFORE_S = 0.5
"""Time before a start whose poses give the pose there [s]: one alone has the whole error of the camera."""
ALIGNED_M, LEAST_ALIGNED = 0.3, 3
"""Path before a start that gives the heading there if none was seen [m], and its fewest rows."""


@dataclass(frozen=True)
class Steps:
    """Motion of a body between the times of a log, and the place of what the camera sees of it.

    Attributes:
        length: (n - 1,) distance of the axle's middle [m].
        turn: (n - 1,) turn [rad].
        seen: Place of what is seen from the axle's middle, ahead + 1j * left [m].
        heading: Heading that is seen if the robot's is 0 [rad].
    """

    length: Floats
    turn: Floats
    seen: complex = 0j
    heading: float = 0.0


@dataclass(frozen=True)
class Horizon:
    """Errors after some time, from several starts.

    Attributes:
        seconds: Time after each start [s].
        errors: (w,) distance between the seen and the predicted position, by prediction [m].
        n_apart: Number of starts that are this time apart from each other.
    """

    seconds: float
    errors: Mapping[str, Floats]
    n_apart: int


def positions(log: MotionLog, steps: Steps, start: int, rows: Ints) -> Floats:
    """Return the positions of what is seen in some rows, (r, 2) [m], predicted from the poses seen until a start.

    Without headings, it is the one that aligns the last part of the computed path with the observed one.
    """
    return np.asarray(_paths(log, steps, np.array([start]), rows[None])[0])


def _paths(log: MotionLog, steps: Steps, starts: Ints, rows: Ints) -> Floats:
    """Return positions (w, r, 2) in rows (w, r) from starts (w,) [m]."""
    heading = np.concatenate([[0.0], np.cumsum(steps.turn)])
    arcs = steps.length * np.sinc(steps.turn / (2 * np.pi)) * np.exp(1j * (heading[:-1] + steps.turn / 2))
    path = np.concatenate([[0j], np.cumsum(arcs)])
    turned, middle = _starts(log, steps, starts, heading, path)
    at = middle[:, None] + turned[:, None] * (path[rows] + steps.seen * np.exp(1j * heading[rows]))
    return np.asarray(np.stack([at.real, at.imag], axis=-1))


def _starts(
    log: MotionLog, steps: Steps, starts: Ints, heading: Floats, path: NDArray[np.complex128]
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Return the turn and the shift that carry a computed path onto the last poses seen until each start, (w,) each."""
    seen = log.poses[:, 0] + 1j * log.poses[:, 1]
    computed = path + steps.seen * np.exp(1j * heading)
    apart = np.exp(1j * (log.poses[:, 2] - steps.heading - heading))
    turned, middle = np.empty(len(starts), complex), np.empty(len(starts), complex)
    first = np.searchsorted(log.time_s, log.time_s[starts] - BEFORE_S)
    for k, (begin, start) in enumerate(zip(first.tolist(), starts.tolist(), strict=True)):
        rows = slice(begin, start + 1)
        known = np.isfinite(seen[rows])
        angles = apart[rows][known & np.isfinite(apart[rows])]
        turn = (
            angles.sum() / abs(angles.sum()) if len(angles) else np.exp(1j * _aligned(seen, computed, start))
        )
        turned[k], middle[k] = turn, (seen[rows][known] - turn * computed[rows][known]).mean()
    return turned, middle


def _aligned(seen: NDArray[np.complex128], path: NDArray[np.complex128], start: int) -> float:
    """Return the angle that turns the path before a start into the one that was seen [rad]."""
    known = np.flatnonzero(np.isfinite(seen[: start + 1]))
    gone = np.abs(np.diff(path[: start + 1]))[::-1].cumsum()
    first = start - min(int(np.searchsorted(gone, ALIGNED_M)) + LEAST_ALIGNED, start)
    rows = known[known >= first]
    return float(np.angle(np.vdot(path[rows] - path[rows].mean(), seen[rows] - seen[rows].mean())))


def horizons(log: MotionLog, predictions: Mapping[str, Steps], split: int) -> tuple[Horizon, ...]:
    """Return errors after each time that fits into the part of a log from a row on."""
    known = np.flatnonzero(np.isfinite(log.poses[:, 0]))
    known = known[known >= last_seen(log, split)]
    time = log.time_s[known]
    result = []
    for seconds in HORIZONS_S:
        room = time[-1] - time[0] - seconds
        if room < 0:
            break
        apart = int(room // seconds) + 1
        n = min(max(apart, FEWEST_WINDOWS), MOST_WINDOWS)
        begin = np.unique(np.searchsorted(time, time[0] + np.linspace(0.0, room, n)))
        end = np.minimum(np.searchsorted(time, time[begin] + seconds), len(time) - 1)
        starts, ends = known[begin], known[end]
        errors = {
            name: np.hypot(*(_paths(log, steps, starts, ends[:, None])[:, 0] - log.poses[ends, :2]).T)
            for name, steps in predictions.items()
        }
        result.append(Horizon(seconds, errors, min(apart, len(begin))))
    return tuple(result)


def last_seen(log: MotionLog, split: int) -> int:
    """Return the last row before the unseen part in which the position was seen."""
    known = np.flatnonzero(np.isfinite(log.poses[:split, 0]))
    return int(known[-1])


@dataclass(frozen=True)
class PathErrors:
    """Errors of predicted positions on the unseen part of a log.

    Attributes:
        lasts_s: Time from the last pose before the part to its last pose [s].
        off: (r,) distance between the seen and the predicted position in each row, by prediction [m].
        horizons: Errors after 1, 5, and 30 s, from several starts.
    """

    lasts_s: float
    off: Mapping[str, Floats]
    horizons: tuple[Horizon, ...]


@dataclass(frozen=True)
class PathSummary:
    """Errors of predicted positions on the unseen parts of logs [m].

    Attributes:
        measure: The error, in words.
        n: Observations in the unseen parts.
        mean: Mean distance between the seen and the predicted position, by prediction.
        more: Mean distance after a time, and at the end, by the name of the time and by prediction.
        intervals: 90 % intervals after a time; a time with too few starts is left out.
    """

    measure: str
    n: int
    mean: dict[str, float]
    more: dict[str, dict[str, float]]
    intervals: dict[str, dict[str, tuple[float, float]]]


def path_errors(log: MotionLog, predictions: Mapping[str, Steps], split: int) -> PathErrors:
    """Return the errors of predictions on the part of a log from a row on.

    The distances in each row are those of one prediction of the whole part, from the last pose before it. Errors after
    1, 5, and 30 s are of predictions from several poses of the part.
    """
    start = last_seen(log, split)
    rows = split + np.flatnonzero(np.isfinite(log.poses[split:, 0]))
    off = {
        name: np.hypot(*(positions(log, steps, start, rows) - log.poses[rows, :2]).T)
        for name, steps in predictions.items()
    }
    return PathErrors(float(log.time_s[rows[-1]] - log.time_s[start]), off, horizons(log, predictions, split))


def summary_of(errors: Sequence[PathErrors], parts: str = "trials", seed: int = 0) -> PathSummary:
    """Return the errors of all parts of logs together; means are weighted by the observations."""
    names = list(errors[0].off)
    weights = [len(part.off[names[0]]) for part in errors]

    def mean(values: Sequence[float]) -> float:
        return float(np.average(values, weights=weights))

    more: dict[str, dict[str, float]] = {}
    intervals: dict[str, dict[str, tuple[float, float]]] = {}
    for seconds in HORIZONS_S:
        alike = [horizon for part in errors for horizon in part.horizons if horizon.seconds == seconds]
        if not alike:
            continue
        key = f"after {seconds:g} s"
        joined = {name: np.concatenate([horizon.errors[name] for horizon in alike]) for name in names}
        more[key] = {name: float(values.mean()) for name, values in joined.items()}
        n_apart = sum(horizon.n_apart for horizon in alike)
        if n_apart >= FEWEST_APART:
            intervals[key] = {name: _interval(values, n_apart, seed) for name, values in joined.items()}
    more["at the end"] = {name: mean([float(part.off[name][-1]) for part in errors]) for name in names}
    lasts = "" if len(errors) > 1 else f" over the last {fixed(errors[0].lasts_s, 1)} s"
    of = f", mean of {len(errors)} {parts}" if len(errors) > 1 else ""
    return PathSummary(
        f"mean distance between seen and predicted positions{lasts}{of}",
        sum(weights),
        {name: mean([float(part.off[name].mean()) for part in errors]) for name in names},
        more,
        intervals,
    )


def _interval(errors: Floats, n_apart: int, seed: int) -> tuple[float, float]:
    """Return the 90 % interval of a mean error, by a bootstrap of as many starts as are apart from each other."""
    drawn = np.random.default_rng(seed).integers(len(errors), size=(RESAMPLES, min(n_apart, len(errors))))
    low, high = np.quantile(errors[drawn].mean(axis=1), ENDS)
    return float(low), float(high)


NEIGHBORS = 7
"""Number of steps with the most similar commands whose mean motion is used."""
MOST_STEP_RAD = 1.0
"""Turn in one step beyond which a heading by the path is no turn [rad]."""


FEWEST_CLEAR = 3
"""Steps with a clear direction from which headings by the path are made."""


def look_up_motion(time_s: ArrayLike, commands: ArrayLike, poses: ArrayLike, split: int) -> Steps | None:
    """Return the motion of each step of a log, by that in fitted steps with similar commands.

    Args:
        time_s: (n,) ascending times [s].
        commands: (n, 2) commands of the left and right wheel.
        poses: (n, 2) x, y [m] or (n, 3) x, y, heading [rad]; nan if not seen.
        split: First row of the held-out part.

    Returns:
        The motion of what the camera sees; None if no motion was seen in the fitted part.
    """
    time, commanded, seen = (np.asarray(values, np.float64) for values in (time_s, commands, poses))
    lasts = np.diff(time)
    ahead, turn = _motion(commanded, seen)
    # a wheel nears its command, so the one before counts as well
    recent = np.concatenate([commanded[:-1], np.concatenate([commanded[:1], commanded[:-2]])], 1)
    known = np.flatnonzero(np.isfinite(ahead[: split - 1]) & np.isfinite(turn[: split - 1]))
    if not len(known):
        return None
    rate = np.stack([ahead, turn], 1)[known] / lasts[known, None]
    speeds = np.empty((len(lasts), 2))
    for k, row in enumerate(recent):
        near = np.argsort(((recent[known] - row) ** 2).sum(1), kind="stable")[:NEIGHBORS]
        speeds[k] = rate[near].mean(0)
    return Steps(speeds[:, 0] * lasts, speeds[:, 1] * lasts)


def _motion(commands: Floats, poses: Floats) -> tuple[Floats, Floats]:
    """Return the way ahead [m] and turn [rad] in each step, (n - 1,) each; without headings by the path."""
    steps = np.diff(poses[:, 0] + 1j * poses[:, 1])
    if poses.shape[1] == 3 and np.isfinite(poses[:, 2]).any():
        turn = np.diff(poses[:, 2])
        return np.real(steps * np.exp(-1j * (poses[:-1, 2] + turn / 2))), turn
    way = np.abs(steps) * np.where(commands[:-1].sum(1) < 0, -1, 1)
    usual = np.nanmedian(np.abs(way[np.abs(way) > 0])) if np.any(np.abs(way) > 0) else 0.0
    clear = np.flatnonzero(np.isfinite(way) & (np.abs(way) > 0.2 * usual))
    if len(clear) < FEWEST_CLEAR:
        return way, np.zeros(len(way))
    direction = np.unwrap(np.angle(steps[clear] * np.sign(way[clear])))
    heading = np.interp(np.arange(len(poses)), clear + 0.5, direction)
    turn = np.diff(heading)
    return way, np.where(np.abs(turn) < MOST_STEP_RAD, turn, np.nan)
