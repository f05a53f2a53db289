"""The file of a ledger: an SQLite database that a crash, a full disk or a reader cannot harm."""

from __future__ import annotations

import contextlib
import functools
import os
import secrets
import sqlite3
from collections.abc import Iterator
from pathlib import Path

from realitygap._limits import MOST_TEXT_BYTES
from realitygap.errors import LedgerError, RecordVersionError
from realitygap.records._files import sync_folder
from realitygap.records._inside import refuse_links, refuse_other_names

LEDGER_FORMAT = 1
"""Raised whenever the tables change; a ledger of another format is refused."""

_ENDINGS = ("", "-wal", "-shm", "-journal")
"""Endings of the names of a ledger and of the files that SQLite writes next to it."""

_APPLICATION = 0x52474C31
"""Marks the file as a ledger of ours ("RGL1"), in SQLite's `application_id`."""

_PATIENCE_S = 10.0
"""Maximum time to wait for another program that writes."""

SYNCHRONOUS = "FULL"
"""Time at which SQLite waits for the disk: at every commit."""

TABLES = """
CREATE TABLE conditions (  -- a condition on a robot, as resolved
    name TEXT PRIMARY KEY,
    hash TEXT NOT NULL,
    results_version INTEGER NOT NULL,
    settings TEXT NOT NULL,  -- JSON
    n_generations INTEGER NOT NULL,  -- of a whole run
    n_cells INTEGER NOT NULL,  -- reachable ones
    label TEXT  -- EMULATED or REAL, from its first trial on
);
CREATE TABLE sittings (  -- from opening a robot's port to closing it
    id INTEGER PRIMARY KEY,
    began TEXT NOT NULL,  -- UTC
    ended TEXT,
    label TEXT NOT NULL,
    port TEXT NOT NULL,
    robot TEXT NOT NULL,  -- JSON: model, fluke, name and versions
    preflight TEXT NOT NULL  -- JSON
);
CREATE TABLE generations (
    condition TEXT NOT NULL REFERENCES conditions(name),
    replicate INTEGER NOT NULL,
    generation INTEGER NOT NULL,
    planned TEXT NOT NULL,  -- UTC
    closed TEXT,  -- UTC; from then on its scores are frozen
    PRIMARY KEY (condition, replicate, generation)
);
CREATE TABLE individuals (
    condition TEXT NOT NULL,
    replicate INTEGER NOT NULL,
    generation INTEGER NOT NULL,
    individual INTEGER NOT NULL,
    species INTEGER NOT NULL,
    parents TEXT NOT NULL,  -- JSON list
    nodes INTEGER NOT NULL,  -- of the genome
    genome TEXT NOT NULL,  -- JSON, the fields of the records' genome
    key TEXT NOT NULL,  -- of the random numbers, as decimal digits
    fitness REAL,  -- what selection used; with the next ones written when the generation is closed
    novelty REAL,
    trial INTEGER,  -- the trial whose score counted
    score INTEGER,  -- that score
    PRIMARY KEY (condition, replicate, generation, individual),
    FOREIGN KEY (condition, replicate, generation) REFERENCES generations(condition, replicate, generation)
);
CREATE TABLE trials (
    id INTEGER PRIMARY KEY,
    condition TEXT NOT NULL,
    replicate INTEGER NOT NULL,
    generation INTEGER NOT NULL,
    individual INTEGER NOT NULL,
    attempt INTEGER NOT NULL,  -- 0, and one more for each trial that was void
    place INTEGER NOT NULL,  -- when its turn comes: ascending
    sheet INTEGER NOT NULL,  -- of paper
    pen INTEGER NOT NULL,  -- on the sheet
    code TEXT NOT NULL UNIQUE,  -- what the operator knows it by when scoring is blind
    state TEXT NOT NULL CHECK (state IN ('planned', 'running', 'driven', 'scored', 'void')),
    reason TEXT,  -- why it is void
    end TEXT,  -- why it ended
    problem TEXT,  -- what was said of it
    n_steps INTEGER,
    stalls INTEGER,
    sitting INTEGER REFERENCES sittings(id),
    started TEXT,  -- UTC
    driven TEXT,  -- UTC
    UNIQUE (condition, replicate, generation, individual, attempt),
    FOREIGN KEY (condition, replicate, generation, individual)
        REFERENCES individuals(condition, replicate, generation, individual)
);
CREATE TABLE steps (  -- a row is one command
    trial INTEGER NOT NULL REFERENCES trials(id),
    step INTEGER NOT NULL,
    time REAL NOT NULL,  -- since the trial began [s]
    raw TEXT NOT NULL,  -- JSON list, the robot's readings as they came
    readings TEXT NOT NULL,  -- JSON list, scaled to 0..1
    stalled INTEGER NOT NULL,
    move REAL NOT NULL,
    turn REAL NOT NULL,
    PRIMARY KEY (trial, step)
) WITHOUT ROWID;
CREATE TABLE scores (  -- cells as somebody entered them
    id INTEGER PRIMARY KEY,
    trial INTEGER NOT NULL REFERENCES trials(id),
    cells TEXT NOT NULL,  -- JSON list
    n_ends INTEGER,  -- cells in which steps end, where something saw them
    path TEXT,  -- JSON list of x [m], y [m], heading [rad] at quarters of steps, where something saw it
    role TEXT NOT NULL CHECK (role IN ('score', 'second', 'correction')),
    who TEXT NOT NULL,
    time TEXT NOT NULL,  -- UTC
    undone TEXT  -- UTC
);
CREATE TABLE notes (
    id INTEGER PRIMARY KEY,
    trial INTEGER REFERENCES trials(id),
    text TEXT NOT NULL,
    who TEXT NOT NULL,
    time TEXT NOT NULL  -- UTC
);
CREATE TABLE events (  -- everything that changed a trial, in order
    id INTEGER PRIMARY KEY,
    time TEXT NOT NULL,  -- UTC
    trial INTEGER REFERENCES trials(id),
    what TEXT NOT NULL,
    details TEXT NOT NULL  -- JSON
);
"""

_NAMES = (
    "conditions", "sittings", "generations", "individuals", "trials", "steps", "scores", "notes", "events"
)  # fmt: skip

_JSON = {
    "conditions": ("settings",),
    "sittings": ("robot", "preflight"),
    "individuals": ("parents", "genome"),
    "steps": ("raw", "readings"),
    "scores": ("cells", "path"),
    "events": ("details",),
}
"""Columns with JSON, which SQLite's own check does not look into."""

_NO_DELETING = "".join(
    f"CREATE TRIGGER {name}_stay BEFORE DELETE ON {name} "
    "BEGIN SELECT RAISE(ABORT, 'nothing is ever deleted from a ledger'); END;\n"
    for name in _NAMES
)

_FROZEN = """
CREATE TRIGGER closed_generations_stay BEFORE UPDATE ON generations WHEN OLD.closed IS NOT NULL
BEGIN SELECT RAISE(ABORT, 'the generation is closed'); END;
CREATE TRIGGER closed_individuals_stay BEFORE UPDATE ON individuals WHEN OLD.fitness IS NOT NULL
BEGIN SELECT RAISE(ABORT, 'the generation is closed'); END;
"""


def ledger_tables() -> dict[str, str]:
    """Return the SQL of each table, with remarks on columns that need one."""
    parts = [part.strip() + ";" for part in TABLES.split(";\n") if part.strip()]
    return {part.split()[2]: part for part in parts}


def create_file(path: Path) -> None:
    """Make an empty ledger in a temporary file first, so that its path never has an incomplete one.

    Raises:
        LedgerError: something is there, or it cannot be written.
        RecordError: it is a link, a pipe or a device.
    """
    refuse_links(path.parent, path)
    temporary = path.with_name(f".{path.name}.{secrets.randbits(63)}.tmp")
    try:
        with speaking(path):
            if path.exists():
                raise LedgerError(f"{path} exists already. A ledger is never replaced. Name another folder.")
            connection = sqlite3.connect(temporary, isolation_level=None)
            try:
                connection.executescript(
                    f"PRAGMA synchronous = {SYNCHRONOUS}; PRAGMA application_id = {_APPLICATION}; "
                    f"PRAGMA user_version = {LEDGER_FORMAT};\nBEGIN;{TABLES}{_NO_DELETING}{_FROZEN}COMMIT;"
                )
                connection.execute("PRAGMA journal_mode = WAL")
            finally:
                connection.close()
            temporary.replace(path)
            sync_folder(path.parent)
    finally:
        for ending in _ENDINGS:
            with contextlib.suppress(OSError):
                temporary.with_name(temporary.name + ending).unlink(missing_ok=True)


def connect(path: Path, *, writable: bool) -> sqlite3.Connection:
    """Return a connection to a ledger that is whole.

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
            connection.row_factory = sqlite3.Row
            connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MOST_TEXT_BYTES)
            connection.execute("PRAGMA trusted_schema = OFF")
            _check(connection, path)
            connection.execute("PRAGMA foreign_keys = ON")
            connection.execute(f"PRAGMA synchronous = {SYNCHRONOUS}")
        except BaseException:
            connection.close()
            raise
    return connection


def _address(path: Path, *, writable: bool) -> str:
    """Return the address for SQLite; a complete ledger on a read-only medium has no extra files."""
    if writable:
        return path.resolve().as_uri() + "?mode=rw"
    is_alone = not path.with_name(path.name + "-wal").exists()
    if is_alone and not os.access(path.parent, os.W_OK):
        return path.resolve().as_uri() + "?mode=ro&immutable=1"
    return path.resolve().as_uri() + "?mode=ro"


def _check(connection: sqlite3.Connection, path: Path) -> None:
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if application != _APPLICATION:
        raise LedgerError(
            f"{path} is {'empty' if not path.stat().st_size else 'not a ledger of realitygap'}, and was not "
            "changed. Restore the ledger from a copy, or move the file elsewhere."
        )
    if version != LEDGER_FORMAT:
        raise RecordVersionError(
            f"{path} is a ledger of format {version}; this realitygap reads format {LEDGER_FORMAT}. Use the version "
            "that wrote it."
        )
    (said,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    if said != "ok":
        raise LedgerError(_torn(path, str(said)))
    _check_schema(connection, path)
    _check_types(connection, path)
    _check_json(connection, path)


def _check_schema(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse what could run when the ledger is read or written: views, virtual tables and foreign triggers."""
    ours = {part.strip() for part in (_NO_DELETING + _FROZEN).split("END;")}
    for kind, name, sql in connection.execute("SELECT type, name, sql FROM sqlite_schema"):
        is_table = kind == "table" and not str(sql).upper().startswith("CREATE VIRTUAL")
        is_our_trigger = kind == "trigger" and str(sql).removesuffix("END").strip() in ours
        if not (is_table or is_our_trigger or kind == "index"):
            raise LedgerError(_torn(path, f"it has a {kind} {str(name)[:60]!r} that realitygap did not make"))


def _check_json(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse texts that are no JSON."""
    for table, columns in _JSON.items():
        broken = " OR ".join(f"NOT json_valid(coalesce({column}, 'null'))" for column in columns)
        if connection.execute(f"SELECT 1 FROM {table} WHERE {broken} LIMIT 1").fetchone():
            raise LedgerError(_torn(path, f"a text in its table {table} is not JSON, or is too deep"))


def _check_types(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse values of another type than their columns have, which SQLite itself allows."""
    for table, types in _types().items():
        wrong = " OR ".join(f"typeof({name}) NOT IN ('{kind}', 'null')" for name, kind in types.items())
        if connection.execute(f"SELECT 1 FROM {table} WHERE {wrong} LIMIT 1").fetchone():
            raise LedgerError(_torn(path, f"a value in its table {table} is of another type than its column"))


@functools.cache
def _types() -> dict[str, dict[str, str]]:
    """Return the type of each column of each table, as SQLite calls those of values."""
    with contextlib.closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(TABLES)
        columns = {name: connection.execute(f"PRAGMA table_info({name})").fetchall() for name in _NAMES}
    return {table: {row[1]: str(row[2]).lower() for row in rows} for table, rows in columns.items()}


def _torn(path: Path, said: str) -> str:
    return (
        f"{path} is torn ({said.strip()}), and was not changed. Restore it, with the files {path.name}-wal and "
        f"{path.name}-shm next to it, from a copy; `sqlite3 {path} .recover` saves the readable part."
    )


@contextlib.contextmanager
def speaking(path: Path) -> Iterator[None]:
    """Turn what SQLite and the system say of a ledger into one message.

    Raises:
        LedgerError: in place of an `sqlite3.Error` or an `OSError`.
    """
    try:
        yield
    except sqlite3.IntegrityError as error:
        raise LedgerError(f"{path} does not allow that: {error}. Nothing was changed.") from error
    except sqlite3.OperationalError as error:
        raise LedgerError(_explain(path, error)) from error
    except (sqlite3.DatabaseError, UnicodeDecodeError) as error:
        raise LedgerError(_torn(path, str(error))) from error
    except OverflowError as error:
        raise LedgerError(
            f"{path} cannot hold a number beyond 64 bits ({error}). Nothing was changed."
        ) from error
    except OSError as error:
        raise LedgerError(
            f"Could not write {path}: {error.strerror or error}. Earlier data are safe."
        ) from error


def _explain(path: Path, error: sqlite3.OperationalError) -> str:
    name = getattr(error, "sqlite_errorname", "")
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
        return _torn(path, str(error))
    return f"{path}: {error}. {safe}."
