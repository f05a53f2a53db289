"""The observer of a robot that a person at a terminal looks at: they pick the cells that its line crosses."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from realitygap._terminal import prompt
from realitygap.records import NO_LINE
from realitygap.trials import SheetObserver
from realitygap.world import INCH

from ._operator import ask_verdict, pick_cells

if TYPE_CHECKING:
    from realitygap.records import Observe
    from realitygap.trials import TrialPlan, Verdict
    from realitygap.world import Arena


def sheet_observer(*, asks_for_start: bool) -> SheetObserver:
    """Return a person at the terminal as observer.

    Args:
        asks_for_start: Whether to ask for the robot at the start of each trial; else that was asked before.
    """
    return SheetObserver(pick_cells, NO_LINE, _ask_for_start if asks_for_start else None, _settle)


def _settle(problem: str, can_count: bool) -> Verdict:
    """Ask about a trial that was running when the program ended."""
    if not can_count:
        prompt(f"{problem} Enter", default="", show_default=False, err=True)
        return "void"
    words = f"{problem} v: void, drive it again; d: driven, count it"
    return ask_verdict(lambda: prompt(words, err=True))


def _ask_for_start(plan: TrialPlan, arena: Arena, observe: Observe) -> None:
    """Ask for the robot at the start of a trial, and wait."""
    sheet = ", with a fresh sheet below" if observe in ("cells", "encoders") else ""
    start = plan.start or arena.start
    x, y, heading = start.x / INCH, start.y / INCH, math.degrees(start.heading)
    prompt(
        f"Put the robot {x:.1f} in from the left and {y:.1f} in from the lower wall, its front {heading:.0f} "
        f"degrees counter-clockwise from the long wall{sheet}. Enter",
        default="",
        show_default=False,
        err=True,
    )
