"""A target as a command opens it: a robot on a port is attended by its witness, or by whoever sits at the terminal."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import typer

from ._calibrate_attendant import TerminalAttendant

if TYPE_CHECKING:
    from realitygap.trials import Target, TrialPlan
    from realitygap.world import Arena, Pose


def opened_target(
    spec: str, arena: Arena, *, witness: str | None = None, processes: int | None = None, seed: int = 0
) -> Target:
    """A target by name; of a robot without a witness, somebody at the terminal places it and counts its cells.

    Raises:
        StudyError: There is no such platform, or nobody attends to the robot.
        RobotError: It cannot be reached.
    """
    from realitygap.study import open_target

    name, _, port = spec.partition(":")
    is_led = (
        name == "scribbler" and witness is None and not port.startswith("emulator:") and sys.stdin.isatty()
    )
    attendant = _Placing(arena) if is_led else None
    return open_target(spec, arena, witness=witness, attendant=attendant, processes=processes, key=seed)


class _Placing(TerminalAttendant):
    """Asks for the robot to be put at the start of each trial."""

    def place(self, plan: TrialPlan, start: Pose) -> None:
        """It stands there when Enter is pressed."""
        x, y, degrees = start.x / 0.0254, start.y / 0.0254, start.heading * 180 / 3.141592653589793
        typer.prompt(
            f"Trial {plan.number}, {plan.purpose}: put the robot {x:.1f} in from the left wall and {y:.1f} in from the "
            f"lower one, facing {degrees:.0f} degrees, with a fresh sheet and pen. Enter",
            default="",
            show_default=False,
            err=True,
        )
        super().place(plan, start)
