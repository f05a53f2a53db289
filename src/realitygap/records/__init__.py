"""Result files of studies: the only code that reads or writes them.

A `ResultsFolder` has three parts: `study.json`, the study as resolved; `trials/CONDITION.FIRST-LAST.parquet`, one file
per chunk of replicates, which is written under another name, synced, and renamed; and `log.jsonl`, times and hosts,
which are not part of the digest. A `Ledger` next to them, `ledger.sqlite`, has the trials that a robot drove. This
package handles plain dicts, arrays and polars frames. It knows nothing of genomes or studies.
"""

from realitygap.records import _cards  # noqa: F401  # what notebooks show
from realitygap.records._checkpoint import read_checkpoint, write_checkpoint
from realitygap.records._chunk import Chunk
from realitygap.records._columns import (
    COLUMNS,
    EXTRA_SCHEMA,
    KEYS,
    SCHEMA,
    Column,
    column_table,
    has_far_parents,
    list_column,
    schema_with,
)
from realitygap.records._ctrl_c import wake_on_ctrl_c
from realitygap.records._derived import DerivedFrame, derived_table
from realitygap.records._ending import EndReason, is_taken_back, is_whole, taken_back, those_that_count
from realitygap.records._folder import ResultsFolder
from realitygap.records._inbox import Delivery, MissingInboxError, deliver
from realitygap.records._inside import refuse_links, refuse_links_in
from realitygap.records._json_file import read_object
from realitygap.records._ledger import Ledger
from realitygap.records._ledger_file import ledger_stamp
from realitygap.records._ledger_kinds import (
    PATH_PARTS,
    ROBOT,
    DrivenTrial,
    Generation,
    Individual,
    PhotoCount,
    PlannedComparison,
    Score,
    ScoreRole,
    Trial,
    TrialState,
    Turn,
    settings_of_condition,
)
from realitygap.records._ledger_reader import LedgerReader
from realitygap.records._ledger_rows import complete_runs, ledger_frame
from realitygap.records._ledger_schema import ledger_tables
from realitygap.records._listing import LEDGER_NAME
from realitygap.records._locked_design import (
    AMENDED,
    LOCKED,
    RESUMED,
    UNBLINDED,
    DesignEvent,
    LockedDesign,
    canonical_json,
    secret_path,
)
from realitygap.records._observations_file import (
    Observations,
    ObservationsHead,
    not_compared,
    trial_from_dict,
    trial_to_dict,
    write_observations,
)
from realitygap.records._output import is_special, refuse_results, write_whole
from realitygap.records._published_results import PublishedResults
from realitygap.records._trial_record import CALIBRATES, NO_LINE, OBSERVATIONS, Observe, TrialRecord, sees
from realitygap.records._trial_store import (
    existing_trials,
    is_observations,
    open_ledger,
    open_saved_trials,
    read_observations,
    refuse_blind,
)
from realitygap.records._version import RESULTS_VERSION, RecordWarning

wake_on_ctrl_c()

__all__ = [  # noqa: RUF022 - grouped by subject
    # the folder and what is in it
    "ResultsFolder",
    "PublishedResults",
    "Chunk",
    "Delivery",
    "MissingInboxError",
    "deliver",
    "RESULTS_VERSION",
    "RecordWarning",
    # the columns of its frames
    "EXTRA_SCHEMA",
    "SCHEMA",
    "schema_with",
    "settings_of_condition",
    "KEYS",
    "COLUMNS",
    "Column",
    "column_table",
    "derived_table",
    "DerivedFrame",
    "list_column",
    # the ledger of physical trials
    "Ledger",
    "LedgerReader",
    "Generation",
    "Individual",
    "Turn",
    "Trial",
    "TrialState",
    "PhotoCount",
    "PlannedComparison",
    "Score",
    "ScoreRole",
    "complete_runs",
    "ledger_frame",
    # designs that are locked before trial 1
    "LockedDesign",
    "DesignEvent",
    "DrivenTrial",
    "canonical_json",
    "secret_path",
    "LOCKED",
    "RESUMED",
    "AMENDED",
    "UNBLINDED",
    # the file of a ledger
    "LEDGER_NAME",
    "ledger_stamp",
    "ledger_tables",
    # what an observer sees of trials one by one
    "TrialRecord",
    "EndReason",
    "is_whole",
    "has_far_parents",
    "is_taken_back",
    "taken_back",
    "those_that_count",
    "Observe",
    "CALIBRATES",
    "NO_LINE",
    "OBSERVATIONS",
    "PATH_PARTS",
    "ROBOT",
    "sees",
    "Observations",
    "ObservationsHead",
    "open_ledger",
    "open_saved_trials",
    "existing_trials",
    "is_observations",
    "not_compared",
    "read_observations",
    "refuse_blind",
    "write_observations",
    "trial_from_dict",
    "trial_to_dict",
    # other files, written whole
    "write_checkpoint",
    "read_checkpoint",
    "read_object",
    "refuse_links",
    "refuse_links_in",
    "write_whole",
    "refuse_results",
    "is_special",
]
