"""Logs and tables of real robots, as other programs wrote them: read, checked, and turned into trials.

A log is a file of any size with commands, poses, encoders, and readings, each by its own clock. `LogMap` says which
column is what. `read_logs` yields its trials on one regular grid, `diagnose` names the usual mistakes, and `trial_of`
makes an observed trial of one. `write_bag` writes a trial for programs of ROS. This package fits nothing.
"""

from ._files import MappedLog, mapped_logs, mapping_of
from ._guess import guess_log_map
from ._import import ImportReport, import_log, import_logs, robot_of, target_of
from ._log import Log, arena_of, head_of, trial_of
from ._log_map import Commands, LogMap, Poses, Readings, TextFormat, Wheels, load_log_map
from ._mistakes import Diagnosis, Mistake, diagnose
from ._open import KINDS, map_beside, open_source
from ._range_table import RangeTable, read_range_table, round_robot
from ._read import read_logs
from ._scores import ScoreRow, read_scores
from ._source import Batch, Source
from ._table_map import MeasuredFrom, TableColumns, TableMap, load_table_map
from ._write_bag import WHEEL_DIAMETER_MM, BagReport, write_bag

__all__ = [
    "KINDS",
    "WHEEL_DIAMETER_MM",
    "BagReport",
    "Batch",
    "Commands",
    "Diagnosis",
    "ImportReport",
    "Log",
    "LogMap",
    "MappedLog",
    "MeasuredFrom",
    "Mistake",
    "Poses",
    "RangeTable",
    "Readings",
    "ScoreRow",
    "Source",
    "TableColumns",
    "TableMap",
    "TextFormat",
    "Wheels",
    "arena_of",
    "diagnose",
    "guess_log_map",
    "head_of",
    "import_log",
    "import_logs",
    "load_log_map",
    "load_table_map",
    "map_beside",
    "mapped_logs",
    "mapping_of",
    "open_source",
    "read_logs",
    "read_range_table",
    "read_scores",
    "robot_of",
    "round_robot",
    "target_of",
    "trial_of",
    "write_bag",
]
