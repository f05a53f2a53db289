"""A log as a source of numbers: batches of some of its columns, in order, so that files of any size fit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import LogError, did_you_mean

Floats = NDArray[np.float64]
RECORDED = "@time"
"""The column of a bag that has the time at which a message was recorded [s]."""


@dataclass(frozen=True)
class Batch:
    """Some rows of a log.

    Attributes:
        first: Number of its first row, counted from 1.
        columns: (b,) float64 of each column; nan for a missing number. Times are in the unit of the log.
    """

    first: int
    columns: Mapping[str, Floats]


class Source(Protocol):
    """A file or folder with the numbers of a log.

    Attributes:
        path: The file or folder.
        is_table: True if its columns have the same rows. The columns of a bag have the rows of their topics.
        rate_hz: Rows each second, if the format says so; 0 otherwise.
    """

    path: Path
    is_table: bool
    rate_hz: float

    def columns(self) -> list[str]:
        """Return the names of all columns with numbers."""

    def time_of(self, names: Sequence[str]) -> str:
        """Return the column of the time of columns, if the format has one; empty otherwise."""

    def batches(self, names: Sequence[str], rows: str = "") -> Iterator[Batch]:
        """Yield the rows of columns, in order.

        Args:
            names: The columns.
            rows: Text in the first column of the rows that count; all if empty.

        Raises:
            LogError: There is no such column, or the file is damaged.
        """


def check_columns(source: Source, names: Sequence[str]) -> None:
    """Raise an error if a source lacks one of these columns.

    Raises:
        LogError: It does; the message names all that it lacks, and those that it has.
    """
    known = source.columns()
    missing = [name for name in dict.fromkeys(names) if name not in known]
    if not missing:
        return
    shown = ", ".join(known[:MOST_SHOWN]) + (
        f", and {len(known) - MOST_SHOWN} more" if known[MOST_SHOWN:] else ""
    )
    hint = did_you_mean(missing[0], known)
    raise LogError(
        f"{source.path} has no column {' and no column '.join(missing)}. It has: {shown}."
        + (f" {hint}" if hint.startswith("Did") else " Name the right columns in the mapping.")
    )


MOST_APART_S = 3.0
"""Time between a stamp and the recording of its message beyond which their clocks have nothing in common [s]."""
MOST_SHOWN = 40
"""Names of columns in a message."""
