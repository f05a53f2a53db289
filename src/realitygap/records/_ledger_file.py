"""The file of a ledger: an SQLite database that a crash, a full disk or a reader cannot harm."""

from __future__ import annotations

import contextlib
import os
import secrets
import sqlite3
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from realitygap._limits import MOST_TEXT_BYTES
from realitygap.errors import LedgerError
from realitygap.records._files import sync_folder
from realitygap.records._inside import refuse_links, refuse_other_names
from realitygap.records._ledger_check import check_ledger, check_origin, damaged
from realitygap.records._ledger_schema import APPLICATION, FROM_1, LEDGER_FORMAT, SCHEMA

_ENDINGS = ("", "-wal", "-shm", "-journal")
"""Endings of the names of a ledger and of the files that SQLite writes next to it."""

_PATIENCE_S = 10.0
"""Maximum time to wait for another program that writes."""

MOST_READING_S = 20.0
"""Maximum time for a query, and for all checks of a ledger. A ledger of 1,000 trials needs less than a second."""

_N_OPERATIONS = 100_000
"""Number of operations of SQLite, some milliseconds, between two looks at the time and at Ctrl-C."""

_SETTLED_S = 2.0
"""Age of the last change [s] from which the times of files prove that nothing changed since."""

_INDEX_HEAD = 48
"""Bytes at the beginning of the index of recent writes, which differ after each change."""

_checked: dict[Path, tuple[tuple[Any, ...], LedgerError | int]] = {}
"""Result of the last check of each ledger, an error or its format, with the state of its files."""

_indexes: dict[tuple[int, int], int] = {}
"""Open descriptors of indexes of recent writes, by device and inode."""
_indexes_lock = threading.Lock()

SYNCHRONOUS = "FULL"
"""Time at which SQLite waits for the disk: at every commit."""


def create_file(path: Path, fill: Callable[[sqlite3.Connection], None] = lambda _: None) -> None:
    """Make a ledger in a temporary file first, so that its path never has an incomplete one.

    Args:
        path: Path of the ledger.
        fill: Writes the first rows.

    Raises:
        LedgerError: something is there, or it cannot be written.
        RecordError: it is a link, a pipe or a device.
    """
    refuse_links(path.parent, path)
    temporary = path.with_name(f".{path.name}.{secrets.randbits(63)}.tmp")
    try:
        with speaking(path):
            if path.exists():
                raise LedgerError(f"{path} exists already. A ledger is never replaced. Name another file.")
            connection = sqlite3.connect(temporary, isolation_level=None)
            try:
                make_empty(connection)
                fill(connection)
                connection.execute("PRAGMA journal_mode = WAL")
            finally:
                connection.close()
            temporary.replace(path)
            sync_folder(path.parent)
    finally:
        for ending in _ENDINGS:
            with contextlib.suppress(OSError):
                temporary.with_name(temporary.name + ending).unlink(missing_ok=True)


def make_empty(connection: sqlite3.Connection) -> None:
    """Make the tables of a ledger."""
    connection.row_factory = sqlite3.Row
    connection.executescript(
        f"PRAGMA synchronous = {SYNCHRONOUS}; PRAGMA application_id = {APPLICATION}; "
        f"PRAGMA user_version = {LEDGER_FORMAT};\nBEGIN;{SCHEMA}COMMIT;"
    )


def connect(path: Path, *, writable: bool) -> sqlite3.Connection:
    """Return a connection to a ledger that is whole. One of format 1 is converted; if it is only read, a copy is.

    Raises:
        LedgerError: it is missing, torn, foreign or locked.
        RecordError: It, or one of SQLite's files next to it, is a link, a pipe or a device.
        RecordVersionError: it has another format.
    """
    if not path.exists():
        raise LedgerError(f"There is no ledger at {path}. A study begins one when it first drives a robot.")
    # SQLite follows links, also for the files next to the ledger, which it writes even when it only reads
    refuse_links(path.parent, *(path.with_name(path.name + ending) for ending in _ENDINGS))
    if writable:
        refuse_other_names(path, path.stat())
    with speaking(path):
        connection = sqlite3.connect(
            _address(path, writable=writable), uri=True, isolation_level=None, timeout=_PATIENCE_S
        )
        try:
            connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MOST_TEXT_BYTES)
            connection.execute("PRAGMA trusted_schema = OFF")
            if _check_once(connection, path) == 1:
                if writable:
                    _convert(connection)
                else:
                    with contextlib.closing(connection) as old:
                        connection = _converted(old)
            connection.row_factory = sqlite3.Row
            connection.execute("PRAGMA foreign_keys = ON")
            connection.execute(f"PRAGMA synchronous = {SYNCHRONOUS}")
        except BaseException:
            connection.close()
            raise
    return connection


def _converted(old: sqlite3.Connection) -> sqlite3.Connection:
    """Return a copy, in memory, of a ledger of format 1 in the present format."""
    copy = sqlite3.connect(":memory:", isolation_level=None)
    old.backup(copy)
    _convert(copy)
    return copy


def _convert(connection: sqlite3.Connection) -> None:
    """Convert a ledger of format 1, unless another program has done so since it was checked."""
    try:
        connection.executescript(FROM_1)
    except sqlite3.Error:
        connection.rollback()
        if connection.execute("PRAGMA user_version").fetchone() != (LEDGER_FORMAT,):
            raise


def ledger_stamp(path: Path) -> tuple[Any, ...]:
    """Return a value that changes with the readable part of the ledger; empty if there is no ledger.

    Files change before what was written to them can be read, by as long as the disk takes to keep it: so the head of
    the index is looked at, which SQLite writes last, and by which it knows itself that there is something new
    (sqlite.org/walformat.html, section 2.1).
    """
    found: list[Any] = []
    for ending in ("", "-wal"):
        with contextlib.suppress(OSError):
            status = path.with_name(path.name + ending).stat()
            found.append((ending, status.st_dev, status.st_ino, status.st_mtime_ns, status.st_size))
    with contextlib.suppress(OSError):
        found.append(_peek(path.with_name(path.name + "-shm"), _INDEX_HEAD))
    return tuple(found)


def _peek(path: Path, n: int) -> bytes:
    """Return the first bytes of an index of recent writes.

    If a program closes a file, POSIX releases all locks that the program has on it, also those of SQLite's connections.
    Then another program takes the index for unused, and truncates it while this one has it in its memory
    (sqlite.org/howtocorrupt.html, section 2.2). So an index stays open until SQLite has removed it.
    """
    if sys.platform == "win32":  # which removes no file that is open, and keeps the locks
        with path.open("rb") as index:
            return index.read(n)
    with _indexes_lock:
        status = path.stat()
        key = (status.st_dev, status.st_ino)
        if key not in _indexes:
            for old, descriptor in list(_indexes.items()):
                if os.fstat(descriptor).st_nlink == 0:
                    os.close(_indexes.pop(old))
            _indexes[key] = os.open(path, os.O_RDONLY)
        return os.pread(_indexes[key], n, 0)


def is_ledger(path: Path) -> bool:
    """Return whether a file is a ledger, of this version or another.

    SQLite reads it, and keeps the locks of other connections of this program when it closes the file.
    """
    try:
        with contextlib.closing(
            sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
        ) as connection:
            return bool(connection.execute("PRAGMA application_id").fetchone() == (APPLICATION,))
    except sqlite3.Error:
        return False


def _check_once(connection: sqlite3.Connection, path: Path) -> int:
    """Return the format of a ledger; check it unless this program has checked it since its last change.

    Raises:
        LedgerError: It is foreign or damaged, or its checks take too long.
    """
    stamp = ledger_stamp(path)
    known, result = _checked.get(path, ((), LEDGER_FORMAT))
    if known != stamp:
        try:
            result = _check(connection, path)
        except LedgerError as error:
            if isinstance(error.__cause__, sqlite3.Error):  # such as a lock, which may be gone the next time
                raise
            result = error
        if time.time() - path.stat().st_mtime > _SETTLED_S:
            _checked[path] = (stamp, result)
    if isinstance(result, LedgerError):
        raise type(result)(str(result))
    return result


def _check(connection: sqlite3.Connection, path: Path) -> int:
    """Return the format of a ledger, all of which is checked."""
    with speaking(path, connection):
        version = check_origin(connection, path)
        if version == LEDGER_FORMAT:
            check_ledger(connection, path)
            return version
        with contextlib.closing(_converted(connection)) as copy, speaking(path, copy):
            check_ledger(copy, path)
    return version


def _address(path: Path, *, writable: bool) -> str:
    """Return the address for SQLite; a complete ledger on a read-only medium has no extra files."""
    if writable:
        return path.resolve().as_uri() + "?mode=rw"
    is_alone = not path.with_name(path.name + "-wal").exists()
    if is_alone and not os.access(path.parent, os.W_OK):
        return path.resolve().as_uri() + "?mode=ro&immutable=1"
    return path.resolve().as_uri() + "?mode=ro"


@contextlib.contextmanager
def speaking(path: Path, connection: sqlite3.Connection | None = None) -> Iterator[None]:
    """Turn errors of SQLite and the system into one message.

    Args:
        path: The ledger.
        connection: Connection that only reads in the block, and therefore ends after `MOST_READING_S`, or with Ctrl-C.

    Raises:
        KeyboardInterrupt: Ctrl-C ended a query.
        LedgerError: in place of an `sqlite3.Error` or an `OSError`.
    """
    ends = time.monotonic() + MOST_READING_S
    if connection is not None:
        connection.set_progress_handler(lambda: time.monotonic() > ends, _N_OPERATIONS)
    try:
        yield
    except sqlite3.IntegrityError as error:
        raise LedgerError(f"{path} does not allow that: {error}. Nothing was changed.") from error
    except sqlite3.OperationalError as error:
        if _name_of(error) == "SQLITE_INTERRUPT":
            if time.monotonic() <= ends:  # Python dropped the exception that came out of the handler
                raise KeyboardInterrupt from None
            raise LedgerError(
                f"{path} cannot be read within {MOST_READING_S:.0f} s, expected less than a second. Is it somebody "
                "else's file? Move it elsewhere, or restore it from a copy."
            ) from None
        raise LedgerError(_explain(path, error)) from error
    except (sqlite3.DatabaseError, UnicodeDecodeError) as error:
        if isinstance(error, sqlite3.Error) and _name_of(error) == "SQLITE_NOTADB":
            raise LedgerError(
                f"{path} has no trials of realitygap, or its beginning is damaged. It was not changed. Restore it "
                "from a copy, or name another file."
            ) from error
        raise LedgerError(damaged(path, str(error))) from error
    except OverflowError as error:
        raise LedgerError(
            f"{path} cannot hold a number beyond 64 bits ({error}). Nothing was changed."
        ) from error
    except OSError as error:
        raise LedgerError(
            f"Could not write {path}: {error.strerror or error}. Earlier data are safe."
        ) from error
    finally:
        if connection is not None:
            with contextlib.suppress(sqlite3.ProgrammingError):  # it is closed
                connection.set_progress_handler(None, 0)


def _explain(path: Path, error: sqlite3.OperationalError) -> str:
    name = _name_of(error)
    safe = "All that was written before is safe"
    if name.startswith(("SQLITE_BUSY", "SQLITE_LOCKED")):
        return (
            f"{path} is in use: another program has been writing to it for {_PATIENCE_S:.0f} s. {safe}. Wait until it "
            "ends, then run the same command again."
        )
    if name.startswith(("SQLITE_FULL", "SQLITE_IOERR")):
        return (
            f"Could not write {path}: {error}. {safe}. Make room there (the disk, a quota or a limit on file "
            "sizes is full), then run the same command again to resume."
        )
    if name.startswith(("SQLITE_READONLY", "SQLITE_CANTOPEN", "SQLITE_PERM")):
        return f"Could not write {path}: {error}. {safe}. Make the folder writable for this account."
    if name.startswith(("SQLITE_CORRUPT", "SQLITE_NOTADB")) or "Could not decode" in str(error):
        return damaged(path, str(error))
    return f"{path}: {error}. {safe}."


def _name_of(error: sqlite3.Error) -> str:
    """Return SQLite's name of an error; empty if Python raised it itself."""
    return str(getattr(error, "sqlite_errorname", ""))
