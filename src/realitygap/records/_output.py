"""Files outside the results, such as a report or a track: written whole, and never over results."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from realitygap.errors import RecordError
from realitygap.records._description import DESCRIPTION_NAME
from realitygap.records._files import written_beside
from realitygap.records._inside import refuse_links
from realitygap.records._listing import LEDGER_NAME, TRIALS_NAME
from realitygap.records._lock import LOCK_NAME
from realitygap.records._log import LOG_NAME

_OWN_NAMES = (DESCRIPTION_NAME, LOCK_NAME, LOG_NAME)
"""Names of the files of a study. The files of a ledger have names that begin with its own."""


def refuse_results(path: Path) -> None:
    """Return when a file may be written at `path`: it is not one that a study or a ledger lives in.

    Raises:
        RecordError: it is, under whatever name (a link, other letter case), whether it is there yet or not.
    """
    place = path.resolve()
    if place.parent.name.casefold() == TRIALS_NAME and _holds_results(place.parent.parent):
        raise RecordError(f"{path} is in a folder of a study; nothing was written. Name a file elsewhere.")
    name = place.name.casefold()
    if (name in _OWN_NAMES or name.startswith(LEDGER_NAME)) and _holds_results(place.parent):
        raise RecordError(
            f"{path} is part of a study's results and was not changed; nothing was written. Name another file."
        )


def is_special(path: Path) -> bool:
    """Return whether a path is a terminal, a device, or a pipe, which is written to and never replaced."""
    return path.exists() and not path.is_file() and not path.is_dir()


def write_whole(path: Path, data: bytes | Iterable[bytes], *, within: Path | None = None) -> None:
    """Write a temporary file and rename it, so that the path has the old file or the new one.

    Args:
        path: The file. If the user named it, a link stays and what it leads to is written, and a terminal, a device or
            a pipe is written to as it is.
        data: All of its bytes.
        within: The folder that the user named, if the name of the file in it is not the user's. Links, pipes and
            devices there are refused.

    Raises:
        RecordError: it belongs to a study's results, or cannot be written; a file that was there is as it was.
    """
    refuse_results(path)
    if within is not None:
        refuse_links(within, path)
    parts = [data] if isinstance(data, bytes) else data
    try:
        if is_special(path):
            with path.open("wb") as file:
                file.writelines(parts)
        else:
            _replace(path.resolve(), parts)
    except OSError as error:
        raise RecordError(
            f"Could not write {path}: {error.strerror or error}. Name a file in a folder that exists and can be "
            "written."
        ) from error


def _replace(place: Path, parts: Iterable[bytes]) -> None:
    if place.is_dir():
        raise IsADirectoryError(0, "it is a folder")
    with written_beside(place, parts) as temporary:
        temporary.replace(place)


def _holds_results(folder: Path) -> bool:
    return any((folder / name).exists() for name in (DESCRIPTION_NAME, LEDGER_NAME))
