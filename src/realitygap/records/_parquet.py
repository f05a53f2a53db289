"""Frames one after another into one Parquet file, written whole, with memory for one of them."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable
from pathlib import Path

import polars as pl

from realitygap.errors import RecordError


def write_frames(path: Path, frames: Iterable[pl.DataFrame], schema: pl.Schema) -> int:
    """Write frames of one schema to a file. An existing file is replaced once the new one is complete.

    They are first written to separate files, which polars then joins as a stream.

    Returns:
        The number of rows.

    Raises:
        RecordError: it cannot be written; a file that was there is as it was.
    """
    parts: list[Path] = []
    n_rows = 0
    try:
        with tempfile.TemporaryDirectory(prefix=f".{path.name}.{os.getpid()}.", dir=path.parent) as temporary:
            for number, frame in enumerate(frames):
                parts.append(Path(temporary) / f"{number:08}.parquet")
                frame.write_parquet(parts[-1])
                n_rows += frame.height
            whole = Path(temporary) / "whole.parquet"
            if parts:
                pl.scan_parquet(parts, glob=False, hive_partitioning=False).sink_parquet(whole)
            else:
                pl.DataFrame(schema=schema).write_parquet(whole)
            with whole.open("rb") as file:
                os.fsync(file.fileno())
            if path.is_dir():
                raise IsADirectoryError(21, "Is a directory")
            whole.replace(path)
    except (OSError, pl.exceptions.PolarsError) as error:
        said = getattr(error, "strerror", None) or error
        raise RecordError(f"Could not write {path}: {said}. Name another file or folder.") from error
    return n_rows
