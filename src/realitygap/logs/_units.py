"""Units of logs: their values in meters, radians, and seconds, and their words in the names of columns."""

from __future__ import annotations

import difflib
import math
import re

from realitygap.errors import LogError

TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0}
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
ANGLES = {"rad": 1.0, "deg": math.pi / 180, "turn": 2 * math.pi}
SPEEDS = {f"{name}/s": value for name, value in LENGTHS.items()}
RATES = {f"{name}/s": value for name, value in ANGLES.items()} | {"rpm": 2 * math.pi / 60}
SHARES = {"share": 1.0, "percent": 0.01}
TICKS = ("ticks", "ticks/s")
LEVEL = "level"


def unit_factor(place: str, unit: str, *tables: dict[str, float]) -> float:
    """Return the factor that turns a number in a unit into SI.

    Args:
        place: The setting that names the unit, for the message.
        unit: The unit.
        tables: The units that are possible there.

    Raises:
        LogError: There is no such unit.
    """
    known = {name: value for table in tables for name, value in table.items()}
    if unit not in known:
        near = difflib.get_close_matches(unit, known, n=1, cutoff=0.5)
        hint = f" Did you mean {near[0]!r}?" if near else ""
        raise LogError(f"{place} is {unit!r}, expected {', '.join(known)}.{hint}")
    return known[unit]


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
