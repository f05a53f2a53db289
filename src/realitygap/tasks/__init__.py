"""What is rewarded."""

from ._classical import CLASSICAL_TASKS, ClassicalTask
from ._coverage import CoverageTask
from ._task import Task
from ._trajectories import TraceArrays, Trajectories

__all__ = ["CLASSICAL_TASKS", "ClassicalTask", "CoverageTask", "Task", "TraceArrays", "Trajectories"]
