"""Keeping what is written for other programs out of folders of results."""

from __future__ import annotations

from pathlib import Path

from realitygap.errors import RecordError
from realitygap.records._description import DESCRIPTION_NAME


def refuse_results_folder(path: Path) -> None:
    """Return when a file at `path` would lie in no folder of results, nor below one.

    Raises:
        RecordError: it would.
    """
    for folder in path.resolve().parents:
        if (folder / DESCRIPTION_NAME).exists():
            raise RecordError(
                f"{path} lies in {folder}, a folder of results, where nothing else is written. Name a file elsewhere."
            )
