"""The observer of a robot at a terminal: a person, who picks the cells that its line crosses."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

import realitygap
from realitygap._terminal import prompt

from ._grid_editor import pick_cells
from ._keys import ask_verdict

if TYPE_CHECKING:
    from realitygap.records import Observe
    from realitygap.trials import PortObserver, SheetObserver, TrialPlan, Verdict
    from realitygap.world import Arena


def attending_observer(spec: str, witness: str | None) -> PortObserver | None:
    """Return the person at the terminal, if there is one and the robot has no witness.

    Raises:
        StudyError: There is no such platform.
    """
    if (
        witness is not None
        or not sys.stdin.isatty()
        or not realitygap.platforms.platform_of(spec).needs_person
    ):
        return None
    return sheet_observer(asks_for_start=True)


def sheet_observer(*, asks_for_start: bool) -> SheetObserver:
    """Return a person at the terminal as observer.

    Args:
        asks_for_start: Whether to ask for the robot at the start of each trial; else that was asked before.
    """
    ask = _ask_for_start if asks_for_start else None
    return realitygap.trials.SheetObserver(pick_cells, realitygap.records.NO_LINE, ask, _settle)


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
    inch = realitygap.world.INCH
    x, y, heading = start.x / inch, start.y / inch, math.degrees(start.heading)
    prompt(
        f"Put the robot {x:.1f} in from the left and {y:.1f} in from the lower wall, its front {heading:.0f} "
        f"degrees counter-clockwise from the long wall{sheet}. Enter",
        default="",
        show_default=False,
        err=True,
    )
