"""The column of the time of a table, and its unit, guessed by names and values."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from realitygap.errors import LogError

from ._open import map_name
from ._source import MOST_APART_S, MOST_SHOWN, Floats, Source
from ._units import TIMES, tokens_of

WORDS = ("time", "t", "timestamp", "stamp", "sec", "secs", "seconds", "elapsed", "clock", "ts")
OTHER = {"left", "right", "lap", "delta", "diff", "dt", "sample", "sampling", "step", "exec", "processing", "delay",
         "period", "duration", "valid", "seq", "nsec", "nsecs", "nanosec"}  # fmt: skip
"""Words of columns that are no times, or parts of them."""
TIME_WORDS = {"ms": "ms", "msec": "ms", "millis": "ms", "us": "us", "usec": "us", "micros": "us", "ns": "ns",
              "nsec": "ns", "nanos": "ns", "min": "min"}  # fmt: skip
EPOCHS = {"s": 1e9, "ms": 1e12, "us": 1e15, "ns": 1e18}
"""Times since 1970 lie between this number and three times as much, from 2001 to 2065."""
MOST_STEP_S = 10.0
"""Time between rows beyond which a column is not in the unit that it seems to be in [s]."""
ASCENDS = 0.95
"""Share of rows in which a time does not go back."""


def add_times(source: Source, names: Sequence[str], parts: dict[str, Any]) -> None:
    """Add the column and unit of the time to parts of a mapping: of their message's header if it has a stamp.

    Raises:
        LogError: No column looks like the time.
    """
    candidates = sorted((name for name in names if _is_time(name) and not _is_part(name, names)), key=_order)
    first = next(iter(source.batches(candidates)), None) if candidates else None
    values = {} if first is None else {name: first.columns[name] for name in candidates}
    values = {name: times for name, times in values.items() if _ascends(times)}
    general = next(iter(values), "") if first is not None else next(iter(candidates), "")
    if not general:
        if source.rate_hz:
            return
        raise LogError(
            f"{source.path}: no column looks like the time: {', '.join(names[:MOST_SHOWN])}. Write a mapping with "
            f"`time`, or `rate_hz`, next to it: {map_name(source.path)}."
        )
    units = {name: time_unit(name, times) for name, times in values.items()}
    for part in parts.values():
        column = str(part.get("left") or part.get("forward") or part.get("x") or part["sensors"][0])
        name = next((stamp for stamp in values if _is_stamp_of(stamp, column)), general)
        if name != general and not _is_near(values[name], units[name], values[general], units[general]):
            name = general
        part |= {"time": name, "time_unit": units.get(name) or "s"}


def _is_time(name: str) -> bool:
    tokens = tokens_of(name)
    is_one = len(tokens) == 1 and any(tokens[0].startswith(word) for word in WORDS if len(word) > 2)
    return (is_one or bool(set(WORDS) & set(tokens))) and not OTHER & set(tokens)


def _is_part(name: str, names: Sequence[str]) -> bool:
    """Return whether a column has the seconds of a stamp that is a column, too."""
    return re.sub(r"[._/](sec|secs|seconds)$", "", name) in set(names) - {name}


def _order(name: str) -> tuple[bool, int, int]:
    """Return a key to sort columns: those of a message's header last, and the shortest of those with one word first."""
    tokens = tokens_of(name)
    return "header" in tokens, min((WORDS.index(t) for t in tokens if t in WORDS), default=0), len(tokens)


def _ascends(times: Floats) -> bool:
    steps = np.diff(times[np.isfinite(times)])
    return not len(steps) or float((steps >= 0).mean()) >= ASCENDS


def _is_stamp_of(stamp: str, column: str) -> bool:
    """Return whether a column is the stamp in the header of the message that another column is of."""
    root, header, _ = re.sub(r"[./]stamp$", "", stamp).rpartition("header")
    return bool(header) and stamp.endswith("stamp") and column.startswith(root)


def _is_near(times: Floats, unit: str, others: Floats, other_unit: str) -> bool:
    """Return whether two columns of times are nearly the same."""
    if not (unit and other_unit):
        return False
    apart = times * TIMES[unit] - others * TIMES[other_unit]
    return bool(np.isfinite(apart).any()) and abs(float(np.nanmedian(apart))) < MOST_APART_S


def time_unit(name: str, times: Floats) -> str:
    """Return the unit of a column of times, by its name or its values; empty if it is unknown."""
    named = next((TIME_WORDS[token] for token in tokens_of(name)[1:] if token in TIME_WORDS), "")
    known = times[np.isfinite(times)]
    if named or len(known) < 2:
        return named or "s"
    at = float(np.median(known))
    for unit, begin in EPOCHS.items():
        if begin <= at < 3 * begin:
            return unit
    return "s" if abs(float(np.median(np.diff(known)))) <= MOST_STEP_S else ""
