"""Checks of a guessed mapping by the first values of its columns: units, and increments of encoders."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from realitygap.errors import LogError

from ._clock_offset import correlation
from ._guess_time import time_unit
from ._log_map import Commands, LogMap, Part, Poses
from ._open import map_name
from ._source import Floats, Source
from ._units import ANGLES, TIMES, tokens_of, unit_in

MOST_SPEED = 5.0
"""Speed above which a number without a unit is not in m/s."""
MOST_TURN = 20.0
"""Turn rate above which a number without a unit is not in rad/s."""
LARGE = 0.9
"""Quantile of values that counts, so that single errors do not."""
FEWEST_ROWS = 50
"""Rows that show whether a column counts on."""
CLEAR = 30.0
"""Largest change in a row, as a share of the range of all rows and times their number, beyond which a column does not
count on."""
COUNTS_ON = 10.0
"""The same share below which a column counts on."""
ALIKE = 0.7
"""Correlation with the motion of the poses at which a column shows it, if the other reading has half of that."""


def checked(source: Source, log_map: LogMap) -> tuple[LogMap, list[str]]:
    """Return a guessed mapping that its values agree with, and what they showed.

    Raises:
        LogError: Values are too large for the units that the names of the columns suggest.
    """
    notes: list[str] = []
    changes: dict[str, Part | None] = {}
    path = source.path
    advice = f"Print the guess (realitygap import {path.name} --show-map), save it as {map_name(path)}, and correct it."
    for name in dict.fromkeys(part.time for part in log_map.parts.values() if part.time):
        _check_time(source, name)
    if log_map.commands is not None:
        _check_commands(source, log_map.commands, advice)
    if log_map.poses is not None:
        _check_poses(source, log_map.poses, advice)
    if log_map.readings is not None and not log_map.readings.inverted:
        largest = float(np.nanmax(_rows(source, log_map.readings.columns()), initial=0.0))
        if largest > 1:
            changes["readings"] = None
            first, last = log_map.readings.sensors[0], log_map.readings.sensors[-1]
            notes.append(
                f"{first} to {last} are left out, because their full scale is unknown (they reach {largest:.4g})"
            )
    wheels = log_map.wheels
    if wheels is not None and wheels.per:
        notes.append("encoders are taken for increments since the row before, by their names")
    elif wheels is not None and not wheels.unit.endswith("/s"):
        per = _per(source, log_map, advice)
        if per:
            changes["wheels"] = wheels.model_copy(update={"per": per})
            notes.append("encoders are taken for increments since the row before, by their values")
    return log_map.model_copy(update=changes), notes


def usable(log_map: LogMap) -> tuple[LogMap, list[str]]:
    """Return a mapping without encoders whose scale is unknown, if it has commands, and a note."""
    wheels = log_map.wheels
    if log_map.commands is None or wheels is None:
        return log_map, []
    unit = wheels.unit.split("/")[0]
    missing = "ticks_per_m" if unit == "ticks" else "wheel_diameter_mm" if unit in (*ANGLES, "rpm") else ""
    if not missing:
        return log_map, []
    note = f"{wheels.left} and {wheels.right} are left out, because {missing} is unknown"
    return log_map.model_copy(update={"wheels": None}), [note]


def _rows(source: Source, columns: Sequence[str]) -> Floats:
    """Return the first rows of columns, (n, k)."""
    first = next(iter(source.batches(columns)), None)
    if first is None:
        return np.empty((0, len(columns)))
    rows = np.stack([first.columns[name] for name in columns], 1)
    return np.asarray(rows[np.isfinite(rows).all(1)])


def _is_si(name: str) -> bool:
    """Return whether a name has a unit, or is a field of a message of ROS, which are in SI units."""
    words = set(tokens_of(name))
    is_ros = {"linear", "x"} <= words or {"angular", "z"} <= words or {"position", "x"} <= words
    return unit_in(name, "") != "" or (is_ros and re.search("[./]", name) is not None)


def _check_time(source: Source, name: str) -> None:
    times = _rows(source, [name])[:, 0]
    if source.is_table and not time_unit(name, times):
        raise LogError(
            f"{source.path}: rows are {np.median(np.diff(times)):.4g} apart in {name}, and its unit is unknown. Write "
            f"a mapping next to it, {map_name(source.path)}, with the time_unit of each part: {', '.join(TIMES)}."
        )


def _check_commands(source: Source, part: Commands, advice: str) -> None:
    columns = part.columns()
    if part.unit == "share":
        return
    limits = (MOST_SPEED, MOST_SPEED if part.left else MOST_TURN)
    for name, values, limit in zip(columns, _rows(source, columns).T, limits, strict=True):
        large = float(np.quantile(np.abs(values), LARGE)) if len(values) else 0.0
        if large > limit and not _is_si(name):
            unit = "m/s" if limit == MOST_SPEED else "rad/s"
            raise LogError(
                f"{source.path}: {name} reaches {large:.4g}, too much for {unit}, and its name has no unit. {advice}"
            )


def _check_poses(source: Source, part: Poses, advice: str) -> None:
    if not part.time:
        return
    columns = [part.time, *part.columns()]
    rows = _rows(source, columns)
    lasts = np.diff(rows[:, 0]) * TIMES[part.time_unit]
    steps = np.abs(np.diff(rows[:, 1:], axis=0))[lasts > 0] / lasts[lasts > 0, None]
    if not len(steps):
        return
    fast = float(np.quantile(np.hypot(steps[:, 0], steps[:, 1]), LARGE))
    if fast > MOST_SPEED and not _is_si(part.x):
        raise LogError(
            f"{source.path}: {part.x} and {part.y} move by {fast:.4g} in a second, too much for meters, and their "
            f"names have no unit. {advice}"
        )
    if part.heading and not _is_si(part.heading):
        jumps = np.abs(np.diff(rows[:, 3]))
        turn = float(np.quantile(steps[:, 2], LARGE))
        if turn > MOST_TURN or ((jumps > 300) & (jumps < 400)).any():
            raise LogError(
                f"{source.path}: the values of {part.heading} are no radians, and its name has no unit. {advice}"
            )


def _per(source: Source, log_map: LogMap, advice: str) -> str:
    """Return row if encoders are increments; empty if they count on, or if there are too few rows.

    Raises:
        LogError: Their values do not show which of both they are.
    """
    wheels, poses = log_map.wheels, log_map.poses
    if wheels is None:
        return ""
    columns = wheels.columns()
    has_poses = source.is_table and poses is not None and not poses.file
    rows = _rows(source, [*columns, *(poses.columns()[:2] if has_poses and poses is not None else [])])
    way = rows[:, :2].mean(1)
    if len(rows) < FEWEST_ROWS or not np.ptp(way):
        return ""
    if has_poses:
        moved = np.hypot(*np.diff(rows[:, 2:4], axis=0).T)
        counter, increment = correlation(moved, np.abs(np.diff(way))), correlation(moved, np.abs(way[1:]))
        if max(counter, increment) > ALIKE and min(counter, increment) < max(counter, increment) * ALIKE:
            return "row" if increment > counter else ""
    change = float(np.quantile(np.abs(np.diff(way)), 0.95)) / float(np.ptp(way)) * len(way)
    if COUNTS_ON < change < CLEAR:
        raise LogError(
            f"{source.path}: {columns[0]} and {columns[1]} may count on, or be increments since the row before "
            f'(per = "row" in [wheels]). {advice}'
        )
    return "row" if change >= CLEAR else ""
