"""Species, innovations and lineage of runs as a Parquet file."""

from __future__ import annotations

import warnings
from pathlib import Path

from realitygap.records import DerivedFrame, RecordWarning, ResultsFolder


def export_frame(
    folder: ResultsFolder | str | Path,
    what: DerivedFrame,
    out: str | Path,
    *,
    condition: str | None = None,
    replicate: int | None = None,
) -> Path:
    """Write species, innovations or lineage of a study's runs to a Parquet file.

    Args:
        folder: Results of a study, or the path to them. None of its files is ever replaced.
        what: species (a row is one species in one generation), innovations (one innovation number in one run) or
            lineage (one individual).
        out: File, ending in .parquet. An existing one is replaced once the new one is complete.
        condition: Condition. Default: all.
        replicate: Replicate of each condition. Default: all.

    Returns:
        The path of the file.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or the file is one of a study's own or
            cannot be written.
        TypeError: the number of the run is not a whole number.
        ValueError: there is no such condition, run, frame or ending.
    """
    out = Path(out)
    if out.suffix.lower() != ".parquet":
        raise ValueError(f"{out} ends in {out.suffix or 'nothing'}, expected .parquet.")
    with warnings.catch_warnings():
        if not isinstance(folder, ResultsFolder):
            warnings.simplefilter("default", RecordWarning)
            folder = ResultsFolder.open(folder)
        replicates = None if replicate is None else [replicate]
        if replicates is not None and folder.read(condition, replicates, ["replicate"]).is_empty():
            raise ValueError(
                f"There is no run {replicate}{'' if condition is None else f' of {condition!r}'}."
            )
        folder.write_derived(what, out, condition, replicates)
    return out
