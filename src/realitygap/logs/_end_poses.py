"""Tables of trials of one task on several platforms, with the start and the end of each motion."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import polars as pl

from realitygap._limits import MOST_TABLE_BYTES, read_file
from realitygap.errors import LogError

COLUMNS = ("platform", "trial", "start_x_m", "start_y_m", "end_x_m", "end_y_m")


@dataclass(frozen=True)
class EndPoses:
    """Start and end of an object in each trial of several platforms.

    Attributes:
        table: A row for each trial with the columns of `COLUMNS`; lengths in meters. An end is null in trials that
            have none, such as those of a simulator that diverged.
    """

    table: pl.DataFrame

    def platforms(self) -> list[str]:
        """Return the platforms, in the order of the table."""
        return self.table["platform"].unique(maintain_order=True).to_list()

    def of(self, platform: str) -> pl.DataFrame:
        """Return the trials of a platform that have an end.

        Raises:
            LogError: There is none of this name.
        """
        if platform not in self.platforms():
            raise LogError(
                f"There is no platform {platform!r}. The table has: {', '.join(self.platforms())}."
            )
        return self.table.filter(pl.col("platform") == platform).drop_nulls()


def read_end_poses(path: str | Path) -> EndPoses:
    """Return a CSV file of trials: platform, trial, start_x_m, start_y_m, end_x_m, end_y_m.

    Raises:
        LogError: The file cannot be read, lacks a column, or has a cell that is no number.
    """
    path = Path(path)
    try:
        data = read_file(path, MOST_TABLE_BYTES)
    except OSError as error:
        raise LogError(f"Cannot read {path}: {error.strerror or error}. Name a CSV file.") from None
    try:
        texts = pl.read_csv(data, infer_schema=False)
    except pl.exceptions.PolarsError as error:
        raise LogError(f"{path} is no CSV table: {str(error).splitlines()[0]}.") from None
    missing = [name for name in COLUMNS if name not in texts.columns]
    if missing:
        raise LogError(f"{path} has no column {', '.join(missing)}. Expected {', '.join(COLUMNS)}.")
    table = texts.select(
        *COLUMNS[:2], *(pl.col(name).cast(pl.Float64, strict=False).fill_nan(None) for name in COLUMNS[2:])
    )
    for name in COLUMNS[2:]:
        odd = table[name].is_null() & ~texts[name].fill_null("").str.to_lowercase().is_in(
            ["", "nan", "inf", "-inf"]
        )
        if odd.any():
            row = int(odd.arg_max() or 0)
            raise LogError(f"{path}: row {row + 1} has {texts[name][row]!r} in {name}, expected a number.")
    return EndPoses(table)
