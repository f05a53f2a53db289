"""The mapping of a log: which column is what, in which unit, with which sign, and by which clock."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import BeforeValidator, Field, model_validator

from realitygap._limits import MOST_TOML_BYTES, is_file, parse_toml, read_file
from realitygap._named_file import NamedFileError, named_file
from realitygap._toml import toml_table
from realitygap.errors import LogError
from realitygap.settings import Settings


def _column(value: Any) -> Any:
    """Return a column by its number, counted from 1, as the name that columns without names have."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


Column = Annotated[str, BeforeValidator(_column)]
Sign = Literal[1, -1]
Map = TypeVar("Map", bound=Settings)


class TextFormat(Settings):
    """The notation of a text file. Each setting is found out if it is not given."""

    separator: Literal["", ",", ";", "tab", "space"] = Field("", description="Separator of the columns.")
    decimal: Literal["", ".", ","] = Field("", description="Mark before the fraction of a number.")
    header: bool | None = Field(None, description="True if the first line has the names of the columns.")
    names: tuple[str, ...] = Field((), description="Names of the columns, if the file has none.")
    skip_lines: int = Field(0, ge=0, description="Lines before the table.")


class Part(Settings):
    """Settings that all parts of a log have."""

    file: str = Field("", description="File of this part, next to the log. Default: the log itself.")
    rows: str = Field(
        "",
        description="Text in the first column of the rows of this part, such as odom2diff. Default: all rows.",
    )
    time: Column = Field(
        "",
        description="Column of the time. Default: of a bag, the stamp in the header of the messages, or the time of "
        "recording (@time); otherwise `rate_hz` is needed.",
    )
    time_unit: str = Field("s", description="Unit of the time: s, ms, us, ns, or min.")
    rate_hz: float = Field(0.0, ge=0, description="Rows each second, if no column has the time [Hz].")
    offset_s: float = Field(0.0, description="Added to the time, for a clock that is off [s].")

    def columns(self) -> list[str]:
        """Return the columns that hold its values, in order."""
        raise NotImplementedError


class WheelPart(Part):
    """A left and a right wheel."""

    left: Column = Field("", description="Column of the left wheel.")
    right: Column = Field("", description="Column of the right wheel.")
    left_sign: Sign = Field(1, description="-1 if the left wheel counts backward.")
    right_sign: Sign = Field(1, description="-1 if the right wheel counts backward.")
    wheel_diameter_mm: float = Field(
        0.0, ge=0, description="Needed for rad/s, deg/s, rpm, rad, deg, and turn."
    )
    ticks_per_m: float = Field(0.0, ge=0, description="Needed for ticks and ticks/s.")
    per: Literal["", "row"] = Field(
        "",
        description="row if a number is the increment since the row before, such as ticks or meters. Default: commands "
        "are speeds, and encoders count on.",
    )

    @model_validator(mode="before")
    @classmethod
    def _increments_have_units_of_distances(cls, values: Any) -> Any:
        if isinstance(values, dict) and values.get("per") == "row":
            return {"unit": "m", **({"turn_unit": "rad"} if values.get("turn") else {}), **values}
        return values


class Commands(WheelPart):
    """Commands to the robot: the speeds of both wheels, or forward speed and turn rate."""

    forward: Column = Field("", description="Column of the forward speed, instead of both wheels.")
    turn: Column = Field("", description="Column of the turn rate, positive to the left.")
    unit: str = Field(
        "m/s",
        description="Unit of wheels or forward speed: m/s, cm/s, mm/s, in/s, share (-1 to 1), percent, level, ticks/s, "
        "rad/s, deg/s, turn/s, or rpm. With per = row: m, cm, mm, in, ticks, rad, deg, or turn.",
    )
    turn_unit: str = Field(
        "rad/s",
        description="Unit of the turn rate: rad/s, deg/s, turn/s, rpm, share, or percent. With per = row: rad, deg, or "
        "turn.",
    )
    turn_sign: Sign = Field(1, description="-1 if a positive rate turns the robot to the right.")
    full: float = Field(0.0, ge=0, description="Number that stands for full speed; needed for unit level.")

    @model_validator(mode="after")
    def _has_both(self) -> Self:
        wheels, twist = (self.left, self.right), (self.forward, self.turn)
        if not (all(wheels) and not any(twist)) and not (all(twist) and not any(wheels)):
            raise ValueError("expected left and right, or forward and turn")
        return self

    def columns(self) -> list[str]:
        """Return the columns that hold its values, in order."""
        return [self.left, self.right] if self.left else [self.forward, self.turn]


class Wheels(WheelPart):
    """Encoders of the wheels: counters, increments, or speeds."""

    unit: str = Field(
        "m",
        description="Unit of distances: m, cm, mm, in, ticks, rad, deg, or turn. Speeds, which are summed up, "
        "have the same with /s, or rpm.",
    )
    wraps_at: float = Field(
        0.0, ge=0, description="Number at which a counter starts again at 0, such as 65536."
    )

    @model_validator(mode="after")
    def _has_both(self) -> Self:
        if not (self.left and self.right):
            raise ValueError("expected left and right")
        if self.per and self.wraps_at:
            raise ValueError("wraps_at is for counters, and per = row for increments: expected one of them")
        return self

    def columns(self) -> list[str]:
        """Return the columns that hold its values, in order."""
        return [self.left, self.right]


class Poses(Part):
    """Positions of the robot, seen by a camera, motion capture, or a laser tracker."""

    x: Column = Field(description="Column of x.")
    y: Column = Field(description="Column of y.")
    heading: Column = Field("", description="Column of the heading. Default: the log has none.")
    quaternion: tuple[Column, ...] = Field(
        (), max_length=4, description="Columns x, y, z, w of the orientation, instead of the heading."
    )
    unit: str = Field("m", description="Unit of x and y: m, cm, mm, or in.")
    heading_unit: str = Field("rad", description="Unit of the heading: rad, deg, or turn.")
    clockwise: bool = Field(
        False, description="True if headings grow clockwise while y points to the left of x."
    )
    y_down: bool = Field(
        False, description="True if y points down, as in images: y and headings change sign."
    )
    heading_offset_deg: float = Field(0.0, description="Added to the heading: 90 if 0 is along +y.")
    marker_x_mm: float = Field(
        0.0, description="Position of the observed point ahead of the middle between the wheels."
    )
    marker_y_mm: float = Field(
        0.0, description="Position of the observed point to the left of the middle between the wheels."
    )

    @model_validator(mode="after")
    def _has_one_heading(self) -> Self:
        if self.quaternion and (self.heading or len(self.quaternion) != 4):
            raise ValueError("expected a heading, or a quaternion of four columns, and not both")
        if (self.marker_x_mm or self.marker_y_mm) and not (self.heading or self.quaternion):
            raise ValueError("marker_x_mm and marker_y_mm need a heading")
        return self

    def columns(self) -> list[str]:
        """Return the columns that hold its values, in order."""
        return [self.x, self.y, *([self.heading] if self.heading else self.quaternion)]


class Readings(Part):
    """Range sensors, in the order of the robot file."""

    sensors: tuple[Column, ...] = Field(min_length=1, description="Column of each range sensor.")
    full: float = Field(1.0, gt=0, description="Number that stands for the largest reading, such as 1023.")
    inverted: bool = Field(
        False, description="True if 0 is the largest reading and `full` means nothing seen."
    )

    def columns(self) -> list[str]:
        """Return the columns that hold its values, in order."""
        return list(self.sensors)


class MapFile(Settings):
    """A mapping that a file keeps."""

    def to_toml(self) -> str:
        """Return the text of its file, without the defaults; the tables come last."""
        values = self.model_dump(exclude_defaults=True)
        tables = [(name, values.pop(name)) for name in tuple(values) if isinstance(values[name], dict)]
        lines = [toml_table(values)] if values else []
        return "\n\n".join([*lines, *(f"[{name}]\n{toml_table(table)}" for name, table in tables)]) + "\n"


class LogMap(MapFile):
    """The mapping of a log."""

    robot: str = Field("", description="The robot that drove: a name or a file. `--base` takes precedence.")
    speed: float = Field(
        0.0, ge=0, description="Wheel speed at full command that replaces the robot file's [m/s]."
    )
    track: float = Field(
        0.0, ge=0, description="Distance between the wheels that replaces the robot file's [m]."
    )
    step_s: float = Field(
        0.0, ge=0, description="Length of a step after resampling [s]. Default: the interval of the commands."
    )
    trial: Column = Field(
        "", description="Column whose value changes from trial to trial. Default: one trial."
    )
    arena: str = Field("", description="Arena that it drove in, by name or file. Default: an open plane.")
    controller: str = Field(
        "", description="File of the controller that drove it, as `realitygap export` writes it."
    )
    label: Literal["SIM", "TWIN", "EMULATED", "REAL"] = Field(
        "REAL", description="Label of figures of this log."
    )
    text: TextFormat = TextFormat()
    commands: Commands | None = Field(None, description="Commands to the robot.")
    wheels: Wheels | None = Field(None, description="Counts of its encoders.")
    poses: Poses | None = Field(None, description="Observed poses.")
    readings: Readings | None = Field(None, description="Readings of its range sensors.")

    @model_validator(mode="after")
    def _has_motion(self) -> Self:
        if self.commands is None and self.wheels is None:
            raise ValueError(
                "expected [commands], [wheels], or both: poses alone do not show what the wheels did"
            )
        return self

    @property
    def parts(self) -> dict[str, Part]:
        """The parts that the log has, by name."""
        parts = {
            "commands": self.commands,
            "wheels": self.wheels,
            "poses": self.poses,
            "readings": self.readings,
        }
        return {name: part for name, part in parts.items() if part is not None}


def load_log_map(path: str | Path) -> LogMap:
    """Return the mapping in a TOML file; files that it names lie next to it, or in the working folder.

    Raises:
        LogError: The file cannot be read, has mistakes, or names a file elsewhere; the message has each with its place.
    """
    path = Path(path)
    values = read_map(path)
    for key in ("robot", "arena", "controller"):
        name = values.get(key)
        if isinstance(name, str) and name:
            values[key] = _path_of(path, key, name)
    return checked_map(LogMap, values, path)


def _path_of(path: Path, key: str, name: str) -> str:
    """Return the path of a file that a mapping names; a name of realitygap's own as it is."""
    try:
        return str(named_file(path.parent, name))
    except NamedFileError as error:
        is_free = not Path(name).is_absolute() and ".." not in Path(name).parts and "\0" not in name
        if is_free and not (path.parent / name).exists() and (is_file(name) or not Path(name).exists()):
            return name
        raise LogError(f"{path}: {key}: {error}") from None


def read_map(path: Path) -> dict[str, Any]:
    """Return the values in the TOML file of a mapping.

    Raises:
        LogError: The file cannot be read, or is not TOML.
    """
    try:
        return parse_toml(read_file(path, MOST_TOML_BYTES).decode())
    except OSError as error:
        raise LogError(
            f"Cannot read the mapping {path}: {error.strerror or error}. Name a TOML file."
        ) from None
    except ValueError as error:
        raise LogError(f"{path}: it is not TOML: {error}.") from None


def checked_map(kind: type[Map], values: dict[str, Any], path: Path) -> Map:
    """Return the mapping with these values.

    Raises:
        LogError: It has mistakes; the message has each with its place.
    """
    try:
        return kind(**values)
    except ValueError as error:
        name = kind.__name__
        lines = [line.removeprefix(f"{name}.").removeprefix(f"{name}: ") for line in str(error).split("\n")]
        raise LogError("\n".join(f"{path}: {line}" for line in lines)) from None
