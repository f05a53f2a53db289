"""One evolution from one seed, and many of them in parallel."""

from ._archive import RETRIES, archive_progress, corrected_archive, elites_of, retry_elites, to_ribs
from ._condition import NAME_PATTERN, Condition
from ._evolution import Evolution, named, population_of
from ._map_elites import ArchiveSettings
from ._published import MAZE_REWARDS, MazeReward, MazeRun, MazeTrials, TaskRun, run_maze, run_task
from ._replay import genome_of, partners_of, replay, trace_row
from ._runs import prepare_kernels, run_replicates, run_rows

__all__ = [
    "MAZE_REWARDS",
    "NAME_PATTERN",
    "RETRIES",
    "ArchiveSettings",
    "Condition",
    "Evolution",
    "MazeReward",
    "MazeRun",
    "MazeTrials",
    "TaskRun",
    "archive_progress",
    "corrected_archive",
    "elites_of",
    "genome_of",
    "named",
    "partners_of",
    "population_of",
    "prepare_kernels",
    "replay",
    "retry_elites",
    "run_maze",
    "run_replicates",
    "run_rows",
    "run_task",
    "to_ribs",
    "trace_row",
]
