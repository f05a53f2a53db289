"""A calibration of range sensors to a table of readings of another program."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from realitygap.calibration import (
    BearingFrom,
    MeasuredFrom,
    TableFrame,
    choose_frame,
    fit_range_table,
    look_up_readings,
    place_ranks,
    predict_range_table,
)
from realitygap.errors import StudyError
from realitygap.logs import RangeTable, TableMap, load_table_map, map_beside, read_range_table, round_robot
from realitygap.platforms import JyroPlatform
from realitygap.records import write_whole
from realitygap.world import Calibration, RobotModel, load_robot, robot_names

from .hold_out import FITTED, NOISE, NOMINAL, TABLE, Compared, HoldOut, chosen_parts
from .one import calibration_of, measured_at

BETWEEN = (0.03, 1.0)
"""Readings between these are neither nothing nor full: the sensor tells a distance."""
N_DISTANCES = 5
"""Bands of distance by which residuals are shown."""
N_BEARINGS = 6

POINTS: dict[BearingFrom, tuple[MeasuredFrom, ...]] = {"body": ("body",), "sensor": ("sensor", "body")}
"""Points that distances are usually measured from, by the direction that bearings count from."""

MOST_OTHERS = 3
"""Number of rejected ways to read a table that the note names."""


def calibrate_from_table(
    path: str | Path,
    *,
    map_file: str | Path | None = None,
    base: str | Path | None = None,
    hold_out: HoldOut = "blocks",
    seed: int = 0,
    radius: float | None = None,
    robot_file: Path | None = None,
) -> Calibration:
    """Fit the range sensors of a robot to a table of readings by distance and bearing of a wall.

    Args:
        path: The table, in the `.sample` format or as text.
        map_file: Mapping of the table. Default: that next to the table.
        base: The robot that was measured, by name or file; as the mapping says if not given.
        hold_out: The part that the fit does not see: blocks for every second place, like a chessboard over distances
            and bearings, or a share of the places at random. With 0 it sees everything, and nothing is compared.
        seed: Seed of the draws, and of the places that are held out at random.
        radius: Radius of a round robot without a file [m]. Its file is written, with the sensors of the table.
        robot_file: Path of that file.

    Raises:
        StudyError: The table and the robot do not go together.
        LogError: The table cannot be read.
    """
    table_map = _map_of(path, map_file)
    table = read_range_table(path, table_map)
    if radius is not None and robot_file is not None:
        base = _write_robot(table, radius, robot_file)
    name = str(base or table_map.robot)
    if not name:
        raise StudyError(
            f"{path} does not name the robot that was measured. Give --base ROBOT, a file or one of "
            f"{', '.join(robot_names())}."
        )
    robot = load_robot(name)
    if table.n_sensors > len(robot.range):
        raise StudyError(
            f"{path} has {table.n_sensors} sensors, and robot {robot.name!r} has {len(robot.range)}. Name the robot "
            "that was measured: --base ROBOT. For a round robot without a file, give --radius-mm."
        )
    seen = _seen(table, hold_out, seed)
    try:
        frame, notes = _frame(table, robot, seen, is_placed=radius is not None)
        bearing = frame.bearings(table.sensor, table.bearing_left(clockwise=frame.clockwise), robot)
        fit = fit_range_table(
            table.sensor[seen],
            table.distance[seen],
            bearing[seen],
            table.readings[seen],
            robot,
            measured_from=frame.measured_from,
            bearing_from="body",
            hold_out=False,
            seed=seed,
        )
    except ValueError as error:
        raise StudyError(f"{path}: {error}") from None
    compared = None
    if not seen.all():
        fitted = robot.with_numbers(fit.numbers)
        compared = _compare(table, bearing, seen, robot, fitted, frame, hold_out)
    notes = [*table.notes, *notes, *fit.notes]
    parts = chosen_parts(replace(fit, notes=tuple(notes)), compared, {})
    made = calibration_of("sensors", parts, name, str(path), table_map.label, "cells", (), "", seed)
    return made.model_copy(update={"trials": 1, "measured": measured_at(Path(path))})


def _map_of(path: str | Path, map_file: str | Path | None) -> TableMap:
    file = map_beside(path) if map_file is None else Path(map_file)
    return load_table_map(file) if map_file is not None or file.is_file() else TableMap()


def _write_robot(table: RangeTable, radius: float, file: Path) -> Path:
    """Write the file of a round robot with the sensors of a table, clockwise if nobody says how bearings grow."""
    if table.bearing_from == "sensor":
        raise StudyError(
            "--radius-mm places the sensors by the bearings of the table, but the mapping has bearing_from = 'sensor'. "
            "Write a robot file with the mounts of the sensors, and name it with --base."
        )
    text = round_robot(table, radius, file.name.split(".")[0], clockwise=table.clockwise is not False)
    write_whole(file, text.encode())
    return file


def _frame(
    table: RangeTable, robot: RobotModel, seen: NDArray[np.bool_], *, is_placed: bool
) -> tuple[TableFrame, list[str]]:
    """Return how distances and bearings count: by the mapping, or so that the sensors fit the table best.

    Args:
        table: The table.
        robot: The robot with its nominal numbers.
        seen: (n,) whether the fit sees each reading.
        is_placed: Whether the table itself placed the sensors by bearings from the robot's heading.
    """
    bearings: tuple[BearingFrom, ...] = ("body", "sensor")
    if table.bearing_from is not None:
        bearings = (table.bearing_from,)
    elif is_placed:
        bearings = ("body",)
    elif not np.ptp(table.bearing):
        bearings = ("sensor" if table.measured_from == "sensor" else "body",)
    turns = (True, False) if table.clockwise is None else (table.clockwise,)
    frames = [
        TableFrame(point, bearing, clockwise)
        for bearing in bearings
        for point in ((table.measured_from,) if table.measured_from else POINTS[bearing])
        for clockwise in (turns if np.ptp(table.bearing) else (False,))
    ]
    if len(frames) == 1:
        return frames[0], []
    rows = table.sensor[seen], table.distance[seen], table.bearing[seen], table.readings[seen]
    frame, errors = choose_frame(*rows, robot, frames)
    others = sorted((error, str(other)) for other, error in errors.items() if other != frame)
    note = (
        f"The mapping leaves open how the table counts. Taken: {frame} (error of a first fit: {errors[frame]:.3f}). "
        f"Otherwise: {'; '.join(f'{other} ({error:.3f})' for error, other in others[:MOST_OTHERS])}. To choose, set "
        "bearing_from, clockwise, and measured_from in the mapping."
    )
    return frame, [note]


def _seen(table: RangeTable, hold_out: HoldOut, seed: int) -> NDArray[np.bool_]:
    """Return whether the fit sees each reading."""
    row, column = place_ranks(table.distance, table.bearing)
    if hold_out == "blocks":
        return np.asarray((row + column) % 2 == 0)
    n_columns = int(column.max()) + 1
    places = np.random.default_rng(seed).random((int(row.max()) + 1) * n_columns) >= hold_out
    return np.asarray(places[row * n_columns + column])


def _compare(
    table: RangeTable,
    bearing: NDArray[np.float64],
    seen: NDArray[np.bool_],
    nominal: RobotModel,
    fitted: RobotModel,
    frame: TableFrame,
    hold_out: HoldOut,
) -> Compared:
    """Return errors at the places that the fit did not see."""

    def predicted(robot: RobotModel) -> NDArray[np.float64]:
        return predict_range_table(
            table.sensor,
            table.distance,
            bearing,
            robot,
            measured_from=frame.measured_from,
            bearing_from="body",
        )

    looked_up = look_up_readings(table.sensor, table.distance, table.bearing, table.readings, seen)
    off = {
        FITTED: predicted(fitted) - table.readings,
        NOMINAL: predicted(nominal) - table.readings,
        TABLE: looked_up - table.readings,
    }
    between = (table.readings > BETWEEN[0]) & (table.readings < BETWEEN[1])

    def errors(rows: NDArray[np.bool_]) -> dict[str, float]:
        errors = {name: _rms(values[rows & ~seen]) for name, values in off.items()}
        noise = math.sqrt(errors[NOMINAL] ** 2 + JyroPlatform.default_noise**2 / 3)
        return {FITTED: errors[FITTED], NOMINAL: errors[NOMINAL], NOISE: noise, TABLE: errors[TABLE]}

    where = "at every second place" if hold_out == "blocks" else f"at {hold_out:.0%} of the places"
    everywhere = np.ones(len(seen), np.bool_)
    name = f"where {BETWEEN[0]:g} < reading < {BETWEEN[1]:g}"
    return Compared(
        f"root mean square error of the readings {where}",
        "",
        int((~seen).sum()),
        errors(everywhere),
        {name: errors(between)} if (between & ~seen).any() else {},
        _by_condition(table, bearing, errors, ~seen),
    )


def _by_condition(
    table: RangeTable,
    bearing: NDArray[np.float64],
    errors: Callable[[NDArray[np.bool_]], dict[str, float]],
    unseen: NDArray[np.bool_],
) -> dict[str, dict[str, dict[str, float]]]:
    """Return errors by sensor, distance and bearing."""
    conditions: dict[str, dict[str, NDArray[np.bool_]]] = {
        "sensor": {str(k): table.sensor == k for k in np.unique(table.sensor)}
    }
    edges = np.linspace(table.distance.min(), table.distance.max(), N_DISTANCES + 1)
    if np.ptp(table.distance):
        band = np.clip(np.searchsorted(edges, table.distance, side="right") - 1, 0, N_DISTANCES - 1)
        conditions["distance [mm]"] = {
            f"{1000 * edges[k]:.3g} to {1000 * edges[k + 1]:.3g}": band == k for k in range(N_DISTANCES)
        }
    if np.ptp(bearing):
        around = np.degrees(bearing) % 360
        width = 360 / N_BEARINGS
        conditions["bearing [deg]"] = {
            f"{k * width:.0f} to {(k + 1) * width:.0f}": (around >= k * width) & (around < (k + 1) * width)
            for k in range(N_BEARINGS)
        }
    return {
        kind: {name: errors(rows) for name, rows in each.items() if (rows & unseen).any()}
        for kind, each in conditions.items()
    }


def _rms(values: NDArray[np.float64]) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else math.nan
