"""One evolution from one seed, and many of them in parallel."""

from ._condition import NAME_PATTERN, Condition, Selection
from ._evolution import Candidate, Evolution, SelectionScores, named, population_of
from ._published import MAZE_REWARDS, MazePath, MazeReward, MazeRun, MazeTrials, TaskRun, run_maze, run_task
from ._replay import genome_of, partners_of, replay
from ._runs import prepare_kernels, run_replicates, run_rows

__all__ = [
    "MAZE_REWARDS",
    "NAME_PATTERN",
    "Candidate",
    "Condition",
    "Evolution",
    "MazePath",
    "MazeReward",
    "MazeRun",
    "MazeTrials",
    "Selection",
    "SelectionScores",
    "TaskRun",
    "genome_of",
    "named",
    "partners_of",
    "population_of",
    "prepare_kernels",
    "replay",
    "run_maze",
    "run_replicates",
    "run_rows",
    "run_task",
]
