"""A table of readings of range sensors, and the file of a round robot whose sensors it places."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from realitygap._limits import MOST_TABLE_BYTES, read_file
from realitygap._toml import toml_table
from realitygap.errors import LogError

from ._guess import SENSOR
from ._source import MOST_SHOWN, Floats, check_columns
from ._table_map import BearingFrom, MeasuredFrom, TableColumns, TableMap
from ._text import TextSource
from ._units import ANGLES, LENGTHS, tokens_of, unit_factor, unit_in

BITS = (8, 10, 12, 16)
"""Bit widths of converters whose largest number may be the full scale of a table."""
_HEAD = re.compile(rb"\s*((?:[-+0-9.]+\s+){4}[-+0-9.]+)\s+TURN", re.IGNORECASE)


@dataclass(frozen=True)
class RangeTable:
    """A table of n readings.

    Attributes:
        sensor: (n,) index of the range sensor, from 0.
        distance: (n,) to the wall [m].
        bearing: (n,) bearing of the wall in the sign of the table [rad].
        readings: (n,) 0 to 1.
        measured_from: The point that distances are measured from; None if neither table nor mapping say it.
        clockwise: True if bearings grow clockwise; None if the mapping does not say it.
        bearing_from: The direction that bearings count from; None if the mapping does not say it.
        notes: Notes on the table.
    """

    sensor: NDArray[np.int64]
    distance: Floats
    bearing: Floats
    readings: Floats
    measured_from: MeasuredFrom | None
    clockwise: bool | None
    bearing_from: BearingFrom | None = None
    notes: tuple[str, ...] = ()

    @property
    def n_sensors(self) -> int:
        """Number of range sensors."""
        return int(self.sensor.max()) + 1

    def bearing_left(self, *, clockwise: bool) -> Floats:
        """Return bearings, positive to the left of the heading, (n,) [rad]."""
        return -self.bearing if clockwise else self.bearing


def read_range_table(path: str | Path, table_map: TableMap | None = None) -> RangeTable:
    """Return a table of readings: in the `.sample` format of evorobotpy, or in a text table.

    A `.sample` file begins with the numbers of sensors, bearings and distances, the first distance and the step of
    distances [mm]. A block `TURN k` for each distance follows, with a row for each bearing, evenly around the robot.

    Args:
        path: The table.
        table_map: Mapping of the table. Default: guessed from the names of its columns.

    Raises:
        LogError: The file is not such a table, is cut off, or has mistakes.
    """
    path, table_map = Path(path), table_map or TableMap()
    try:
        data = read_file(path, MOST_TABLE_BYTES)
    except FileNotFoundError:
        raise LogError(f"There is no file {path}. Name a table of readings.") from None
    except OSError as error:
        raise LogError(f"Cannot read {path}: {error.strerror or error}. Name a table of readings.") from None
    head = _HEAD.match(data)
    if head is not None and table_map.columns is None:
        sensor, distance, bearing, raw = _sample(path, data, [float(part) for part in head[1].split()])
    else:
        sensor, distance, bearing, raw = _text(path, table_map)
    if not len(raw):
        raise LogError(f"{path} has no readings.")
    readings, notes = _scaled(path, raw, table_map)
    if distance.min() < 0:
        raise LogError(f"{path}: a distance is {distance.min():g} m, expected at least 0.")
    return RangeTable(
        sensor,
        distance,
        bearing + math.radians(table_map.first_bearing_deg),
        readings,
        table_map.measured_from or (None if np.ptp(bearing) else "sensor"),
        table_map.clockwise,
        table_map.bearing_from,
        tuple(notes),
    )


def _scaled(path: Path, raw: Floats, table_map: TableMap) -> tuple[Floats, list[str]]:
    """Return readings from 0 to 1, and notes on the full scale."""
    notes = []
    full = table_map.full
    if not full:
        known = [1.0, *(2.0**bits - 1 for bits in BITS)]
        full = next((most for most in known if raw.max() <= most), 0.0)
        if full != 1.0:
            notes.append(f"Readings go up to {raw.max():g}: {full:g} is taken for the full scale.")
    if raw.min() < 0 or raw.max() > full:
        raise LogError(
            f"{path}: readings go from {raw.min():g} to {raw.max():g}, expected 0 to {full:g}. Give `full` in the "
            "mapping, the number that stands for the largest reading."
        )
    shares = raw / full
    return (1 - shares if table_map.inverted else shares), notes


def _sample(
    path: Path, data: bytes, head: Sequence[float]
) -> tuple[NDArray[np.int64], Floats, Floats, Floats]:
    """Return the sensor, distance, bearing and reading of each cell of a `.sample` file."""
    if any(part != int(part) or part < 1 for part in head[:3]) or head[4] <= 0 or head[3] < 0:
        shown = " ".join(f"{part:g}" for part in head)
        raise LogError(
            f"{path} begins with {shown!r}, expected the numbers of sensors, bearings and distances, the first "
            "distance and the step of distances [mm]."
        )
    n_sensors, n_bearings, n_distances = (int(part) for part in head[:3])
    blocks = re.split(rb"TURN[^\n]*\n", re.sub(rb"\s+END\s*\Z", b"", data), flags=re.IGNORECASE)[1:]
    if len(blocks) != n_distances:
        raise LogError(
            f"{path} has {len(blocks)} blocks TURN, and its first line says {n_distances} distances. Is it cut off?"
        )
    tables = []
    for k, block in enumerate(blocks):
        try:
            numbers = np.array(block.split(), np.float64)
        except ValueError as error:
            raise LogError(f"{path}: block TURN {k} has a cell that is no number ({error}).") from None
        if len(numbers) != n_bearings * n_sensors:
            raise LogError(
                f"{path}: block TURN {k} has {len(numbers)} numbers, expected {n_bearings} rows of {n_sensors}. Is it "
                "cut off?"
            )
        if not np.isfinite(numbers).all():
            raise LogError(f"{path}: block TURN {k} has a reading that is no number.")
        tables.append(numbers.reshape(n_bearings, n_sensors))
    cells = np.stack(tables)
    distances = (head[3] + head[4] * np.arange(n_distances)) / 1000
    bearings = 2 * math.pi * np.arange(n_bearings) / n_bearings
    distance, bearing, sensor = np.meshgrid(distances, bearings, np.arange(n_sensors), indexing="ij")
    return sensor.ravel().astype(np.int64), distance.ravel(), bearing.ravel(), cells.ravel()


def _text(path: Path, table_map: TableMap) -> tuple[NDArray[np.int64], Floats, Floats, Floats]:
    """Return the sensor, distance, bearing and reading of each cell of a text table."""
    source = TextSource(path, table_map.text)
    columns = table_map.columns or _guessed(path, source.columns())
    distance_m = unit_factor("columns.distance_unit", columns.distance_unit, LENGTHS)
    bearing_rad = unit_factor("columns.bearing_unit", columns.bearing_unit, ANGLES)
    single = [name for name in (columns.sensor, columns.reading) if name]
    given = [columns.distance, *([columns.bearing] if columns.bearing else []), *single, *columns.sensors]
    check_columns(source, [name for name in given if not name.isdecimal()])
    parts = [dict(batch.columns) for batch in source.batches(given)]
    if not parts:
        raise LogError(f"{path} has no rows.")
    rows = {name: np.concatenate([part[name] for part in parts]) for name in given}
    for name, values in rows.items():
        if not np.isfinite(values).all():
            row = int(np.argmin(np.isfinite(values))) + 1
            raise LogError(f"{path}: row {row} has no number in {name}. Mend it, or leave it out.")
    distance = rows[columns.distance] * distance_m
    bearing = rows[columns.bearing] * bearing_rad if columns.bearing else np.zeros(len(distance))
    if columns.reading:
        index = rows[columns.sensor] if columns.sensor else np.zeros(len(distance))
        if np.any(index != np.round(index)) or index.min() < 0:
            raise LogError(
                f"{path}: {columns.sensor} is {index.min():g} or broken, expected whole numbers from 0."
            )
        return index.astype(np.int64), distance, bearing, rows[columns.reading]
    n = len(columns.sensors)
    readings = np.stack([rows[name] for name in columns.sensors], 1)
    return (
        np.tile(np.arange(n), len(distance)),
        np.repeat(distance, n),
        np.repeat(bearing, n),
        readings.ravel(),
    )


def _guessed(path: Path, names: Sequence[str]) -> TableColumns:
    """Return columns by their names."""

    def find(words: set[str]) -> str:
        return next((name for name in names if words & set(tokens_of(name))), "")

    distance = find({"distance", "dist", "d", "range", "gap", "wall"})
    bearing = find({"bearing", "angle", "heading", "theta", "turn", "phi", "direction", "orientation"})
    reading, sensor = (
        find({"reading", "value", "intensity", "ir", "adc"}),
        find({"sensor", "channel", "id", "index"}),
    )
    family = [name for name in names if SENSOR.match(name) and name not in (distance, bearing)]
    others = [name for name in names if name not in (distance, bearing)]
    sensors: tuple[str, ...] = ()
    if len(family) > 1:
        sensors = tuple(family)
    elif not reading and all(name.isdecimal() for name in others):
        sensors = tuple(others)
    if not distance or not (sensors or reading):
        raise LogError(
            f"{path}: the names of its columns do not say which are distance and readings: "
            f"{', '.join(names[:MOST_SHOWN])}. Write a mapping with [columns], and name it with --map."
        )
    return TableColumns(
        distance=distance,
        distance_unit=unit_in(distance, "m"),
        bearing=bearing,
        bearing_unit=unit_in(bearing, "rad") if bearing else "rad",
        sensors=sensors,
        sensor="" if sensors else sensor,
        reading="" if sensors else reading,
    )


REACH = 1.5
"""Farthest distance of the table times this is the reach of the sensors."""
CONE_DEG = 30
AMPLITUDE = 2.0
DECAY = 0.25
"""Share of the farthest distance in which readings fall to 1/e, before the fit."""
SAME_DIRECTION = 0.98
"""Length of the mean of unit vectors from which on sensors look in one direction: all within about 0.2 rad."""
SPEED, TRACK = 0.1, 1.8
"""Speed [m/s], and track in radii: a table does not show them."""

_ROBOT_HEAD = "# A round robot, made from a table of readings. Its numbers are chosen: calibrate it.\n"


def round_robot(table: RangeTable, radius: float, name: str, *, clockwise: bool) -> str:
    """Return the TOML text of a robot file: a disc with infrared sensors on its rim.

    Each sensor looks where it reads most.

    Args:
        table: Readings at bearings all around.
        radius: Radius of the disc [m].
        name: Name of the robot.
        clockwise: True if the bearings of the table grow clockwise.

    Raises:
        LogError: A sensor reads nothing, or the bearings of the table do not place the sensors.
    """
    if not np.ptp(table.bearing):
        raise LogError(
            "The table has no bearings, which would place the sensors. Write a robot file, and name it with --base."
        )
    bearing = table.bearing_left(clockwise=clockwise)
    farthest = float(table.distance.max())
    sensors, angles = [], []
    for k in range(table.n_sensors):
        at = table.sensor == k
        pull = np.sum(table.readings[at] ** 2 * np.exp(1j * bearing[at])) if at.any() else 0j
        if not abs(pull):
            raise LogError(f"Sensor {k} of the table reads nothing anywhere. Leave it out of the mapping.")
        angle = float(np.angle(pull))
        angles.append(angle)
        sensors.append(
            {
                "x": radius * math.cos(angle), "y": radius * math.sin(angle), "direction": angle,
                "cone_deg": CONE_DEG, "rays": 5, "reach": REACH * farthest + radius, "response": "ir",
                "amplitude": AMPLITUDE, "decay": DECAY * farthest,
            }
        )  # fmt: skip
    if len(angles) > 1 and np.abs(np.mean(np.exp(1j * np.array(angles)))) > SAME_DIRECTION:
        raise LogError(
            f"All {len(angles)} sensors of the table read most at about the same bearing, so bearings seem to count "
            "from each sensor's own direction. Such a table does not show where the sensors are. Write a robot file "
            "with their mounts, and name it with --base."
        )
    values = {
        "name": name,
        "description": f"A disc with {table.n_sensors} infrared sensors, made from a table of their readings.",
        "sources": ["chosen until measured: all but the radius and the directions of the sensors"],
        "drive": {"speed": SPEED, "track": TRACK * radius},
    }
    parts = [_ROBOT_HEAD + toml_table(values), "[[body]]\n" + toml_table({"radius": radius})]
    parts += ["[[range]]\n" + toml_table(sensor) for sensor in sensors]
    return "\n\n".join(parts) + "\n"
