"""One evolution from one seed, and many of them at once."""

from ._classical import TaskRun, run_task
from ._condition import NAME_PATTERN, Condition, Selection
from ._evolution import Asked, Evolution, Told
from ._replay import genome_of, replay
from ._runs import frame_of, prepare_kernels, run_replicates, run_rows

__all__ = [
    "NAME_PATTERN",
    "Asked",
    "Condition",
    "Evolution",
    "Selection",
    "TaskRun",
    "Told",
    "frame_of",
    "genome_of",
    "prepare_kernels",
    "replay",
    "run_replicates",
    "run_rows",
    "run_task",
]
