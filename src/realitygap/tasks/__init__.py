"""What is rewarded."""

from ._classical import CLASSICAL_TASKS, ClassicalTask
from ._coverage import CoverageTask

__all__ = ["CLASSICAL_TASKS", "ClassicalTask", "CoverageTask"]
