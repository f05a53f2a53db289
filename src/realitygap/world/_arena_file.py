"""An arena as a file describes it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Self

from pydantic import Field, model_validator

from realitygap._toml import toml_table, toml_value
from realitygap.settings import Settings, shown

from ._described import INCH, Described, NotNegative, Number, Positive, in_si
from ._distribution import Distribution
from ._floor import MOST_PIXELS, Floor, FloorImage
from ._obstacle import TAPE_WIDTH, Obstacle
from ._part import Corner, box_as_corners, why_no_part

MOST_CELLS = 256
MOST_WALLS = 2048
FARTHEST = 10_000.0  # from the origin [m]: beyond, 32 bit do not tell millimeters apart
FROM_FILE: dict[str, Any] = {"json_schema_extra": {"hidden": True}}


FILE_UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": INCH}
NO_LENGTHS = ("heading", "strength", "columns", "rows", "per")


def in_meters(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a file in meters and radians: what `unit` says of all lengths, and what keys end in.

    Raises:
        ValueError: There is no such unit, or a number has another one.
    """
    unit = values.get("unit", "m")
    rest = {key: value for key, value in values.items() if key != "unit"}
    named = FILE_UNITS.get(unit, 0.0) if isinstance(unit, str) else unit
    scale = float(named) if type(named) in (int, float) else 0.0
    if not (scale > 0 and math.isfinite(scale)):
        names = ", ".join(f"'{name}'" for name in FILE_UNITS)
        raise ValueError(f"unit: expected {names} or a length in meters, got {shown(unit)}")
    if scale == 1:
        return in_si(rest)
    _refuse_other_units(rest, unit)
    return {key: _scaled(value, scale, key) for key, value in in_si(rest).items()}


def _refuse_other_units(value: Any, unit: object) -> None:
    if isinstance(value, Mapping):
        for key, part in value.items():
            if isinstance(key, str) and key.endswith(("_mm", "_cm", "_in")):
                raise ValueError(
                    f"{key}: the file has unit = {shown(unit)} for all lengths. Keep one of the two"
                )
            _refuse_other_units(part, unit)
    elif isinstance(value, list):
        for part in value:
            _refuse_other_units(part, unit)


def _scaled(value: Any, scale: float, key: str) -> Any:
    """Return a value with all lengths in it times `scale`; the third number of a start is a heading."""
    if key in NO_LENGTHS or isinstance(value, bool):
        return value
    if isinstance(value, int | float):
        return value * scale
    if isinstance(value, Mapping):
        return {name: _scaled(part, scale, name) for name, part in value.items()}
    if isinstance(value, list):
        parts = [_scaled(part, scale, "") for part in value]
        return [*parts[:2], *value[2:]] if key == "start" else parts
    return value


class Row(Settings):
    """A table that a file may write as a list of its numbers."""

    @model_validator(mode="before")
    @classmethod
    def _is_a_whole_row(cls, values: Any) -> Any:
        if not isinstance(values, Mapping | Settings):  # a list of the right length is a table by now
            raise ValueError(f"expected [{', '.join(cls.model_fields)}]")
        return values


class WallEntry(Row):
    """A straight wall from one point to another."""

    x1: Number = Field(description="First end, x [m].")
    y1: Number
    x2: Number = Field(description="Second end, x [m].")
    y2: Number

    @model_validator(mode="after")
    def _has_a_length(self) -> Self:
        if (self.x1, self.y1) == (self.x2, self.y2):
            raise ValueError("it begins where it ends. Leave it out, or move an end")
        return self


class ObstacleEntry(Settings):
    """A box, a convex polygon or a disc."""

    x: Number = Field(0.0, description="Origin of the obstacle, x [m].")
    y: Number = Field(0.0, description="Origin of the obstacle, y [m].")
    heading: Number = Field(0.0, description="Rotation, counter-clockwise [rad].")
    corner: tuple[Corner, ...] = Field(
        (Corner(x=0.0, y=0.0),),
        min_length=1,
        max_length=64,
        description="Corners [x, y] of a polygon around its origin, counter-clockwise, before they are grown; left out "
        "for a disc. box = [length, width] says the outer size of a box.",
    )
    radius: NotNegative = Field(0.0, description="Radius of a disc, or of rounded corners [m].")

    @model_validator(mode="before")
    @classmethod
    def _from_box(cls, values: Any) -> Any:
        return box_as_corners(values)

    @model_validator(mode="after")
    def _is_convex(self) -> Self:
        problem = why_no_part([(corner.x, corner.y) for corner in self.corner], self.radius)
        if problem:
            raise ValueError(problem)
        return self

    def obstacle(self) -> Obstacle:
        """Return the obstacle that it describes."""
        corners = tuple((corner.x, corner.y) for corner in self.corner)
        return Obstacle(self.x, self.y, self.heading, corners, self.radius)


class LightEntry(Settings):
    """A light that shines from a point to all sides."""

    x: Number = Field(description="Position of the light, x [m].")
    y: Number = Field(description="[m].")
    strength: NotNegative = Field(
        1.0, description="Reading of a light sensor of gain 1 that points at the light from 1 m."
    )


class TapeEntry(Row):
    """A dark strip on the floor, along its middle."""

    x1: float
    y1: float
    x2: float
    y2: float


class ImageEntry(Settings):
    """A picture on the floor."""

    x: float = Field(0.0, description="Lower left corner [m].")
    y: float = Field(0.0, description="[m].")
    width: float = Field(gt=0, description="Width of the picture on the floor [m]. Its pixels are square.")
    file: str = Field("", description="Image file in the folder of the arena file. Its brightness counts.")
    columns: int = Field(ge=1, le=MOST_PIXELS, description="Columns of pixels, from the file.", **FROM_FILE)
    rows: int = Field(ge=1, le=MOST_PIXELS, description="Rows of pixels, from the file.", **FROM_FILE)
    pixels: str = Field(description="Pixels, from the file.", **FROM_FILE)


class FloorEntry(Settings):
    """Dark strips and a picture on the floor, which is light elsewhere."""

    tape: tuple[TapeEntry, ...] = Field(
        (), max_length=MOST_WALLS, description="Dark strips [x1, y1, x2, y2] along their middles [m]."
    )
    tape_width: float = Field(TAPE_WIDTH, gt=0, description="Width of the strips [m]. 3/4 in is usual.")
    image: ImageEntry | None = None

    def floor(self) -> Floor:
        """Return the floor that it describes."""
        tape = tuple((strip.x1, strip.y1, strip.x2, strip.y2) for strip in self.tape)
        image = None if self.image is None else FloorImage(**self.image.model_dump(exclude={"file"}))
        return Floor(tape, self.tape_width, image)


class GridEntry(Settings):
    """The cells whose visited share is coverage."""

    x: float = Field(description="Lower left corner [m].")
    y: float = Field(description="[m].")
    cell: float = Field(gt=0, description="Size of a cell [m].")
    columns: int = Field(
        ge=1, le=MOST_CELLS, description=f"Number of columns. The grid has at most {MOST_CELLS} cells."
    )
    rows: int = Field(ge=1, le=MOST_CELLS, description="Number of rows.")

    @model_validator(mode="after")
    def _has_not_too_many(self) -> Self:
        if self.columns * self.rows > MOST_CELLS:
            raise ValueError(
                f"{self.columns} columns of {self.rows} rows are {self.columns * self.rows} cells, expected at most "
                f"{MOST_CELLS} cells"
            )
        return self


class StartEntry(Row):
    """The start of every trial."""

    x: Number = Field(description="[m].")
    y: Number = Field(description="[m].")
    heading: Number = Field(0.0, description="Heading from +x, counter-clockwise [rad].")


class GoalEntry(Row):
    """The goal of the task `goal`."""

    x: Number = Field(description="Center [m].")
    y: Number = Field(description="[m].")
    radius: Positive = Field(description="Largest distance that counts as reached [m].")


class ArenaFile(Described):
    """An arena as its file has it, in meters and radians.

    Raises:
        ValueError: A value is unknown, missing or out of its range; every mistake with its place.
    """

    name: str = Field(min_length=1, max_length=80, description="Name of the arena.")
    description: str = Field("", max_length=2000, description="Description of the arena in one sentence.")
    sources: tuple[str, ...] = Field((), description="Sources of the numbers.")
    wall: tuple[WallEntry, ...] = Field((), max_length=MOST_WALLS, description="Walls [x1, y1, x2, y2].")
    obstacle: tuple[ObstacleEntry, ...] = Field((), max_length=256)
    light: tuple[LightEntry, ...] = Field((), max_length=64)
    floor: FloorEntry = FloorEntry()
    grid: GridEntry | None = Field(
        None, description="Left out: 16 cells along the longer side of the walls, in their middle."
    )
    start: StartEntry
    goal: GoalEntry | None = None

    @model_validator(mode="after")
    def _is_of_a_sensible_size(self) -> Self:
        for name, number in self.numbers().items():
            ends = (number.lowest, number.highest) if isinstance(number, Distribution) else (number,)
            if not name.endswith(NO_LENGTHS) and max(map(abs, ends)) > FARTHEST:
                raise ValueError(f"{name}: expected at most {FARTHEST:g} m, got {max(ends, key=abs):g}")
        return self

    @model_validator(mode="after")
    def _begins_beside_obstacles(self) -> Self:
        for k, entry in enumerate(self.obstacle):
            if entry.obstacle().distance(self.start.x, self.start.y) < 0:
                raise ValueError(f"start: lies within obstacle {k}. Move one of the two")
        return self

    def to_toml(self) -> str:
        """Return the file that keeps it; `load_arena` reads it.

        Raises:
            ValueError: It has a picture on its floor, which is a separate file, or numbers that are drawn.
        """
        if self.floor.image is not None or self.vary:
            what = "numbers that are drawn" if self.vary else "a picture on its floor"
            raise ValueError(f"The arena {self.name!r} has {what}, expected none. Copy its own file.")
        values = self.model_dump(exclude_defaults=True)
        walls = values.pop("wall", ())
        tables = {name: values.pop(name) for name in ("floor", "grid") if values.get(name)}
        lists = {name: values.pop(name, ()) for name in ("obstacle", "light")}
        rows = [f"    {toml_value([wall[end] for end in ('x1', 'y1', 'x2', 'y2')])}," for wall in walls]
        parts = [toml_table(values), "\n".join(["wall = [", *rows, "]"])]
        parts += [f"[{name}]\n{toml_table(table)}" for name, table in tables.items()]
        parts += [f"[[{name}]]\n{toml_table(row)}" for name, table in lists.items() for row in table]
        return "\n\n".join(parts) + "\n"

    def resolved_grid(self) -> GridEntry:
        """Return the grid. Default: 16 cells along the longer side of the walls, in their middle."""
        if self.grid is not None:
            return self.grid
        xs = [x for wall in self.wall for x in (wall.x1, wall.x2)] or [self.start.x - 0.5, self.start.x + 0.5]
        ys = [y for wall in self.wall for y in (wall.y1, wall.y2)] or [self.start.y - 0.5, self.start.y + 0.5]
        across, up = max(xs) - min(xs), max(ys) - min(ys)
        cell = max(across, up) / 16 or 1.0 / 16
        columns, rows = (max(1, math.floor(size / cell + 0.5)) for size in (across, up))
        x = (min(xs) + max(xs) - columns * cell) / 2
        y = (min(ys) + max(ys) - rows * cell) / 2
        return GridEntry(x=x, y=y, cell=cell, columns=columns, rows=rows)
