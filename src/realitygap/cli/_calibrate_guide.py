"""Somebody at a terminal who puts a robot where a calibration wants it, and measures where it ends."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import typer

from realitygap.errors import StudyError

from ._keys import read_line

if TYPE_CHECKING:
    from realitygap.records import ObservedTrial
    from realitygap.trials import TrialPlan
    from realitygap.world import Arena, RobotModel

_INCH = 0.0254
_KEYS = "Enter goes on, r takes the one before back, q stops for now: "
_NUMBER = re.compile(r"^(-?)(?:(\d+(?:\.\d*)?|\.\d+)(?:[ -](\d+)/(\d+))?|(\d+)/(\d+))$")


class TerminalGuide:
    """Leads through the trials of a calibration.

    Args:
        arena: In which the robot stands.
        robot: Which one it is.
        ask: Prints a question and waits for the answer; a terminal when not given.
        say: Prints.
    """

    def __init__(
        self,
        arena: Arena,
        robot: RobotModel,
        *,
        ask: Callable[[str], str] | None = None,
        say: Callable[[str], None] = typer.echo,
    ) -> None:
        self._arena = arena
        self._robot = robot
        self._ask = ask or _ask_at_terminal
        self._say = say

    def place(self, plan: TrialPlan, number: int, n: int) -> Literal["go", "redo", "stop"]:
        """Say where the robot has to stand, and wait for Enter."""
        self._say(f"\nTrial {number + 1} of {n}: {self._where(plan)}")
        while True:
            answer = self._ask(_KEYS).lower()
            if not answer:
                return "go"
            if answer in ("q", "quit"):
                return "stop"
            if answer in ("r", "redo") and number:
                return "redo"
            self._say("There is none before." if answer in ("r", "redo") else f"{answer!r} is none of these.")

    def measure(self, plan: TrialPlan, trial: ObservedTrial) -> ObservedTrial | None:
        """Ask where a path ended, unless somebody saw it; None where it is to be driven again."""
        from realitygap.calibration import end_pose_of

        if plan.purpose == "sensors":
            means = "  ".join(f"{value:.2f}" for value in trial.readings.mean(axis=0))
            self._say(f"{len(trial.readings)} readings, on average {means}")
        if plan.purpose != "path" or len(trial.poses):
            return trial
        is_straight = plan.commands[0, 0] != 0
        questions = ["How far ahead of its start does it stand [in]? ", "How far to the left of it [in]? "]
        answers: list[float | None] = [0.0, 0.0]
        if is_straight:
            answers = [self._number(question) for question in questions]
        answers.append(self._number("How far did it turn to the left, with all full turns [degrees]? "))
        if None in answers:
            return None
        ahead, left, turned = (float(answer or 0.0) for answer in answers)
        return replace(trial, end_pose=end_pose_of(trial, ahead * _INCH, left * _INCH, math.radians(turned)))

    def _where(self, plan: TrialPlan) -> str:
        from realitygap.calibration import distance_of

        if plan.purpose == "sensors":
            inches = distance_of(plan, self._arena, self._robot) / _INCH
            return (
                f"put it square to a wall, its sensors {inches:g} in from it and nothing else near. It reads "
                f"{len(plan.commands)} times and does not move."
            )
        if plan.purpose == "path" and plan.commands[0, 0] != 0:
            return (
                f"put it with 24 in free ahead, and mark where it stands. It drives {len(plan.commands)} full steps "
                "ahead."
            )
        if plan.purpose == "path":
            n = len(plan.commands)
            return f"put it free on all sides, and mark which way it faces. It turns for {n} full steps."
        start = plan.start or self._arena.start
        left = min(x for wall in self._arena.walls for x in wall[::2])
        lower = min(y for wall in self._arena.walls for y in wall[1::2])
        return (
            f"put its middle {(start.x - left) / _INCH:.1f} in from the left wall and {(start.y - lower) / _INCH:.1f} "
            f"in from the lower one, turned by {math.degrees(start.heading):.0f} degrees to the left from facing "
            f"right. It drives {len(plan.commands) or plan.steps} steps."
        )

    def _number(self, question: str) -> float | None:
        """What was measured; None where the trial is to be driven again."""
        while True:
            answer = self._ask(f"{question}(r drives it again) ").lower()
            if answer in ("r", "redo"):
                return None
            value = parse_length(answer)
            if value is not None:
                return value
            self._say(f"{answer!r} is no number. Expected one such as 13.75, 13 3/4 or -2.")


def parse_length(text: str) -> float | None:
    """A number as it is read off a ruler, such as 13 3/4 or -.5; None where it is none."""
    found = _NUMBER.match(text.strip())
    if found is None:
        return None
    sign, whole, over, under, alone_over, alone_under = found.groups()
    if "0" in (under or "1", alone_under or "1"):
        return None
    value = float(whole) if whole else int(alone_over) / int(alone_under)
    value += int(over) / int(under) if over else 0.0
    return -value if sign else value


def _ask_at_terminal(question: str) -> str:
    if sys.stdin is None or not sys.stdin.isatty():
        raise StudyError(
            "There is no terminal in which to lead you through the trials. Name the witness of an emulator (--witness "
            "HOST:PORT), or fit what was recorded before (--from FILE)."
        )
    typer.echo(question, nl=False)
    return read_line()
