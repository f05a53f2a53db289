"""The platform `recorded`: trials of a file, which are looked up and not run."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from realitygap.trials import Target
from realitygap.world import Arena

from .._platform import Opening, Platform


class RecordedPlatform(Platform):
    """The trials in a file of observed trials."""

    name: ClassVar[str] = "recorded"
    summary: ClassVar[str] = "earlier trials: looked up in a file or a log"
    rest: ClassVar[str] = "FILE"
    rest_setting: ClassVar[str] = "file"
    needs_rest: ClassVar[bool] = True
    is_for_studies: ClassVar[bool] = False

    file: str = Field("", description="File of the trials.")

    def open(self, arena: Arena, how: Opening) -> Target:
        """Open the file; the arena is the one that it names."""
        from ._target import RecordedTarget

        return RecordedTarget(self.file, name=how.name)
