"""Files in which commands save trials, and what people name in place of them: folders, and lines of JSON."""

from __future__ import annotations

import hashlib
import sqlite3
import warnings
from pathlib import Path

from realitygap.errors import RecordError

from ._files import reading
from ._inside import refuse_links
from ._ledger import Ledger
from ._ledger_file import create_file, is_ledger, make_empty
from ._listing import LEDGER_NAME
from ._lock import FolderLock
from ._observations_file import Observations, ObservationsHead, read_lines
from ._output import refuse_results
from ._version import RecordWarning

ENDING = ".sqlite"
LINES = ".jsonl"


def open_saved_trials(path: Path | str, head: ObservationsHead, *, within: Path | None = None) -> Ledger:
    """Open the trials of a command to save more of them, or make the file. Until it is closed, no other command can.

    Lines of JSON, in which commands of realitygap 0.1 saved trials, are converted.

    Args:
        path: Path of the file.
        head: What its trials have in common.
        within: The folder that the user named, if the name of the file in it is not the user's.

    Raises:
        RecordError: It is another file, of another target, damaged, in use, or cannot be written.
    """
    path = Path(path)
    if within is None and path.is_symlink():  # the user named it
        path = path.resolve()
    refuse_links(path.parent if within is None else within, path)
    if within is not None:
        path = existing_trials(path)
    if _is_lines(path):
        path = convert_lines(path)
    elif path.suffix == LINES:
        new = path.with_suffix(ENDING)
        raise RecordError(
            f"{path} would be lines of JSON, and trials are saved in a database. Name {new}. When it has trials, "
            f"`realitygap trials export {new} -o {path}` writes them as lines."
        )
    refuse_results(path)
    lock = FolderLock(path.parent, path.name)
    lock.acquire(lambda: None)
    try:
        if not path.exists():
            create_file(path, lambda connection: Ledger(path, connection).begin(head))
        ledger = Ledger.open(path)
        ledger.lock = lock
    except BaseException:
        lock.release()
        raise
    try:
        ledger.adopt(head)
    except BaseException:
        ledger.close()
        raise
    return ledger


def existing_trials(path: Path) -> Path:
    """Return the file of trials whose name a command chose: the lines of JSON in its place if only those exist."""
    lines = path.with_suffix(LINES)
    return lines if not path.exists() and _is_lines(lines) else path


def open_ledger(source: Path | str, *, writable: bool = True) -> Ledger:
    """Open the ledger in a folder of results, or in a file in which a command saved its trials.

    Lines of JSON are converted if the ledger is to be written; otherwise they are read into memory.

    Raises:
        RecordError: There is none, or it cannot be read or written.
    """
    path = Path(source)
    if path.is_dir():
        files = [file for ending in (ENDING, LINES) for file in sorted(path.glob(f"*/*{ending}"))]
        path = path / LEDGER_NAME
        if files and not path.exists():
            raise RecordError(f"{source} has several files of trials. Name one, such as {files[0]}.")
    if not _is_lines(path):
        return Ledger.open(path, writable=writable)
    if writable:
        return Ledger.open(convert_lines(path))
    if (converted := _conversion_of(path)) is not None:
        return Ledger.open(converted, writable=False)
    observations = read_lines(path)
    connection = sqlite3.connect(":memory:", isolation_level=None)
    make_empty(connection)
    ledger = Ledger(path, connection)
    ledger.begin(observations.head, observations)
    connection.execute("PRAGMA query_only = ON")
    return ledger


def convert_lines(path: Path) -> Path:
    """Return the file with the trials of a file of JSON lines, which stays as it is; make it if there is none.

    Warns:
        RecordWarning: It was made now.

    Raises:
        RecordError: The lines are damaged, or have changed since they were converted, or there is another file.
    """
    new = path.with_suffix(ENDING)
    if (converted := _conversion_of(path)) is not None:
        return converted
    if new.exists():
        raise RecordError(
            f"The trials of {path} would be converted into {new}, which exists and has others, or {path} has changed "
            f"since. Nothing was changed. Name {new}, or move one of them elsewhere."
        )
    refuse_results(new)
    observations = read_lines(path)
    origin = _sha256(path)
    create_file(
        new,
        lambda connection: Ledger(new, connection).begin(observations.head, observations, origin),
    )
    warnings.warn(
        f"The trials of {path} were converted. They are saved in {new} from now on, and {path} stays as it is. "
        f"{observations.problem}".strip(),
        RecordWarning,
        stacklevel=3,
    )
    return new


def _conversion_of(path: Path) -> Path | None:
    """Return the file into which lines of JSON were converted; None if they were not, or have changed since."""
    new = path.with_suffix(ENDING)
    if is_observations(new):
        with Ledger.open(new, writable=False) as ledger:
            if ledger.origin() == _sha256(path):
                return new
    return None


def _sha256(path: Path) -> str:
    with reading(path), path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def is_observations(path: Path | str) -> bool:
    """Return whether a file begins as one with observed trials does, of this version or another."""
    path = Path(path)
    return path.is_file() and (is_ledger(path) or _is_lines(path))


def _is_lines(path: Path) -> bool:
    """Return whether a file that is no ledger begins as lines of JSON do."""
    if not path.is_file() or is_ledger(path):
        return False
    with reading(path), path.open("rb") as file:
        return b"realitygap observations" in file.read(200)


def read_observations(path: Path | str) -> Observations:
    """Read the trials of a file: of one in which a command saved them, or of lines of JSON.

    A torn last line is left out, and `problem` says so.

    Raises:
        RecordError: There is none, it is of another format, damaged before its last line, or its design is blind.
    """
    path = Path(path)
    if not path.exists():
        raise RecordError(f"There is no file {path}. Name one with observed trials.")
    if is_ledger(path):
        with Ledger.open(path, writable=False) as ledger:
            refuse_blind(ledger)
            return ledger.observations()
    return read_lines(path)


def refuse_blind(ledger: Ledger) -> None:
    """Raise an error if the results of a ledger's arms are not shown yet.

    Raises:
        RecordError: Its design is blind.
    """
    design = ledger.design()
    if design is not None and design.is_blind:
        raise RecordError(
            f"The design of {ledger.path} is blind, and these figures would show results by arm. After the last trial, "
            f'unblind it: realitygap trials unblind {ledger.path} --reason "complete"'
        )
