"""Units of logs, and what a number in each is in meters, radians, and seconds."""

from __future__ import annotations

import difflib
import math

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
