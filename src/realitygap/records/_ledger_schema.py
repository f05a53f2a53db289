"""The schema of a ledger of physical trials."""

from __future__ import annotations

LEDGER_FORMAT = 1
"""Raised whenever the tables change; a ledger of another format is refused."""

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

TABLE_NAMES = (
    "conditions", "sittings", "generations", "individuals", "trials", "steps", "scores", "notes", "events"
)  # fmt: skip

NO_DELETING = "".join(
    f"CREATE TRIGGER {name}_stay BEFORE DELETE ON {name} "
    "BEGIN SELECT RAISE(ABORT, 'nothing is ever deleted from a ledger'); END;\n"
    for name in TABLE_NAMES
)

FROZEN = """
CREATE TRIGGER closed_generations_stay BEFORE UPDATE ON generations WHEN OLD.closed IS NOT NULL
BEGIN SELECT RAISE(ABORT, 'the generation is closed'); END;
CREATE TRIGGER closed_individuals_stay BEFORE UPDATE ON individuals WHEN OLD.fitness IS NOT NULL
BEGIN SELECT RAISE(ABORT, 'the generation is closed'); END;
"""

SCHEMA = TABLES + NO_DELETING + FROZEN
"""SQL that makes an empty ledger."""


def ledger_tables() -> dict[str, str]:
    """Return the SQL of each table, with remarks on columns that need one."""
    parts = [part.strip() + ";" for part in TABLES.split(";\n") if part.strip()]
    return {part.split()[2]: part for part in parts}
