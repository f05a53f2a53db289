"""The base of the tasks that score single steps."""

from __future__ import annotations

from typing import ClassVar

from realitygap.records import Observe
from realitygap.settings import Settings


class StepTask(Settings):
    """A task whose score depends on each step of a trial; its attributes are described at `Task`."""

    kind: str

    needs_trace: ClassVar[bool] = True
    observe: ClassVar[Observe] = "track"
    score_name: ClassVar[str]
    score_range: ClassVar[tuple[float, float]] = (0.0, 1.0)

    @property
    def name(self) -> str:
        """Name of the task, the same as `[task] kind`."""
        return self.kind
