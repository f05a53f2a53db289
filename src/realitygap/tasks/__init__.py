"""Tasks: the rewards of trials and the inputs of networks."""

from ._allowed import is_allowed, remember_allowed, source_hash
from ._coverage import CoverageTask
from ._inputs import ControllerSettings
from ._observed import score_observed
from ._published import CLASSICAL_TASKS, MAZE_TASKS, ClassicalTask, MazeAgent, MazeTask
from ._python import PYTHON, PythonDescriptor, PythonFunction, PythonTask, not_allowed, read_python_file
from ._step_tasks import WALL_SIDES, AvoidTask, GoalTask, LightTask, WallTask, wall_outlines
from ._task import TASKS, Task, as_task, task_model
from ._trajectories import TraceArrays, Trajectories

__all__ = [
    "CLASSICAL_TASKS",
    "MAZE_TASKS",
    "PYTHON",
    "TASKS",
    "WALL_SIDES",
    "AvoidTask",
    "ClassicalTask",
    "ControllerSettings",
    "CoverageTask",
    "GoalTask",
    "LightTask",
    "MazeAgent",
    "MazeTask",
    "PythonDescriptor",
    "PythonFunction",
    "PythonTask",
    "Task",
    "TraceArrays",
    "Trajectories",
    "WallTask",
    "as_task",
    "is_allowed",
    "not_allowed",
    "read_python_file",
    "remember_allowed",
    "score_observed",
    "source_hash",
    "task_model",
    "wall_outlines",
]
