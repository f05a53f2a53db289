"""Words and units in the names of columns."""

from __future__ import annotations

import re
from pathlib import Path

UNITS = {
    "mm": "mm", "millimeters": "mm", "cm": "cm", "centimeters": "cm", "m": "m", "meters": "m", "in": "in",
    "inches": "in", "rpm": "rpm", "deg": "deg", "degrees": "deg", "rad": "rad", "radians": "rad", "ticks": "ticks",
    "percent": "percent", "pct": "percent",
}  # fmt: skip


def tokens_of(name: str) -> list[str]:
    """Return the words of a name, in lower case: leftSpeed_mm_s has left, speed, mm, s."""
    name = re.sub(r"([a-z])([A-Z])", r"\1 \2", name)
    return [part for part in re.split(r"[^a-zA-Z0-9]+", name.lower()) if part]


def unit_in(name: str, default: str) -> str:
    """Return the unit in a name, without that of the time."""
    return next((UNITS[token] for token in reversed(tokens_of(name)[1:]) if token in UNITS), default)


def map_name(path: Path) -> str:
    """Return the name of the mapping next to a log."""
    return "map.toml in the folder" if path.is_dir() else f"{path.name.split('.')[0]}.map.toml"
