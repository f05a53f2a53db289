"""What is rewarded."""

from ._avoid import AvoidTask
from ._classical import CLASSICAL_TASKS, ClassicalTask
from ._coverage import CoverageTask
from ._goal import GoalTask
from ._kinds import TASKS, as_task, task_model
from ._light import LightTask
from ._mazes import MAZE_TASKS, MazeAgent, MazeTask
from ._python import PYTHON, PythonTask
from ._task import Task
from ._trajectories import TraceArrays, Trajectories
from ._wall import WallTask

__all__ = [
    "CLASSICAL_TASKS",
    "MAZE_TASKS",
    "PYTHON",
    "TASKS",
    "AvoidTask",
    "ClassicalTask",
    "CoverageTask",
    "GoalTask",
    "LightTask",
    "MazeAgent",
    "MazeTask",
    "PythonTask",
    "Task",
    "TraceArrays",
    "Trajectories",
    "WallTask",
    "as_task",
    "task_model",
]
