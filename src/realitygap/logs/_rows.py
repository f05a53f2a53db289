"""Checks of the rows of a part: times must increase, and numbers must be numbers."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import LogError

from ._source import Floats

ADVICE = (
    "Mend the log, or leave such rows out: `realitygap import --drop-bad-rows`, and the same for calibrate."
)
OF_INCREMENTS = "Mend the log: a row of increments cannot be left out, because its distance would be lost."


class RowChecker:
    """Checks the rows of one part, batch after batch.

    Args:
        path: The log, for messages.
        part: Name of the part, such as commands.
        names: Names of its columns.
        needs_all: True if a missing number is a mistake. For poses it is not: the robot was not observed there.
        drop: True to leave out rows with mistakes.
        advice: Next step, for messages.
    """

    def __init__(
        self, path: Path, part: str, names: list[str], *, needs_all: bool, drop: bool, advice: str = ADVICE
    ) -> None:
        self._path, self._part, self._names, self._advice = path, part, names, advice
        self._needs_all, self._drop = needs_all, drop
        self._last = -math.inf
        self.n_rows = self.n_dropped = self.n_unseen = 0

    def __call__(self, first: int, times: Floats, values: Floats) -> tuple[Floats, Floats]:
        """Return the times and values of the rows that count.

        Raises:
            LogError: A row has a mistake, and such rows are not to be left out.
        """
        self.n_rows += len(times)
        is_whole: NDArray[np.bool_] = np.asarray(np.isfinite(values).all(1))
        if not self._needs_all:
            is_unseen = np.isnan(values).any(1) & ~np.isinf(values).any(1)
            self.n_unseen += int(is_unseen.sum())
            first_rows, times, values = (
                self._rows(first, len(times))[~is_unseen],
                times[~is_unseen],
                values[~is_unseen],
            )
            is_whole = is_whole[~is_unseen]
        else:
            first_rows = self._rows(first, len(times))
        if not np.isfinite(times).all():
            self._mistake(first_rows, ~np.isfinite(times), "has no time")
        if not is_whole.all():
            self._mistake(first_rows, ~is_whole, f"has no number in {self._blank(values, ~is_whole)}")
        is_good = is_whole & np.isfinite(times)
        first_rows, times, values = first_rows[is_good], times[is_good], values[is_good]
        if not len(times):
            return times, values
        latest = np.maximum.accumulate(np.concatenate([[self._last], times]))[:-1]
        is_later = times > latest
        if not is_later.all():
            same: NDArray[np.bool_] = np.asarray(times == latest)
            if same[~is_later].all():
                self._mistake(
                    first_rows, same, f"repeats the time {times[np.argmax(same)]:.6g} of a row before it"
                )
            else:
                back: NDArray[np.bool_] = np.asarray(times < latest)
                k = int(np.argmax(back))
                self._mistake(
                    first_rows, back, f"goes back in time, from {latest[k]:.6g} to {times[k]:.6g} s"
                )
                self.n_dropped += int(same.sum())
            times, values = times[is_later], values[is_later]
        self._last = float(times[-1]) if len(times) else self._last
        return times, values

    @staticmethod
    def _rows(first: int, n: int) -> NDArray[np.int64]:
        return np.arange(first, first + n)

    def _blank(self, values: Floats, where: NDArray[np.bool_]) -> str:
        row = values[np.argmax(where)]
        return " and ".join(
            name for name, value in zip(self._names, row, strict=False) if not np.isfinite(value)
        )

    def _mistake(self, rows: NDArray[np.int64], where: NDArray[np.bool_], what: str) -> None:
        n = int(where.sum())
        if not self._drop:
            row = rows[np.argmax(where)]
            more = f"; {n - 1} more near it" if n > 1 else ""
            raise LogError(f"{self._path}: row {row} of [{self._part}] {what}{more}. {self._advice}")
        self.n_dropped += n

    @property
    def notes(self) -> list[str]:
        """The number of rows that were left out, in words."""
        notes = []
        if self.n_dropped:
            notes.append(
                f"{self._part}: {self.n_dropped} of {self.n_rows} rows had mistakes and were left out."
            )
        if self.n_unseen:
            notes.append(
                f"{self._part}: {self.n_unseen} of {self.n_rows} rows have no numbers: not seen there."
            )
        return notes
