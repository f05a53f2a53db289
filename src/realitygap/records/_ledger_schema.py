"""The schema of a ledger: the trials of a study on a robot, or those that a command saved."""

from __future__ import annotations

from collections.abc import Iterable

LEDGER_FORMAT = 2
"""Raised whenever the tables change. Format 1 is converted by `FROM_1`; a later one is refused."""

APPLICATION = 0x52474C31
"""Marks the file as a ledger of ours ("RGL1"), in SQLite's `application_id`."""

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
CREATE TABLE head (  -- what the trials of a command have in common; no row in a study
    id INTEGER PRIMARY KEY CHECK (id = 1),
    began TEXT NOT NULL,  -- UTC
    n_cells INTEGER NOT NULL,  -- of the arena's grid
    head TEXT NOT NULL,  -- JSON: target, label, robot, arena, step_s, observe, identity
    origin TEXT  -- SHA-256 of the JSON lines that were converted
);
CREATE TABLE controllers (  -- that a command drove
    id INTEGER PRIMARY KEY,
    genome TEXT NOT NULL UNIQUE  -- JSON
);
CREATE TABLE trials (
    id INTEGER PRIMARY KEY,
    condition TEXT,  -- this and the next three: of a study
    replicate INTEGER,
    generation INTEGER,
    individual INTEGER,
    attempt INTEGER NOT NULL,  -- 0, and one more for each trial that was void
    place INTEGER NOT NULL,  -- when its turn comes: ascending
    sheet INTEGER,  -- of paper, in a study
    pen INTEGER,  -- on the sheet
    code TEXT UNIQUE,  -- what the operator knows it by when scoring is blind
    state TEXT NOT NULL CHECK (state IN ('planned', 'running', 'driven', 'scored', 'void')),
    reason TEXT,  -- why it is void
    end TEXT,  -- why it ended
    problem TEXT,  -- what was said of it
    n_steps INTEGER,
    stalls INTEGER,
    sitting INTEGER REFERENCES sittings(id),
    started TEXT,  -- UTC
    driven TEXT,  -- UTC
    purpose TEXT,  -- this and the next three: of a command
    number INTEGER,  -- on its platform, which selects its noise
    controller INTEGER REFERENCES controllers(id),  -- NULL if commands were given
    record TEXT,  -- JSON: the trial as driven and observed, without its controller
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

_NEW_NAMES = ("head", "controllers", "trials")
"""Tables that format 1 lacks, or has in another form."""

TABLE_NAMES = (
    "conditions", "sittings", "generations", "individuals", "head", "controllers", "trials", "steps", "scores", "notes",
    "events",
)  # fmt: skip


def _no_deleting(names: Iterable[str]) -> str:
    return "".join(
        f"CREATE TRIGGER {name}_stay BEFORE DELETE ON {name} "
        "BEGIN SELECT RAISE(ABORT, 'nothing is ever deleted from a ledger'); END;\n"
        for name in names
    )


def ledger_tables() -> dict[str, str]:
    """Return the SQL of each table, with remarks on columns that need one."""
    parts = [part.strip() + ";" for part in TABLES.split(";\n") if part.strip()]
    return {part.split()[2]: part for part in parts}


FROZEN = """
CREATE TRIGGER closed_generations_stay BEFORE UPDATE ON generations WHEN OLD.closed IS NOT NULL
BEGIN SELECT RAISE(ABORT, 'the generation is closed'); END;
CREATE TRIGGER closed_individuals_stay BEFORE UPDATE ON individuals WHEN OLD.fitness IS NOT NULL
BEGIN SELECT RAISE(ABORT, 'the generation is closed'); END;
"""

_INDEXES = """
CREATE INDEX trials_by_number ON trials(number);
CREATE INDEX trials_by_place ON trials(place);
CREATE INDEX scores_by_trial ON scores(trial);
"""

SCHEMA = TABLES + _INDEXES + _no_deleting(TABLE_NAMES) + FROZEN
"""SQL that makes an empty ledger."""

_TRIALS_1 = """
CREATE TABLE trials ( id INTEGER PRIMARY KEY, condition TEXT NOT NULL, replicate INTEGER NOT NULL,
generation INTEGER NOT NULL, individual INTEGER NOT NULL, attempt INTEGER NOT NULL, place INTEGER NOT NULL,
sheet INTEGER NOT NULL, pen INTEGER NOT NULL, code TEXT NOT NULL UNIQUE,
state TEXT NOT NULL CHECK (state IN ('planned', 'running', 'driven', 'scored', 'void')), reason TEXT, end TEXT,
problem TEXT, n_steps INTEGER, stalls INTEGER, sitting INTEGER REFERENCES sittings(id), started TEXT, driven TEXT,
UNIQUE (condition, replicate, generation, individual, attempt),
FOREIGN KEY (condition, replicate, generation, individual)
REFERENCES individuals(condition, replicate, generation, individual) );
"""

SCHEMA_1 = (
    "\n".join(sql for name, sql in ledger_tables().items() if name not in _NEW_NAMES)
    + _TRIALS_1
    + _no_deleting(name for name in TABLE_NAMES if name not in _NEW_NAMES[:2])
    + FROZEN
)
"""SQL that made an empty ledger of format 1."""

FROM_1 = f"""
PRAGMA legacy_alter_table = ON;  -- other tables go on referring to trials
BEGIN IMMEDIATE;
ALTER TABLE trials RENAME TO trials_of_format_1;
{"".join(ledger_tables()[name] for name in _NEW_NAMES)}
INSERT INTO trials SELECT *, NULL, NULL, NULL, NULL FROM trials_of_format_1;
DROP TABLE trials_of_format_1;
{_INDEXES}
{_no_deleting(_NEW_NAMES)}
PRAGMA user_version = {LEDGER_FORMAT};
COMMIT;
PRAGMA legacy_alter_table = OFF;
"""
"""SQL that converts a ledger of format 1: as a whole or not at all."""
