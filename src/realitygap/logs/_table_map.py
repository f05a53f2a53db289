"""The mapping of a table of readings: its columns or the order of its rows, units, and the point of its distances."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, Self

from pydantic import Field, model_validator

from realitygap.settings import Settings

from ._log_map import Column, MapFile, TextFormat, checked_map, read_map

MeasuredFrom = Literal["body", "origin", "sensor"]
BearingFrom = Literal["body", "sensor"]


class TableColumns(Settings):
    """Columns of a table of readings: one reading in each row, or those of all sensors."""

    distance: Column = Field(description="Column of the distance to the wall.")
    distance_unit: str = Field("m", description="Unit of the distance: m, cm, mm, or in.")
    bearing: Column = Field(
        "", description="Column of the bearing of the wall. Default: the sensor faces it."
    )
    bearing_unit: str = Field("rad", description="Unit of the bearing: rad, deg, or turn.")
    sensor: Column = Field(
        "", description="Column of the sensor's index, counted from 0, if a row has one reading."
    )
    reading: Column = Field("", description="Column of the reading, if a row has one.")
    sensors: tuple[Column, ...] = Field(
        (), description="Column of each sensor, if a row has the readings of all."
    )

    @model_validator(mode="after")
    def _has_readings(self) -> Self:
        if bool(self.reading) == bool(self.sensors):
            raise ValueError("expected reading, or sensors, and not both")
        return self


class TableMap(MapFile):
    """The mapping of a table of readings."""

    robot: str = Field(
        "", description="The robot that was measured: a name or a file. `--base` takes precedence."
    )
    measured_from: MeasuredFrom | None = Field(
        None,
        description="Point that distances are measured from: the body's outline, its origin, or the sensor. "
        "Default: the sensor if bearings count from it or if there are none; otherwise the outline.",
    )
    bearing_from: BearingFrom | None = Field(
        None,
        description="Direction that bearings count from: the heading of the body, or the direction in which the robot "
        "file has the sensor look. Default: the one in which the robot fits the table better.",
    )
    clockwise: bool | None = Field(
        None,
        description="True if bearings grow clockwise. Default: the direction in which the robot fits the table better.",
    )
    first_bearing_deg: float = Field(0.0, description="Bearing of the first row; 0 is ahead.")
    full: float = Field(
        0.0,
        ge=0,
        description="Number that stands for the largest reading. Default: 1, or that of 8, 10, 12 or 16 bits.",
    )
    inverted: bool = Field(False, description="True if 0 is the largest reading.")
    label: Literal["SIM", "TWIN", "EMULATED", "REAL"] = Field(
        "REAL", description="Label of figures of this table."
    )
    text: TextFormat = TextFormat()
    columns: TableColumns | None = Field(
        None, description="Columns of a text table. Default: by their names."
    )


def load_table_map(path: str | Path) -> TableMap:
    """Return the mapping in a TOML file.

    Raises:
        LogError: The file cannot be read or has mistakes; the message has each with its place.
    """
    path = Path(path)
    return checked_map(TableMap, read_map(path), path)
