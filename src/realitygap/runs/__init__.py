"""One evolution from one seed, and many of them in parallel."""

from ._classical import TaskRun, run_task
from ._condition import NAME_PATTERN, Condition, Selection
from ._evolution import Asked, Evolution, Told, named, population_of
from ._mazes import MAZE_REWARDS, MazePath, MazeReward, MazeRun, MazeTrials, run_maze
from ._replay import genome_of, partners_of, replay
from ._runs import frame_of, prepare_kernels, run_replicates, run_rows

__all__ = [
    "MAZE_REWARDS",
    "NAME_PATTERN",
    "Asked",
    "Condition",
    "Evolution",
    "MazePath",
    "MazeReward",
    "MazeRun",
    "MazeTrials",
    "Selection",
    "TaskRun",
    "Told",
    "frame_of",
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
