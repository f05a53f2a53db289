"""Opening a target: a witness, or the operator at the terminal, places a robot and counts its cells."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from ._sheet import sheet_observer

if TYPE_CHECKING:
    from realitygap.trials import Target
    from realitygap.world import Arena


def opened_target(
    spec: str, arena: Arena, *, witness: str | None = None, processes: int | None = None, seed: int = 0
) -> Target:
    """Return a target by name. Without a witness, the operator at the terminal places a robot and counts its cells.

    Raises:
        StudyError: There is no such platform, or nobody attends to the robot.
        RobotError: It cannot be reached.
    """
    from realitygap.platforms import open_target, platform_of

    is_led = witness is None and sys.stdin.isatty() and platform_of(spec).needs_person
    observer = sheet_observer(asks_for_start=True) if is_led else None
    return open_target(spec, arena, witness=witness, observer=observer, processes=processes, key=seed)
