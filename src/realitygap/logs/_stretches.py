"""The trials of a log: its stretches in which everything is known and the wheels alone moved the robot."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ._log import Log
from ._source import Floats

FEWEST_STEPS = 2
MOST_TRIAL_STEPS = 20_000
"""Steps of one trial; a longer stretch becomes several."""
WINDOW_S = 0.5
"""Time over which the motion of poses is measured, so that the noise of single poses counts little."""
WHEELS_S = 3.0
"""Wheels count as moving for this long before and after they move: clocks may differ, and robots roll out."""
FASTER = 1.5
"""Factor by which poses are faster than the wheels if a person carried the robot: a gain or a slip is less."""
LEAST_SHARE = 0.05
"""Share of the log's fastest wheel speed below which motion without wheels is no carrying."""
NOISES = 8.0
"""Typical errors of a pose that a window has to exceed."""
MOST_LISTED = 3
"""Times in a message."""

Bools = NDArray[np.bool_]


def stretches_of(log: Log, speed: float, track: float) -> Iterator[Log]:
    """Yield the trials of a log: its stretches in which everything is known.

    A stretch ends if a command, pose, encoder, or reading is unknown, and if the poses move faster than the wheels
    could: a person carried the robot.

    Args:
        log: A log, or one of its trials.
        speed: Speed of a wheel at full command [m/s].
        track: Distance between the wheels [m].

    Yields:
        The stretches of at least `FEWEST_STEPS` steps.
    """
    known = np.ones(len(log.commands) + 1, bool)
    known[:-1] &= np.isfinite(log.commands).all(1)
    for rows in (log.poses if log.has_heading else log.poses[:, :2], log.wheels, log.readings):
        if len(rows):
            known &= np.isfinite(rows).all(1)
    carried = _carried_rows(log, speed, track)
    parts = _runs(known & ~carried, FEWEST_STEPS + 1)
    if carried.any():
        log = replace(log, notes=(*log.notes, _carried(log, carried)))
    if len(parts) == 1 and parts[0] == (0, len(known)):
        yield log
        return
    for number, (begin, end) in enumerate(parts):
        for first in range(begin, end - FEWEST_STEPS, MOST_TRIAL_STEPS):
            yield _cut(log, first, min(first + MOST_TRIAL_STEPS, end - 1), number)


def _cut(log: Log, first: int, last: int, number: int) -> Log:
    """Return the steps of a log from one row to another."""
    rows = slice(first, last + 1)
    return replace(
        log,
        name=f"{log.name}.{number}" if log.name else f"{number}",
        start_s=log.start_s + first * log.step_s,
        commands=log.commands[first:last],
        poses=log.poses[rows],
        wheels=log.wheels[rows] - log.wheels[first] if len(log.wheels) else log.wheels,
        readings=log.readings[rows],
        raw_headings=log.raw_headings[rows],
    )


def _runs(is_in: Bools, least: int) -> list[tuple[int, int]]:
    """Return the first row and the end of each run of at least `least` rows."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], is_in.astype(int), [0]])))
    pairs = zip(edges[::2], edges[1::2], strict=True)
    return [(int(begin), int(end)) for begin, end in pairs if end - begin >= least]


def _carried_rows(log: Log, speed: float, track: float) -> Bools:
    """Return (n + 1,) which rows have poses that the wheels cannot have reached, with a margin on both sides.

    Nothing is marked if most of the motion is too fast: then a unit is wrong, and no person carried the robot.
    """
    n = len(log.commands)
    carried = np.zeros(n + 1, np.bool_)
    if not len(log.poses):
        return carried
    wheels = np.abs(np.nan_to_num(log.commands)) * speed
    if len(log.wheels):
        wheels = np.maximum(wheels, np.abs(np.nan_to_num(np.diff(log.wheels, axis=0))) / log.step_s)
    place, angle = log.poses[:, :2], log.poses[:, 2:]
    for width in {1, max(1, min(round(WINDOW_S / log.step_s), n))}:
        way = _widest(wheels.max(1), round(WHEELS_S / log.step_s), width) * width * log.step_s
        moved = np.hypot(*(place[width:] - place[:-width]).T)
        turned = np.abs(angle[width:] - angle[:-width])[:, 0]
        is_carried = _is_too_far(moved, way, _noise(place)) | _is_too_far(
            turned, way * 2 / track, _noise(angle)
        )
        if is_carried.sum() * 2 > np.isfinite(moved).sum():
            return np.zeros(n + 1, np.bool_)
        for first in np.flatnonzero(is_carried):
            carried[max(0, first - width) : first + 2 * width + 1] = True
    return carried


def _is_too_far(moved: Floats, reach: Floats, noise: float) -> Bools:
    """Return in which windows a motion is beyond the reach of the wheels.

    The reach is scaled up if poses are typically farther than it, as with poses in millimeters.
    """
    fastest = float(reach.max(initial=0.0))
    drives = np.isfinite(moved) & (reach > 0.3 * fastest) & (reach > 0)
    if not drives.any():
        return np.zeros(len(moved), np.bool_)
    scale = max(1.0, float(np.quantile(moved[drives] / reach[drives], 0.8)))
    least = scale * LEAST_SHARE * fastest + NOISES * noise
    return np.asarray(np.nan_to_num(moved) > FASTER * scale * reach + least)


def _widest(values: Floats, reach: int, width: int) -> Floats:
    """Return the largest value in each window and in `reach` rows before and after it."""
    padded = np.concatenate([np.zeros(reach), values, np.zeros(reach)])
    return np.asarray(np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + width).max(1))


def _noise(values: Floats) -> float:
    """Return the typical error of a row, by how far it is from the line between its neighbors."""
    bends = np.abs(values[2:] - (values[1:-1] * 2 - values[:-2]))
    bends = bends[np.isfinite(bends)]
    return float(np.median(bends)) / math.sqrt(6) / 0.6745 if len(bends) else 0.0


def _carried(log: Log, carried: Bools) -> str:
    times = [
        f"{begin * log.step_s:.4g} to {(end - 1) * log.step_s:.4g} s" for begin, end in _runs(carried, 1)
    ]
    more = f", and {len(times) - MOST_LISTED} times more" if len(times) > MOST_LISTED else ""
    trial = f"Trial {log.name}: " if log.name else ""
    return (
        f"{trial}Poses move faster than the wheels could, {', '.join(times[:MOST_LISTED])}{more}: a person carried "
        "the robot. The log is split there."
    )
