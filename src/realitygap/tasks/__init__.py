"""What is rewarded."""

from ._classical import CLASSICAL_TASKS, ClassicalTask
from ._coverage import CoverageTask
from ._kinds import TASKS, as_task, task_model
from ._mazes import MAZE_TASKS, MazeAgent, MazeTask
from ._python import PYTHON, PythonTask
from ._task import Task
from ._trajectories import TraceArrays, Trajectories

__all__ = [
    "CLASSICAL_TASKS",
    "MAZE_TASKS",
    "PYTHON",
    "TASKS",
    "ClassicalTask",
    "CoverageTask",
    "MazeAgent",
    "MazeTask",
    "PythonTask",
    "Task",
    "TraceArrays",
    "Trajectories",
    "as_task",
    "task_model",
]
