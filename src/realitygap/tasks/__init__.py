"""What is rewarded."""

from ._classical import CLASSICAL_TASKS, ClassicalTask
from ._coverage import CoverageTask
from ._mazes import MAZE_TASKS, MazeAgent, MazeTask
from ._task import Task
from ._trajectories import TraceArrays, Trajectories

__all__ = [
    "CLASSICAL_TASKS",
    "MAZE_TASKS",
    "ClassicalTask",
    "CoverageTask",
    "MazeAgent",
    "MazeTask",
    "Task",
    "TraceArrays",
    "Trajectories",
]
