"""Tasks: the rewards of trials and the inputs of networks."""

from ._allowed import is_allowed, remember_allowed, source_hash
from ._avoid import AvoidTask
from ._classical import CLASSICAL_TASKS, ClassicalTask
from ._coverage import CoverageTask
from ._goal import GoalTask
from ._inputs import ControllerSettings
from ._kinds import TASKS, as_task, task_model
from ._light import LightTask
from ._mazes import MAZE_TASKS, MazeAgent, MazeTask
from ._observed import observed_trajectories, score_observed
from ._python import PYTHON, PythonTask, not_allowed, read_task_file
from ._task import Task
from ._trajectories import TraceArrays, Trajectories
from ._wall import WALL_SIDES, WallTask, wall_outlines

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
    "PythonTask",
    "Task",
    "TraceArrays",
    "Trajectories",
    "WallTask",
    "as_task",
    "is_allowed",
    "not_allowed",
    "observed_trajectories",
    "read_task_file",
    "remember_allowed",
    "score_observed",
    "source_hash",
    "task_model",
    "wall_outlines",
]
