"""Arenas by name, or from a TOML file with walls, grid, start, lamps and tape."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from realitygap.errors import RobotError, did_you_mean
from realitygap.world import NAMED_STARTS, Arena, Grid, Pose, paper_arena

from ._scene import Lamp, Scene

PRESETS = {"paper": paper_arena}
KEYS = ("name", "walls", "grid", "start", "lamps", "tape")
MOST_CELLS = 256


def open_scene(name: str) -> Scene:
    """The scene of that name, or of a file.

    Args:
        name: "paper", or the path of a TOML file as docs/how-to/emulator.md describes it.

    Raises:
        RobotError: There is no such arena or file, or the file cannot be used; the text says where and why.
    """
    if name in PRESETS:
        return Scene(PRESETS[name]())
    file = Path(name)
    if not file.exists():
        hint = did_you_mean(name, PRESETS)
        raise RobotError(f"No arena {name!r}: neither a file nor a name that is known. {hint}")
    try:
        values = tomllib.loads(file.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise RobotError(f"{file}: not a TOML file that can be read ({error}).") from error
    try:
        return _scene(values, file.stem)
    except ValueError as error:
        raise RobotError(f"{file}: {error}") from error


def _scene(values: dict[str, Any], stem: str) -> Scene:
    for key in values:
        if key not in KEYS:
            raise ValueError(f"unknown key {key!r}. {did_you_mean(key, KEYS)}")
    walls = _lines("walls", values.get("walls"))
    grid = _grid(values.get("grid"))
    name = values.get("name", stem)
    if not isinstance(name, str):
        raise ValueError(f"name is {name!r}, expected text.")
    arena = Arena(name, walls, grid, _start(values.get("start")))
    return Scene(arena, _lamps(values.get("lamps", [])), _lines("tape", values.get("tape", [])))


def _numbers(what: str, value: Any, names: Sequence[str]) -> tuple[float, ...]:
    """A list of as many finite numbers as there are names."""
    is_list = isinstance(value, list) and len(value) == len(names)
    if not is_list or not all(type(part) in (int, float) and math.isfinite(part) for part in value):
        raise ValueError(f"{what} is {value!r}, expected [{', '.join(names)}] in meters.")
    return tuple(map(float, value))


def _lines(key: str, value: Any) -> tuple[tuple[float, float, float, float], ...]:
    if not isinstance(value, list):
        raise ValueError(f"{key} is {value!r}, expected a list of [x1, y1, x2, y2] in meters.")
    lines = []
    for k, line in enumerate(value):
        x1, y1, x2, y2 = _numbers(f"{key}[{k}]", line, ("x1", "y1", "x2", "y2"))
        lines.append((x1, y1, x2, y2))
    return tuple(lines)


def _grid(value: Any) -> Grid:
    parts = ("x", "y", "cell", "columns", "rows")
    if not isinstance(value, dict) or set(value) != set(parts):
        raise ValueError(f"[grid] is {value!r}, expected {', '.join(parts)}.")
    x, y, cell = _numbers("grid's x, y, cell", [value[key] for key in parts[:3]], parts[:3])
    columns, rows = value["columns"], value["rows"]
    counts = all(type(n) is int and n > 0 for n in (columns, rows))
    if cell <= 0 or not counts or columns * rows > MOST_CELLS:
        raise ValueError(
            f"grid has cell {cell:g}, columns {columns!r} and rows {rows!r}; expected a cell larger than 0 and at most "
            f"{MOST_CELLS} cells."
        )
    return Grid(x, y, cell, columns, rows)


def _start(value: Any) -> Pose:
    if value is None:
        raise ValueError("start is missing, expected [x, y, heading] in meters and radians.")
    if isinstance(value, str):
        if value not in NAMED_STARTS:
            raise ValueError(f"start is {value!r}. {did_you_mean(value, NAMED_STARTS)}")
        return NAMED_STARTS[value]
    return Pose(*_numbers("start", value, ("x", "y", "heading")))


def _lamps(value: Any) -> tuple[Lamp, ...]:
    if not isinstance(value, list):
        raise ValueError(f"lamps is {value!r}, expected a list of [x, y, strength].")
    return tuple(Lamp(*_numbers(f"lamps[{k}]", lamp, ("x", "y", "strength"))) for k, lamp in enumerate(value))
