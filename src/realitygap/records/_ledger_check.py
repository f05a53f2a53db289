"""Checks of a ledger of any origin when it is opened: its schema, and then whether its rows fit together.

Foreign SQL in a schema would run with the first query: a generated column or a CHECK constraint can compute for hours.
So the schema is compared with ours before anything else is read.
"""

from __future__ import annotations

import contextlib
import functools
import re
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from realitygap._limits import parse_json
from realitygap.errors import LedgerError, RecordVersionError
from realitygap.records._ledger_schema import APPLICATION, LEDGER_FORMAT, SCHEMA, SCHEMA_1, TABLE_NAMES
from realitygap.settings import shown

_COMMENT_OR_SPACE = re.compile(r"('[^']*')|(?:--[^\n]*|[ \t\n\f\r])+")
"""A text of SQL, or what SQLite skips. A comment of another form remains, so a schema that has one is not ours."""

_MOST = 2**31 - 1
"""Maximum of any number of a row, generation, cell or step."""

_MOST_METERS = 1e6
"""Maximum distance in a driven path [m]."""

_KEYS = {
    "conditions": ("name",),
    "sittings": ("id",),
    "generations": ("condition", "replicate", "generation"),
    "individuals": ("condition", "replicate", "generation", "individual"),
    "head": ("id",),
    "controllers": ("id",),
    "trials": ("id",),
    "steps": ("trial", "step"),
    "scores": ("id",),
    "notes": ("id",),
    "events": ("id",),
}

_JSON = {
    "conditions": ("settings",),
    "sittings": ("robot", "preflight"),
    "individuals": ("parents", "genome"),
    "head": ("head",),
    "trials": ("record",),
    "steps": ("raw", "readings"),
    "scores": ("cells", "path"),
    "events": ("details",),
}
"""Columns with JSON, which SQLite's own check does not look into."""


@dataclass(frozen=True)
class _Rule:
    """A requirement on the rows of a table.

    Attributes:
        table: Table.
        column: Column that the message shows.
        expected: Its required value, for the message.
        broken: SQL that is true for a row that breaks the rule.
    """

    table: str
    column: str
    expected: str
    broken: str


def check_origin(connection: sqlite3.Connection, path: Path) -> int:
    """Return the format of a ledger, whose schema is ours: only then its rows may be read.

    Raises:
        LedgerError: The file is foreign, or its schema is.
        RecordVersionError: It has another format.
        sqlite3.Error: SQLite cannot read it.
    """
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if application != APPLICATION:
        raise LedgerError(
            f"{path} is {'empty' if not path.stat().st_size else 'not a ledger of realitygap'}, and was not "
            "changed. Restore the ledger from a copy, or move the file elsewhere."
        )
    if version not in (1, LEDGER_FORMAT):
        raise RecordVersionError(
            f"{path} is a ledger of format {version}; this realitygap reads formats 1 and {LEDGER_FORMAT}. Use the "
            "version that wrote it."
        )
    for problem in _foreign_schema(connection, SCHEMA_1 if version == 1 else SCHEMA):
        raise LedgerError(damaged(path, problem))
    return int(version)


def check_ledger(connection: sqlite3.Connection, path: Path) -> None:
    """Raise an error unless the rows of a ledger of our schema are such as this program could have written.

    Raises:
        LedgerError: It is damaged; the message names the first row that does not fit.
        sqlite3.Error: SQLite cannot read it.
    """
    for problem in _problems(connection):
        raise LedgerError(damaged(path, problem))


def damaged(path: Path, problem: str) -> str:
    """Return the message for a ledger that is damaged."""
    return (
        f"{path} is damaged ({problem.strip()}), and was not changed. Restore it, with the files {path.name}-wal and "
        f"{path.name}-shm next to it, from a copy; `sqlite3 {path} .recover` saves the readable part."
    )


def _problems(connection: sqlite3.Connection) -> Iterator[str]:
    """Yield what is wrong. Each check relies on those before it."""
    (message,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    if message != "ok":
        yield str(message)
    for table, types in _types().items():
        for column, kind in types.items():
            yield from _broken(
                connection, _Rule(table, column, kind, f"typeof({column}) NOT IN ('{kind}', 'null')")
            )
    for table, columns in _JSON.items():
        for column in columns:
            yield from _broken(
                connection,
                _Rule(
                    table, column, "JSON that is not too deep", f"NOT json_valid(coalesce({column}, 'null'))"
                ),
            )
    for table, number, parent, _ in connection.execute("PRAGMA foreign_key_check"):
        yield f"table {table}: row {number} refers to a row that is not in table {parent}"
    for rule in _RULES:
        yield from _broken(connection, rule)
    for name, text in connection.execute("SELECT name, settings FROM conditions"):
        try:
            parse_json(text)
        except ValueError as error:
            yield f"table conditions, name {shown(name)}: settings: {error}"


def _foreign_schema(connection: sqlite3.Connection, schema: str) -> Iterator[str]:
    """Yield the first entry of the schema that is not ours, or that is missing."""
    ours = _entries(schema)
    found = set()
    for kind, name, table, sql in connection.execute("SELECT type, name, tbl_name, sql FROM sqlite_schema"):
        entry = (kind, name, table, None if sql is None else _plain(sql))
        if entry not in ours or entry in found:
            yield f"it has a {str(kind)[:20]} {str(name)[:60]!r} that realitygap did not make"
        found.add(entry)
    for kind, name, _, _ in sorted(ours - found, key=str):
        yield f"its {kind} {name!r} is missing"


def _plain(sql: str) -> str:
    """Return SQL without comments, and with one space in place of each gap."""
    return _COMMENT_OR_SPACE.sub(lambda match: match[1] or " ", str(sql)).strip()


@functools.cache
def _entries(schema: str) -> frozenset[tuple[str, str, str, str | None]]:
    """Return the schema of an empty ledger, as SQLite keeps it."""
    with contextlib.closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(schema)
        rows = connection.execute("SELECT type, name, tbl_name, sql FROM sqlite_schema").fetchall()
    return frozenset(
        (kind, name, table, None if sql is None else _plain(sql)) for kind, name, table, sql in rows
    )


@functools.cache
def _types() -> dict[str, dict[str, str]]:
    """Return the type of each column of each table, as SQLite calls those of values."""
    with contextlib.closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(SCHEMA)
        columns = {name: connection.execute(f"PRAGMA table_info({name})").fetchall() for name in TABLE_NAMES}
    return {table: {row[1]: str(row[2]).lower() for row in rows} for table, rows in columns.items()}


def _broken(connection: sqlite3.Connection, rule: _Rule) -> Iterator[str]:
    keys = _KEYS[rule.table]
    row = connection.execute(
        f"SELECT {', '.join(keys)}, {rule.column} FROM {rule.table} AS own WHERE {rule.broken} LIMIT 1"
    ).fetchone()
    if row is not None:
        where = ", ".join(f"{key} {shown(value)}" for key, value in zip(keys, row, strict=False))
        yield f"table {rule.table}, {where}: {rule.column} is {shown(row[-1])}, expected {rule.expected}"


# rules


def _whole(table: str, column: str, least: int = 0) -> _Rule:
    return _Rule(
        table,
        column,
        f"a number from {least} to {_MOST:,}",
        f"own.{column} NOT BETWEEN {least} AND {_MOST}",
    )


def _finite(table: str, column: str, least: float, most: float) -> _Rule:
    return _Rule(
        table,
        column,
        f"a number from {least:g} to {most:g}",
        f"own.{column} NOT BETWEEN {least!r} AND {most!r}",
    )


def _one_of(table: str, column: str, *values: str) -> _Rule:
    listed = ", ".join(f"'{value}'" for value in values)
    return _Rule(table, column, " or ".join(values), f"own.{column} NOT IN ({listed})")


def _json_of(table: str, column: str, kind: str) -> _Rule:
    return _Rule(table, column, f"a JSON {kind}", f"json_type(own.{column}) <> '{kind}'")


def _not_all(value: str, kinds: str, condition: str, path: str = "$") -> str:
    """Return SQL that is true if some entry of a JSON list has another type, or does not meet a condition."""
    return (
        f"json_type({value}, '{path}') IS NOT 'array' OR EXISTS (SELECT 1 FROM json_each({value}, '{path}') AS entry "
        f"WHERE entry.type NOT IN ({kinds}) OR NOT ({condition}))"
    )


_NUMBERS = "'integer', 'real'"
_INTEGER = f"entry.value BETWEEN 0 AND {_MOST}"
_FINITE = "entry.value BETWEEN -1e300 AND 1e300"
_GENOME = {
    "hidden": ("'integer'", _INTEGER),
    "biases": (_NUMBERS, _FINITE),
    "innovation": ("'integer'", _INTEGER),
    "source": ("'integer'", _INTEGER),
    "target": ("'integer'", _INTEGER),
    "weight": (_NUMBERS, _FINITE),
    "enabled": ("'true', 'false'", "1"),
}
"""Lists of a genome: the types of JSON in them, and what each entry must be."""
_RUN = "condition = own.condition AND replicate = own.replicate"
_GENERATION = f"{_RUN} AND generation = own.generation"
_N_CELLS = (
    "coalesce((SELECT n_cells FROM trials JOIN conditions ON conditions.name = trials.condition "
    "WHERE trials.id = own.trial), (SELECT n_cells FROM head))"
)

_RULES = (
    # each value
    _whole("conditions", "results_version"),
    _whole("conditions", "n_generations", 1),
    _whole("conditions", "n_cells", 1),
    _one_of("conditions", "label", "EMULATED", "REAL"),
    _json_of("conditions", "settings", "object"),
    _whole("sittings", "id"),
    _one_of("sittings", "label", "EMULATED", "REAL"),
    _json_of("sittings", "robot", "object"),
    _json_of("sittings", "preflight", "object"),
    _whole("generations", "replicate"),
    _whole("generations", "generation"),
    _whole("individuals", "individual"),
    _whole("individuals", "species"),
    _whole("individuals", "nodes"),
    _Rule("individuals", "parents", "a list of individuals", _not_all("own.parents", "'integer'", _INTEGER)),
    *(
        _Rule(
            "individuals", "genome", f"a genome with a list {name!r}",
            _not_all("own.genome", kinds, condition, f"$.{name}"),
        )
        for name, (kinds, condition) in _GENOME.items()
    ),
    _Rule(
        "individuals", "genome", "lists of equal lengths",
        " OR ".join(
            f"json_array_length(own.genome, '$.{name}') <> json_array_length(own.genome, '$.innovation')"
            for name in ("source", "target", "weight", "enabled")
        ),
    ),
    _Rule(
        "individuals", "key", "the digits of a number below 2^64",
        "own.key GLOB '*[^0-9]*' OR length(own.key) NOT BETWEEN 1 AND 20 "
        f"OR (length(own.key) = 20 AND own.key > '{2**64 - 1}')",
    ),
    _whole("head", "n_cells", 1),
    _json_of("head", "head", "object"),
    *(
        _whole("trials", name)
        for name in ("id", "attempt", "place", "sheet", "pen", "n_steps", "stalls")
    ),
    _json_of("trials", "record", "object"),
    _Rule(
        "trials", "condition", "one, or else a purpose, a number, a record, and a head",
        "CASE WHEN own.condition IS NOT NULL THEN own.replicate IS NULL OR own.generation IS NULL "
        "OR own.individual IS NULL OR own.sheet IS NULL OR own.pen IS NULL OR own.code IS NULL "
        "OR own.purpose IS NOT NULL ELSE own.purpose IS NULL OR own.number IS NULL OR own.end IS NULL "
        "OR own.record IS NULL OR NOT EXISTS (SELECT 1 FROM head) END",
    ),
    _whole("steps", "step"),
    _finite("steps", "time", 0.0, 1e9),
    _finite("steps", "move", -1.0, 1.0),
    _finite("steps", "turn", -1.0, 1.0),
    _finite("steps", "stalled", 0, 1),
    _Rule("steps", "raw", "a list of numbers", _not_all("own.raw", _NUMBERS, _FINITE)),
    _Rule(
        "steps", "readings", "a list of numbers from 0 to 1",
        _not_all("own.readings", _NUMBERS, "entry.value BETWEEN 0 AND 1"),
    ),
    _whole("scores", "id"),
    _Rule(
        "scores", "cells", "a list of cells of the grid",
        _not_all("own.cells", "'integer'", f"entry.value >= 0 AND entry.value < {_N_CELLS}"),
    ),
    _Rule("scores", "n_ends", "a number of cells of the grid", f"own.n_ends NOT BETWEEN 0 AND {_N_CELLS}"),
    _Rule(
        "scores", "path", "a list of [x, y, heading]",
        "own.path IS NOT NULL AND CASE WHEN json_type(own.path) <> 'array' THEN 1 ELSE EXISTS ("
        "SELECT 1 FROM json_each(own.path) AS pose WHERE CASE "
        "WHEN pose.type <> 'array' THEN 1 WHEN json_array_length(pose.value) <> 3 THEN 1 "
        f"ELSE EXISTS (SELECT 1 FROM json_each(pose.value) AS entry WHERE entry.type NOT IN ({_NUMBERS}) "
        f"OR NOT entry.value BETWEEN {-_MOST_METERS} AND {_MOST_METERS}) END) END",
    ),
    _whole("notes", "id"),
    _whole("events", "id"),
    _json_of("events", "details", "object"),
    # rows together
    _Rule(
        "generations", "generation", "one more than the generation before it",
        f"own.generation > 0 AND NOT EXISTS (SELECT 1 FROM generations WHERE {_RUN} "
        "AND generation = own.generation - 1 AND closed IS NOT NULL)",
    ),
    _Rule(
        "generations", "generation", "a number below the condition's n_generations",
        "own.generation >= (SELECT n_generations FROM conditions WHERE name = own.condition)",
    ),
    _Rule(
        "individuals", "individual", "one more than the individual before it",
        f"own.individual > 0 AND NOT EXISTS (SELECT 1 FROM individuals WHERE {_GENERATION} "
        "AND individual = own.individual - 1)",
    ),
    _Rule(
        "generations", "generation", "one with as many individuals as the population of its condition",
        f"(SELECT count(*) FROM individuals WHERE {_GENERATION}) <> coalesce((SELECT "
        "json_extract(settings, '$.neat.population') FROM conditions WHERE name = own.condition), "
        f"(SELECT count(*) FROM individuals WHERE {_RUN} AND generation = 0))",
    ),
    _Rule(
        "individuals", "parents", "individuals of the generation before",
        "EXISTS (SELECT 1 FROM json_each(own.parents) AS entry WHERE NOT EXISTS (SELECT 1 FROM individuals "
        f"WHERE {_RUN} AND generation = own.generation - 1 AND individual = entry.value))",
    ),
    _Rule(
        "individuals", "individual", "one with one trial that is not void",
        f"(SELECT count(*) FROM trials WHERE {_GENERATION} AND individual = own.individual AND state <> 'void') <> 1",
    ),
    _Rule(
        "trials", "state", "a state that its score agrees with",
        "own.state IN ('driven', 'scored') AND (own.state = 'scored') <> (own.id IN (SELECT trial FROM scores "
        "WHERE role = 'score' AND undone IS NULL))",
    ),
    _Rule(
        "trials", "sitting", "the sitting in which it was driven",
        "own.state IN ('driven', 'scored') AND own.condition IS NOT NULL AND own.sitting IS NULL",
    ),
    _Rule(
        "conditions", "label", "EMULATED or REAL, because trials were driven",
        "own.label IS NULL AND EXISTS (SELECT 1 FROM trials WHERE condition = own.name AND sitting IS NOT NULL)",
    ),
    _Rule(
        "trials", "n_steps", "the number of its rows in steps, at most one less",
        "own.record IS NULL AND "
        "(SELECT count(*) FROM steps WHERE trial = own.id) - coalesce(own.n_steps, 0) NOT BETWEEN 0 AND 1",
    ),
    _Rule(
        "steps", "step", "one more than the step before it",
        "own.step > 0 AND NOT EXISTS (SELECT 1 FROM steps WHERE trial = own.trial AND step = own.step - 1)",
    ),
    _Rule(
        "steps", "time", "no time before that of the step before it",
        "own.time < (SELECT time FROM steps WHERE trial = own.trial AND step = own.step - 1)",
    ),
    *(
        _Rule(
            "steps", name, "as many numbers as in the first step of its trial",
            f"json_array_length(own.{name}) <> (SELECT json_array_length({name}) FROM steps "
            f"WHERE trial = own.trial AND step = 0){more}",
        )
        for name, more in (
            ("raw", ""),
            ("readings", " AND own.step < (SELECT n_steps FROM trials WHERE id = own.trial)"),
        )
    ),
    _Rule(
        "individuals", "score", "the score of its trial, because its generation is closed",
        f"EXISTS (SELECT 1 FROM generations WHERE {_GENERATION} AND closed IS NOT NULL) AND (own.fitness IS NULL "
        f"OR NOT EXISTS (SELECT 1 FROM trials JOIN scores ON scores.trial = trials.id WHERE trials.id = own.trial "
        f"AND scores.id = own.score AND role = 'score' AND undone IS NULL AND state = 'scored' AND {_GENERATION} "
        "AND individual = own.individual))",
    ),
)  # fmt: skip
