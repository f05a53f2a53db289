"""The owners of the files in a folder of results."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from realitygap.errors import RecordError
from realitygap.records._chunk import ChunkName
from realitygap.records._description import DESCRIPTION_NAME
from realitygap.records._files import reading
from realitygap.records._lock import LOCK_NAME

TRIALS_NAME = "trials"
LEDGER_NAME = "ledger.sqlite"

_TEMPORARY = re.compile(r"\.(?P<target>.+)\.[0-9]+\.tmp")
"""Pattern of the names that `write_durably` uses before it renames a file to its target."""

_SYSTEM_FILES = (".DS_Store", "Thumbs.db", "desktop.ini")
_SYSTEM_PREFIXES = ("._", ".nfs")
"""First parts of the names of files that file browsers and network file systems put into any folder."""


def list_chunks(trials: Path) -> list[ChunkName]:
    """Return the chunks in a folder, by name; none while there is no folder.

    Raises:
        RecordError: there is a file that is not a chunk, or the folder cannot be read.
    """
    with reading(trials):
        entries = sorted(entry.name for entry in trials.iterdir()) if trials.exists() else []
    names = {entry: ChunkName.parse(entry) for entry in entries}
    foreign = [
        entry
        for entry, name in names.items()
        if name is None and not is_temporary(entry) and not is_system_file(entry)
    ]
    if foreign:
        raise RecordError(
            f"{trials} holds what is not a chunk of trials: {listed(foreign)}. "
            "Move it elsewhere or delete it, then run the same command again."
        )
    return [name for name in names.values() if name is not None]


def is_temporary(name: str) -> bool:
    """Return whether a file is temporary, so that a writer of this package renames or removes it."""
    match = _TEMPORARY.fullmatch(name)
    return match is not None and (
        match["target"] in (DESCRIPTION_NAME, LEDGER_NAME) or ChunkName.parse(match["target"]) is not None
    )


def is_system_file(name: str) -> bool:
    """Return whether the operating system puts such files into folders."""
    return name in _SYSTEM_FILES or name.startswith(_SYSTEM_PREFIXES)


def is_trace(entry: Path) -> bool:
    """Return whether an entry is only a trace of an interrupted `create` or `clear`, or of the operating system."""
    if entry.name == TRIALS_NAME and entry.is_dir():
        return all(is_temporary(inner.name) or is_system_file(inner.name) for inner in entry.iterdir())
    return entry.name == LOCK_NAME or is_temporary(entry.name) or is_system_file(entry.name)


def listed(names: Sequence[str], n_shown: int = 6) -> str:
    """Return names for a message, the first few of them."""
    if not names:
        return "nothing"
    shown = ", ".join(names[:n_shown])
    return shown if len(names) <= n_shown else f"{shown} and {len(names) - n_shown} more"
